# SPDX-License-Identifier: GPL-3.0-or-later
"""Curvature as the shader reads it from a mesh.

Wiring:

    attribute: kappa at four lengths --+
    attribute: the shortest length ----+-> Diffused Curvature -> kappa at sigma0's length
    Sigma0 (x size, where shared) -----+

    object's X axis -> to world -> length --+
    object property: the same, as measured -+-> divide = size
"""

from __future__ import annotations

from ... import ids
from ..nodes.curvature import diffused_group
from ..nodes.tree import Operand, Socket, Sockets, TreeBuilder
from .variant import CONSTANT, FLAT, SCALED, Variant


def surface_sigma(b: TreeBuilder, variant: Variant, given: Sockets) -> Operand:
    """Return sigma = sigma0 kappa per channel, as a vector."""
    if variant.source == FLAT:
        return (0.0, 0.0, 0.0)
    if variant.source == CONSTANT:
        sigma = b.math("MULTIPLY", given[ids.SIGMA0], given[ids.CURVATURE])
        return b.vector("SCALE", given[ids.SIGMA0_RATIO], scale=sigma)
    return _diffused_sigma(b, variant, given)


def _diffused_sigma(b: TreeBuilder, variant: Variant, given: Sockets) -> Socket:
    """Return sigma per channel, each from the curvature at its own diffusion length."""
    levels = level_nodes(b)
    sigma0 = given[ids.SIGMA0]
    if variant.source == SCALED:
        # An object twice as large is the measured one with half the scatter distance.
        sigma0 = b.math("MULTIPLY", sigma0, size_node(b))
    ratio = b.separate_channels(given[ids.SIGMA0_RATIO])
    sigma: dict[str, Socket] = {}
    for shared in variant.channels.split():
        own = b.math("MULTIPLY", sigma0, ratio[shared[0]])
        sigma.update(dict.fromkeys(shared, b.math("MULTIPLY", own, diffused_node(b, levels, own))))
    return b.combine_channels(sigma)


def level_nodes(b: TreeBuilder, attribute: str = ids.DIFFUSED_ATTRIBUTE) -> dict[str, Socket]:
    """Read what a mesh has at four lengths; return it by the inputs of `diffused_group`."""
    levels = b.node("ShaderNodeAttribute", attribute_name=attribute)
    length = b.node("ShaderNodeAttribute", attribute_name=ids.LENGTH_ATTRIBUTE)
    return {
        ids.LEVELS: levels.outputs["Color"],
        ids.LEVELS_ALPHA: levels.outputs["Alpha"],
        ids.LENGTH: length.outputs["Fac"],
    }


def diffused_node(b: TreeBuilder, levels: dict[str, Socket], sigma0: Operand) -> Socket:
    """Return kappa at the diffusion length of a sigma0, both in the measured mesh's size."""
    node = b.group(diffused_group(), "Diffused Curvature", **levels, Sigma0=sigma0)
    return node.outputs[ids.CURVATURE]


def size_node(b: TreeBuilder) -> Socket:
    """Return the size of the mesh as measured over its size as seen, in an instance or not."""
    axis = b.node(
        "ShaderNodeVectorTransform", vector_type="VECTOR", convert_from="OBJECT", convert_to="WORLD"
    )
    b.feed(axis.inputs["Vector"], (1.0, 0.0, 0.0))
    measured = b.node(
        "ShaderNodeAttribute", attribute_type="OBJECT", attribute_name=ids.SCALE_KEY
    ).outputs["Fac"]
    return b.math("DIVIDE", measured, b.vector("LENGTH", axis.outputs["Vector"]))


def curvature_nodes(b: TreeBuilder, *, scaled: bool, signed: bool) -> Socket:
    """Return the curvature at a mesh's vertices.

    Args:
        b: Builder of the material.
        scaled: Whether objects of several sizes share the mesh: their size is corrected for.
        signed: Mean curvature with its sign in place of the curvedness kappa.
    """
    attribute = b.node("ShaderNodeAttribute", attribute_name=ids.CURVATURE_ATTRIBUTE)
    value = attribute.outputs["Alpha"]
    if not signed:
        parts = b.node("ShaderNodeSeparateColor")
        b.feed(parts.inputs["Color"], attribute.outputs["Color"])
        value = parts.outputs["Red"]
    return b.math("MULTIPLY", value, size_node(b)) if scaled else value
