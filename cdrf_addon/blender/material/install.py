# SPDX-License-Identifier: GPL-3.0-or-later
"""CDRF in and out of a material's node tree; the artist's own nodes stay as they were.

The translucent surface gets a Material Output of its own whose target is EEVEE. The artist's nodes
and output stay, so Cycles renders them as before, and removing our nodes restores everything.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy

from ... import ids
from ...compat import ensure_node_tree, set_uses_nodes, uses_nodes
from ...core.errors import SceneError
from ..nodes.tree import TreeBuilder
from ..shader.variant import is_shader_group

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
        SceneError: The data is linked; the message names the file and what to do.
    """
    if not data.is_editable:
        where = data.library.filepath if data.library else "another file"
        raise SceneError(
            f"'{data.name}' is linked from {where} and cannot be changed here: make it local "
            "(Object > Relations > Make Local) or set it up in that file."
        )


@dataclass(frozen=True)
class SurfaceSource:
    """Inputs of the artist's present surface: sockets where linked, else plain values."""

    colour: Any
    normal: Any = None
    """A socket, or None for the geometry's own normal."""
    alpha: Any = 1.0


def find_surface_source(material: bpy.types.Material) -> SurfaceSource:
    """Find the base colour, normal and alpha of a material's present surface."""
    if not uses_nodes(material):
        return SurfaceSource(tuple(material.diffuse_color))
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
            if name in node.inputs and node.type != "EMISSION":
                return SurfaceSource(
                    _input_of(node, name), _source_of(node, "Normal"), _input_of(node, "Alpha", 1.0)
                )
        pending += [one for one in node.inputs if one.type == "SHADER"]
    return SurfaceSource(tuple(material.diffuse_color))


def is_mapped(material: bpy.types.Material) -> bool:
    """Return whether a normal or bump map feeds the surface, or will once it is translucent."""
    node = cdrf_node(material)
    if node is not None:
        return bool(node.inputs[ids.NORMAL].is_linked)
    return find_surface_source(material).normal is not None


def _source_of(node: bpy.types.ShaderNode, name: str) -> Any:
    socket = node.inputs.get(name)
    return socket.links[0].from_socket if socket is not None and socket.is_linked else None


def _input_of(node: bpy.types.ShaderNode, name: str, default: Any = None) -> Any:
    if name not in node.inputs:
        return default
    value = node.inputs[name].default_value
    return _source_of(node, name) or (value if isinstance(value, float) else tuple(value))


def own_node(tree: bpy.types.ShaderNodeTree | None, role: str) -> bpy.types.ShaderNode | None:
    """Find a node that we put into a material, whatever its present name."""
    nodes = tree.nodes if tree else ()
    return next((node for node in nodes if node.get(ids.ROLE_KEY) == role), None)


def cdrf_output(material: bpy.types.Material) -> bpy.types.ShaderNode | None:
    """Return the material's CDRF Material Output, or None if it has none (any more)."""
    return own_node(material.node_tree, ids.ROLE_OUTPUT)


def surface_socket(material: bpy.types.Material) -> bpy.types.NodeSocket:
    """Return the socket of the whole translucent surface, its transparency included."""
    mix = own_node(material.node_tree, ids.ROLE_ALPHA)
    if mix is not None:
        return mix.outputs["Shader"]
    return socket_before_alpha(material)


def socket_before_alpha(material: bpy.types.Material) -> bpy.types.NodeSocket:
    """Return the socket of the translucent surface with its specular half, before its alpha."""
    end = own_node(material.node_tree, ids.ROLE_GLOSS_END)
    if end is not None:
        return end.outputs["Shader"]
    node = cdrf_node(material)
    assert node is not None
    return node.outputs[ids.SHADER]


