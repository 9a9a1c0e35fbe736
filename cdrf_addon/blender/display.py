# SPDX-License-Identifier: GPL-3.0-or-later
"""Curvature in hot colours in place of the skin (paper, Fig. 3a), and back again."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import bpy

from .. import ids
from .groups import display_group
from .materials import cdrf_node, skin_output, skin_socket
from .nodetree import TreeBuilder
from .shader import ATTRIBUTE, CONSTANT, SCALED, curvature_nodes, stamped_variant


def _display_nodes(material: bpy.types.Material) -> list[bpy.types.ShaderNode]:
    nodes = material.node_tree.nodes if material.node_tree else ()
    return [node for node in nodes if node.get(ids.ROLE_KEY) == ids.ROLE_DISPLAY_PART]


def shows_curvature(material: bpy.types.Material) -> bool:
    """Tell whether the material shows its curvature just now."""
    return bool(_display_nodes(material))


def show_skin(material: bpy.types.Material) -> None:
    """Take the display's nodes out and connect the skin again."""
    if cdrf_node(material) is None or not shows_curvature(material):
        return
    tree = material.node_tree
    for node in _display_nodes(material):
        tree.nodes.remove(node)
    output = skin_output(material)
    if output is not None:
        tree.links.new(skin_socket(material), output.inputs["Surface"])


def show_curvature(material: bpy.types.Material, meshes: Iterable[bpy.types.Mesh]) -> None:
    """Show the curvature, black at the meshes' 5th percentile and white at their 95th."""
    show_skin(material)
    node = cdrf_node(material)
    output = skin_output(material)
    if node is None or output is None:
        return
    known = [mesh.cdrf for mesh in meshes]
    low = min((item.low for item in known), default=0.0)
    high = max((item.high for item in known), default=1.0)
    tree = material.node_tree
    builder = TreeBuilder(tree)
    before = {item.name for item in tree.nodes}
    source = stamped_variant(node.node_tree).source
    curvature: Any = 0.0
    if source in {ATTRIBUTE, SCALED}:
        curvature = curvature_nodes(builder, scaled=source == SCALED)
    elif source == CONSTANT:
        curvature = node.inputs[ids.CURVATURE].default_value
    shown = builder.group(
        display_group(),
        ids.DISPLAY_NODE,
        Curvature=curvature,
        Minimum=low,
        # One curvature everywhere is shown black, not divided by zero.
        Maximum=max(high, low * 1.001, 1e-6),
    )
    added = [item for item in tree.nodes if item.name not in before]
    for column, item in enumerate(added):
        item[ids.ROLE_KEY] = ids.ROLE_DISPLAY_PART
        item.location = (node.location[0] - 600.0 + 190.0 * column, node.location[1] + 260.0)
    builder.feed(output.inputs["Surface"], shown.outputs[ids.SHADER])
