# SPDX-License-Identifier: GPL-3.0-or-later
"""View dependence in a shader group: what the random walk under the surface needs, and gives.

Wiring, l the mean free path per channel:

    Sigma0 x Ratio x Free Path = l --+-> x H at 2 lengths of kappa's --> Mean --------+
    sigma x Free Path = l kappa -----|-> Curvedness ----------------------------------+-> Walk
    normal . view -> View Cosine ----|------------------------------------------------+    |
    shape operator on the view's tangent = S t -> x mean l x Tilt -> normal - . -> N'      |
    Reflected where l > 0, else Base Color; Variance and Haze to the look-ups  <-----------+
"""

from __future__ import annotations

from dataclasses import dataclass

from ... import ids
from ...core.curvature.scale_space import MEAN_LENGTH
from ...core.walk.material import model_of_key
from ..nodes.tree import Operand, Socket, Sockets, TreeBuilder
from ..nodes.walk import walk_group
from .curvature import diffused_node, level_nodes, size_node
from .variant import CONSTANT, FLAT, SCALED, Variant

_THIRDS = (1.0 / 3.0,) * 3


@dataclass(frozen=True)
class Walk:
    """What the walk changes."""

    reflected: Socket
    """In place of the base colour, per channel."""
    variance: Operand
    """Of the blur, per channel."""
    haze: Operand | None
    """See `haze_group` in nodes/walk.py; None on a flat surface."""
    shift: Socket | None
    """What is taken off every normal; None on a flat surface."""


def add_walk(
    b: TreeBuilder, variant: Variant, given: Sockets, sigma: Operand, normal: Socket
) -> Walk:
    """Add the walk of a variant that has one.

    Args:
        b: Builder of the shader group.
        variant: Of the group.
        given: The group's inputs.
        sigma: sigma0 kappa per channel.
        normal: The shading normal, with a map where there is one.
    """
    curved = variant.source != FLAT
    model = model_of_key(variant.walk)
    geometry = b.node("ShaderNodeNewGeometry").outputs
    towards = geometry["Incoming"]
    node = b.group(
        walk_group(variant.walk, model, curved=curved),
        "Walk",
        Base_Color=given[ids.BASE_COLOR],
        View_Cosine=b.vector("DOT_PRODUCT", normal, towards),
    )
    ratio = b.vector("MULTIPLY", given[ids.SIGMA0_RATIO], given[ids.FREE_PATH])
    lengths = b.vector("SCALE", ratio, scale=given[ids.SIGMA0])
    lengths = b.vector("MAXIMUM", lengths, (0.0, 0.0, 0.0))
    # An opaque surface, or channel, is Lambert's.
    scatters = b.vector("SIGN", lengths)
    # The walk ends at a colour of 1; what is above it stays the factor that it is without a walk.
    above = b.vector("MAXIMUM", given[ids.BASE_COLOR], (1.0, 1.0, 1.0))
    walked = b.vector("MULTIPLY", node.outputs[ids.REFLECTED], above)
    change = b.vector("SUBTRACT", walked, given[ids.BASE_COLOR])
    reflected = b.vector("MULTIPLY_ADD", change, scatters, given[ids.BASE_COLOR])
    if not curved:
        return Walk(reflected, (0.0, 0.0, 0.0), None, None)
    b.feed(node.inputs[ids.CURVEDNESS], b.vector("MULTIPLY", sigma, given[ids.FREE_PATH]))
    size = size_node(b) if variant.source == SCALED else None
    if size is not None:
        lengths = b.vector("SCALE", lengths, scale=size)
    mean = _mean(b, variant, given, size)
    b.feed(node.inputs[ids.MEAN], b.vector("SCALE", lengths, scale=mean))
    outputs = node.outputs
    own = geometry["Normal"]
    facing = b.math("MULTIPLY", b.vector("DOT_PRODUCT", own, towards), -1.0)
    tangent = b.vector("MULTIPLY_ADD", own, facing, towards)
    if variant.source == CONSTANT:
        turned = b.vector("SCALE", tangent, scale=mean)
    else:
        turned = _turned(b, tangent)
    reach = b.math("MULTIPLY", b.vector("DOT_PRODUCT", lengths, _THIRDS), outputs[ids.TILT])
    shift = b.vector("SCALE", turned, scale=reach)
    # Where the curvature is noise the normal must not turn over.
    longest = b.math("MAXIMUM", 1.0, b.vector("LENGTH", shift))
    shift = b.vector("SCALE", shift, scale=b.math("DIVIDE", 1.0, longest))
    return Walk(reflected, outputs[ids.VARIANCE], outputs[ids.HAZE], shift)


def _mean(b: TreeBuilder, variant: Variant, given: Sockets, size: Socket | None) -> Socket:
    """Return the mean curvature over which the energy is gathered, of the mesh as measured."""
    if variant.source == CONSTANT:
        return given[ids.MEAN]
    red, green, blue = b.separate(given[ids.SIGMA0_RATIO])
    widest = b.math("MAXIMUM", b.math("MAXIMUM", red, green), blue)
    length = b.math("MULTIPLY", b.math("MULTIPLY", given[ids.SIGMA0], widest), MEAN_LENGTH)
    if size is not None:
        length = b.math("MULTIPLY", length, size)
    return diffused_node(b, level_nodes(b, ids.MEAN_ATTRIBUTE), length)


def _turned(b: TreeBuilder, tangent: Socket) -> Socket:
    """Return S t: the shape operator is stored in the object's axes.

    Per unit of the mesh as measured. With d = (xx, yy, zz) and m = (yz, xz, xy) it is
    d t + (m.z, m.x, m.y) (t.y, t.z, t.x) + (m.y, m.z, m.x) (t.z, t.x, t.y).
    """
    diagonal, mixed = (
        b.node("ShaderNodeAttribute", attribute_name=name).outputs["Vector"]
        for name in (ids.SHAPE_ATTRIBUTE, ids.SHAPE_MIXED_ATTRIBUTE)
    )
    t = _transformed(b, tangent, "WORLD", "OBJECT")
    x, y, z = b.separate(t)
    p, q, r = b.separate(mixed)
    result = b.vector("MULTIPLY", diagonal, t)
    result = b.vector("MULTIPLY_ADD", b.combine(r, p, q), b.combine(y, z, x), result)
    result = b.vector("MULTIPLY_ADD", b.combine(q, r, p), b.combine(z, x, y), result)
    return _transformed(b, result, "OBJECT", "WORLD")


def _transformed(b: TreeBuilder, vector: Socket, source: str, target: str) -> Socket:
    node = b.node(
        "ShaderNodeVectorTransform", vector_type="VECTOR", convert_from=source, convert_to=target
    )
    b.feed(node.inputs["Vector"], vector)
    return node.outputs["Vector"]