def install(material: bpy.types.Material, group: bpy.types.ShaderNodeTree) -> bpy.types.ShaderNode:
    """Make a material translucent in EEVEE, or swap the group of one that is.

    Values and links of the node's inputs survive the swap; an output that was deleted comes back.
    """
    node = cdrf_node(material)
    if node is None:
        _remove_own_nodes(material.node_tree)
        source = find_surface_source(material)
        if not uses_nodes(material):
            material[PLAIN_KEY] = True
        builder = TreeBuilder(ensure_node_tree(material))
        set_uses_nodes(material, True)
        node = builder.node("ShaderNodeGroup", ids.NODE, node_tree=group, width=200.0)
        builder.feed(node.inputs[ids.BASE_COLOR], source.colour)
        if source.normal is not None:
            builder.feed(node.inputs[ids.NORMAL], source.normal)
        former = builder.tree.get_output_node("EEVEE")
        x, y = former.location if former else (300.0, 0.0)
        node.location = (x - 60.0, y + 260.0)
        if source.alpha != 1.0:
            _add_alpha(builder, node, source.alpha)
    elif node.node_tree != group:
        _swap(material.node_tree, node, group)
    if cdrf_output(material) is None:
        _add_output(material, node)
    _link_thickness(material, node)
    return node


def _link_thickness(material: bpy.types.Material, node: bpy.types.ShaderNode) -> None:
    """Link the depth to which EEVEE skips the surface's own shadow, unless the artist links one."""
    output = cdrf_output(material)
    if output is None or ids.THICKNESS not in node.outputs:
        return
    socket = output.inputs.get("Thickness")
    if socket is not None and not socket.is_linked:
        material.node_tree.links.new(node.outputs[ids.THICKNESS], socket)


def _add_alpha(builder: TreeBuilder, node: bpy.types.ShaderNode, alpha: Any) -> None:
    """Make the surface as transparent as the artist's: alpha mixes it with Transparent."""
    clear = builder.node("ShaderNodeBsdfTransparent")
    clear[ids.ROLE_KEY] = ids.ROLE_TRANSPARENT
    mix = builder.node("ShaderNodeMixShader")
    mix[ids.ROLE_KEY] = ids.ROLE_ALPHA
    # Mix Shader's inputs: the factor, then two that are both called Shader.
    for socket, operand in zip(
        mix.inputs, (alpha, clear.outputs["BSDF"], node.outputs[ids.SHADER]), strict=True
    ):
        builder.feed(socket, operand)
    clear.location = (node.location[0], node.location[1] + 130.0)
    mix.location = (node.location[0] + 220.0, node.location[1])


def _add_output(material: bpy.types.Material, node: bpy.types.ShaderNode) -> None:
    tree = material.node_tree
    former = tree.get_output_node("EEVEE")
    output = TreeBuilder(tree).node("ShaderNodeOutputMaterial", ids.OUTPUT_NODE, target="EEVEE")
    output[ids.ROLE_KEY] = ids.ROLE_OUTPUT
    output.location = (node.location[0] + 420.0, node.location[1])
    tree.links.new(surface_socket(material), output.inputs["Surface"])
    if former is not None:
        # Displacement and thickness go on as they were; only the surface is replaced.
        for socket in former.inputs:
            if socket.name != "Surface" and socket.is_linked and socket.name in output.inputs:
                tree.links.new(socket.links[0].from_socket, output.inputs[socket.name])
        if former.target == "EEVEE":
            former.is_active_output = False
    output.is_active_output = True


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
    """Remove CDRF from a material; return whether there was any."""
    node = cdrf_node(material)
    if node is None:
        return False
    tree = material.node_tree
    tree.nodes.remove(node)
    _remove_own_nodes(tree)
    for other in tree.nodes:
        if other.type == "OUTPUT_MATERIAL" and other.target == "EEVEE":
            other.is_active_output = True
    if material.get(PLAIN_KEY):
        del material[PLAIN_KEY]
        set_uses_nodes(material, False)
    return True


def _remove_own_nodes(tree: bpy.types.ShaderNodeTree | None) -> None:
    if tree is None:
        return
    for node in list(tree.nodes):
        if ids.ROLE_KEY in node:
            tree.nodes.remove(node)
