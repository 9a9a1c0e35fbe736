# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials: CDRF in and out of a node tree, leaving the artist's own nodes as they were.

The translucent surface gets a Material Output of its own whose target is EEVEE. The artist's nodes
and output stay, so Cycles renders them as before, and removing our two nodes restores everything.
"""

from __future__ import annotations

from typing import Any

import bpy

from .. import ids
from ..compat import ensure_node_tree, set_uses_nodes, uses_nodes
from ..core.errors import SceneError
from .nodetree import TreeBuilder
from .shader import is_shader_group

COLOUR_INPUTS = ("Base Color", "Color")
PLAIN_KEY = "cdrf_was_plain"
"""On a 4.5 material: it did not use its nodes before."""


def cdrf_node(material: bpy.types.Material | None) -> bpy.types.ShaderNode | None:
    """Return the material's CDRF node, or None if it is not translucent."""
    if material is None or material.node_tree is None:
        return None
    for node in material.node_tree.nodes:
        if node.type == "GROUP" and is_shader_group(node.node_tree):
            return node
    return None


def require_editable(data: bpy.types.ID) -> None:
    """Refuse data that cannot be changed in this file.

    Raises:
        SceneError: The data is linked; the text says from where and what to do.
    """
    if not data.is_editable:
        where = data.library.filepath if data.library else "another file"
        raise SceneError(
            f"'{data.name}' is linked from {where} and cannot be changed here: make it local "
            "(Object > Relations > Make Local) or set it up in that file."
        )


def find_surface_source(material: bpy.types.Material) -> tuple[Any, Any]:
    """Find the base colour and the normal of a material's present surface.

    Returns:
        Colour: a socket it is linked from, or an RGBA default. Normal: a socket, or None.
    """
    if not uses_nodes(material):
        return tuple(material.diffuse_color), None
    output = material.node_tree.get_output_node("EEVEE")
    pending = [output.inputs["Surface"]] if output else []
    seen = set()
    while pending:
        socket = pending.pop(0)
        if not socket.is_linked:
            continue
        node = socket.links[0].from_node
        if node.name in seen:
            continue
        seen.add(node.name)
        for name in COLOUR_INPUTS:
            colour = node.inputs.get(name)
            if colour is not None and node.type != "EMISSION":
                normal = node.inputs.get("Normal")
                return (
                    colour.links[0].from_socket
                    if colour.is_linked
                    else tuple(colour.default_value),
                    normal.links[0].from_socket
                    if normal is not None and normal.is_linked
                    else None,
                )
        pending += [item for item in node.inputs if item.type == "SHADER"]
    return tuple(material.diffuse_color), None


def install(material: bpy.types.Material, group: bpy.types.ShaderNodeTree) -> bpy.types.ShaderNode:
    """Make a material translucent in EEVEE, or swap the group of one that is.

    Values and links of the node's inputs survive the swap.
    """
    node = cdrf_node(material)
    if node is not None:
        if node.node_tree != group:
            _swap(material.node_tree, node, group)
        return node
    colour, normal = find_surface_source(material)
    if not uses_nodes(material):
        material[PLAIN_KEY] = True
    tree = ensure_node_tree(material)
    set_uses_nodes(material, True)
    former = tree.get_output_node("EEVEE")
    builder = TreeBuilder(tree)
    node = builder.node("ShaderNodeGroup", ids.NODE, node_tree=group, width=200.0)
    builder.feed(node.inputs[ids.BASE_COLOR], colour)
    if normal is not None:
        builder.feed(node.inputs[ids.NORMAL], normal)
    output = builder.node("ShaderNodeOutputMaterial", ids.OUTPUT_NODE, target="EEVEE")
    builder.feed(output.inputs["Surface"], node.outputs[ids.SHADER])
    x, y = former.location if former else (300.0, 0.0)
    node.location, output.location = (x - 60.0, y + 260.0), (x + 200.0, y + 260.0)
    if former is not None:
        # Displacement and thickness go on as they were; only the surface is replaced.
        for socket in former.inputs:
            if socket.name != "Surface" and socket.is_linked and socket.name in output.inputs:
                tree.links.new(socket.links[0].from_socket, output.inputs[socket.name])
        if former.target == "EEVEE":
            former.is_active_output = False
    output.is_active_output = True
    return node


def _swap(
    tree: bpy.types.ShaderNodeTree, node: bpy.types.ShaderNode, group: bpy.types.ShaderNodeTree
) -> None:
    values = {}
    links = {}
    for socket in node.inputs:
        value = socket.default_value
        values[socket.name] = value if isinstance(value, float) else tuple(value)
        if socket.is_linked:
            links[socket.name] = socket.links[0].from_socket
    targets = [link.to_socket for link in node.outputs[ids.SHADER].links]
    node.node_tree = group
    for name, value in values.items():
        if name in node.inputs:
            node.inputs[name].default_value = value
    for name, source in links.items():
        if name in node.inputs:
            tree.links.new(source, node.inputs[name])
    for target in targets:
        tree.links.new(node.outputs[ids.SHADER], target)


def remove(material: bpy.types.Material) -> bool:
    """Take CDRF out of a material again; tell whether there was any."""
    node = cdrf_node(material)
    if node is None:
        return False
    tree = material.node_tree
    output = tree.nodes.get(ids.OUTPUT_NODE)
    if output is not None:
        tree.nodes.remove(output)
    tree.nodes.remove(node)
    for other in tree.nodes:
        if other.type == "OUTPUT_MATERIAL" and other.target == "EEVEE":
            other.is_active_output = True
    if material.get(PLAIN_KEY):
        del material[PLAIN_KEY]
        set_uses_nodes(material, False)
    return True
