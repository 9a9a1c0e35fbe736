# SPDX-License-Identifier: GPL-3.0-or-later
"""Curvature in hot colours in place of the skin (paper, Fig. 3a), and back again."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import bpy

from .. import ids
from .groups import display_group
from .materials import cdrf_node
from .nodetree import TreeBuilder
from .shader import ATTRIBUTE, CONSTANT, SCALED, curvature_nodes, stamped_variant

_HELPERS = tuple(f"{ids.DISPLAY_NODE} {part}" for part in ("Attribute", "Parts", "Size", "Product"))


def shows_curvature(material: bpy.types.Material) -> bool:
    """Tell whether the material shows its curvature just now."""
    tree = material.node_tree
    return tree is not None and ids.DISPLAY_NODE in tree.nodes


def show_skin(material: bpy.types.Material) -> None:
    """Take the display's nodes out and connect the skin again."""
    node = cdrf_node(material)
    if node is None or not shows_curvature(material):
        return
    tree = material.node_tree
    for name in (ids.DISPLAY_NODE, *_HELPERS):
        if name in tree.nodes:
            tree.nodes.remove(tree.nodes[name])
    output = tree.nodes.get(ids.OUTPUT_NODE)
    if output is not None:
        tree.links.new(node.outputs[ids.SHADER], output.inputs["Surface"])


def show_curvature(material: bpy.types.Material, meshes: Iterable[bpy.types.Mesh]) -> None:
    """Show the curvature, black at the meshes' 5th percentile and white at their 95th."""
    show_skin(material)
    node = cdrf_node(material)
    output = material.node_tree.nodes.get(ids.OUTPUT_NODE) if node else None
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
    helpers = [item for item in tree.nodes if item.name not in before]
    for helper, name in zip(helpers, _HELPERS, strict=False):
        helper.name = name
    shown = builder.group(
        display_group(),
        ids.DISPLAY_NODE,
        Curvature=curvature,
        Minimum=low,
        # One curvature everywhere is shown black, not divided by zero.
        Maximum=max(high, low * 1.001, 1e-6),
    )
    shown.location = (node.location[0], node.location[1] + 260.0)
    for column, helper in enumerate(helpers):
        helper.location = (shown.location[0] - 600.0 + 190.0 * column, shown.location[1])
    builder.feed(output.inputs["Surface"], shown.outputs[ids.SHADER])
