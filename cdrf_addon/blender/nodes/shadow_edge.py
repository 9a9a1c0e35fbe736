# SPDX-License-Identifier: GPL-3.0-or-later
"""The coloured edge of a cast shadow: visibility blurred over the surface by each channel's sigma0.

A shadow map gives the visibility of the shaded point only. That of its neighbours comes from the
Raycast node (Blender 5.1 and later), which EEVEE traces in screen space: it finds what the camera
sees. Its rays count only where the one at the shaded point agrees with the shadow map. Elsewhere
(an occluder out of view, or taken for thicker than it is) the edge stays as sharp as the light
makes it.

The blur is a Gaussian of standard deviation sigma0 in the tangent plane, to which both the sphere
and the ring model reduce on a plane. Five rays serve all channels: one for each ring of the tangent
plane, weighted by the mass of the channel's Gaussian in that ring.

Wiring, for rays k = 0 to 4 at P + radius_k (cos a_k T + sin a_k B), a random first angle:

    Raycast along Direction -> Is Hit (1 - Self Hit) = hit_k
    blurred = 1 - sum over k of mass_k(channel) hit_k
    |Visibility - (1 - hit_0)| < 1/2 ? blurred : Visibility -> Visibility per channel
"""

from __future__ import annotations

import math
from itertools import pairwise

import bpy

from ... import ids
from .tree import Operand, Socket, TreeBuilder, declare, ensure_group

VERSION = 1

# Radii of the rings and where their rays go, in units of the widest sigma0.
BOUNDS = (0.0, 0.15, 0.5, 1.0, 1.6)
RADII = (0.0, 0.3, 0.75, 1.3, 2.0)
# Radii vary by this part from pixel to pixel and sample to sample.
SPREAD = 0.4
GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))
# Much longer than a scene at arm's length; EEVEE clips it to what is in view.
RAY_LENGTH = 100.0
NARROWEST = 1e-6
# Window coordinates times this differ between any two pixels and samples.
NOISE_SCALE = 9173.0
ODD_DIRECTION = (0.31, 0.47, 0.83)


def edge_group() -> bpy.types.ShaderNodeTree:
    """Return the group that blurs a light's visibility at a point, per channel."""

    def build(b: TreeBuilder) -> None:
        declare(b.tree, ids.VISIBILITY, default=1.0, tip="Of the light, at the shaded point")
        declare(b.tree, ids.DIRECTION, "Vector", tip="Towards the light")
        declare(b.tree, ids.WIDTH, "Vector", tip="Sigma0 of red, green and blue")
        declare(b.tree, ids.VISIBILITY, "Vector", output=True)
        given, result = b.ends()
        widths = b.separate(given[ids.WIDTH])
        widest = b.math("MAXIMUM", b.math("MAXIMUM", widths[0], widths[1]), widths[2])
        hits = _hits(b, given[ids.DIRECTION], widest)
        plain = given[ids.VISIBILITY]
        off = b.math("SUBTRACT", b.math("SUBTRACT", 1.0, hits[0]), plain)
        agree = b.math("LESS_THAN", b.math("ABSOLUTE", off), 0.5)
        channels = []
        for width in widths:
            blurred = b.math("SUBTRACT", 1.0, _blurred(b, hits, width, widest))
            change = b.math("SUBTRACT", blurred, plain)
            channels.append(b.math("MULTIPLY_ADD", agree, change, plain, clamp=True))
        b.feed(result[ids.VISIBILITY], b.combine(*channels))

    return ensure_group("CDRF Shadow Edge", ids.ROLE_EDGE, VERSION, build)


def _hits(b: TreeBuilder, direction: Operand, widest: Operand) -> list[Socket]:
    """Return for each ray whether it meets another object, 1 or 0."""
    geometry = b.node("ShaderNodeNewGeometry").outputs
    window = b.node("ShaderNodeTexCoord").outputs["Window"]
    noise = b.node("ShaderNodeTexWhiteNoise", noise_dimensions="3D")
    b.feed(noise.inputs["Vector"], b.vector("SCALE", window, scale=NOISE_SCALE))
    first, second, _ = b.separate(noise.outputs["Color"])
    turn = b.math("MULTIPLY", first, 2.0 * math.pi)
    stretch = b.math("MULTIPLY", b.math("MULTIPLY_ADD", second, SPREAD, 1.0 - SPREAD / 2), widest)
    normal = geometry["Normal"]
    tangent = b.vector("NORMALIZE", b.vector("CROSS_PRODUCT", normal, ODD_DIRECTION))
    bitangent = b.vector("CROSS_PRODUCT", normal, tangent)
    hits = []
    for number, radius in enumerate(RADII):
        origin: Operand = geometry["Position"]
        if radius > 0.0:
            angle = b.math("ADD", turn, number * GOLDEN_ANGLE)
            far = b.math("MULTIPLY", stretch, radius)
            for axis, part in ((tangent, "COSINE"), (bitangent, "SINE")):
                step = b.vector("SCALE", axis, scale=b.math("MULTIPLY", far, b.math(part, angle)))
                origin = b.vector("ADD", origin, step)
        ray = b.node("ShaderNodeRaycast", f"Ray {number}")
        b.feed(ray.inputs["Position"], origin)
        b.feed(ray.inputs["Direction"], direction)
        b.feed(ray.inputs["Length"], RAY_LENGTH)
        other = b.math("SUBTRACT", 1.0, ray.outputs["Self Hit"])
        hits.append(b.math("MULTIPLY", ray.outputs["Is Hit"], other))
    return hits


def _blurred(b: TreeBuilder, hits: list[Socket], width: Operand, widest: Operand) -> Socket:
    """Return the sum of the hits, each weighted by the mass of a Gaussian in its ring.

    Args:
        b: Builder of the group.
        hits: What `_hits` returned.
        width: Standard deviation of the channel's Gaussian.
        widest: That of the widest channel.
    """
    ratio = b.math("DIVIDE", width, widest)
    ratio2 = b.math("MAXIMUM", b.math("MULTIPLY", ratio, ratio), NARROWEST)
    beyond = [
        b.math("EXPONENT", b.math("DIVIDE", -0.5 * bound**2, ratio2)) if bound > 0.0 else 1.0
        for bound in BOUNDS
    ]
    total = b.math("MULTIPLY", beyond[-1], hits[-1])
    for (near, far), hit in zip(pairwise(beyond), hits, strict=False):
        total = b.math("MULTIPLY_ADD", b.math("SUBTRACT", near, far), hit, total)
    return total
