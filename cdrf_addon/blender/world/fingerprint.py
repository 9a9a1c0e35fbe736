# SPDX-License-Identifier: GPL-3.0-or-later
"""A fingerprint of all in a world that can change its light, apart from what drivers follow.

The same world has the same one, and so is never rendered twice.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence

import bpy

from .surface import FIXED, SCALED, is_moved, read_surface

VERSION = 1
BLACK = ""
"""Fingerprint of no light."""
DEEPEST = 3
"""Structs within structs that are described, counted from the node."""

# Properties of nodes that do not change their light.
_COSMETIC = {
    "rna_type", "name", "label", "location", "location_absolute", "width", "height", "dimensions",
    "color", "use_custom_color", "color_tag", "select", "hide", "parent", "show_options",
    "show_preview", "show_texture", "warning_propagation", "inputs", "outputs", "internal_links",
    "type", "debug_zone_body_lazy_function_graph", "debug_zone_lazy_function_graph",
}  # fmt: skip


def fingerprint(world: bpy.types.World | None) -> str:
    """Return a hash of what decides a world's light; BLACK for no light.

    It takes well under a millisecond, so a panel may ask at every redraw.
    """
    if world is None:
        return BLACK
    surface = read_surface(world)
    if surface.black:
        return BLACK
    node = surface.background
    parts: list[object] = [VERSION, surface.kind, node.name if node else ""]
    if surface.kind in {SCALED, FIXED}:
        parts.append(world.sun_threshold)
        parts += _describe_tree(world.node_tree, surface.driven())
        if surface.mapping is not None:
            parts.append(["turned", surface.mapping.name])
    text = json.dumps(parts, default=str)
    return hashlib.blake2b(text.encode(), digest_size=12).hexdigest()


def _describe_tree(
    tree: bpy.types.ShaderNodeTree, driven: Sequence[bpy.types.NodeSocket] = ()
) -> list[object]:
    """List the nodes, values and links of a tree, without the inputs that drivers follow."""
    parts: list[object] = []
    for node in tree.nodes:
        if node.type in {"FRAME", "REROUTE"}:
            continue
        parts.append([node.bl_idname, node.name, _describe(node)])
        for socket in node.inputs:
            if not socket.is_linked and hasattr(socket, "default_value") and socket not in driven:
                # A keyframed value would be another at every frame.
                value = "animated" if is_moved(tree, socket) else _plain(socket.default_value)
                parts.append(value)
    parts += [
        [link.from_node.name, link.from_socket.identifier, link.to_node.name,
         link.to_socket.identifier, link.is_muted]
        for link in tree.links
    ]  # fmt: skip
    return parts


def _describe(struct: bpy.types.bpy_struct, depth: int = 0) -> list[object]:
    """List the values of a struct's properties and of the structs in it."""
    parts: list[object] = []
    for prop in struct.bl_rna.properties:
        name = prop.identifier
        if name in _COSMETIC or name.startswith("bl_"):
            continue
        if prop.type == "COLLECTION":
            if depth < DEEPEST:
                parts += [_describe(part, depth + 1) for part in getattr(struct, name)]
        elif prop.type == "POINTER":
            parts.append(_describe_pointer(getattr(struct, name), depth))
        else:
            parts.append(_plain(getattr(struct, name)))
    return parts


def _describe_pointer(value: bpy.types.bpy_struct | None, depth: int) -> object:
    if value is None:
        return None
    if isinstance(value, bpy.types.Image):
        space = value.colorspace_settings.name
        return [value.name, value.filepath, tuple(value.size), space, value.source]
    if isinstance(value, bpy.types.ShaderNodeTree):
        return _describe_tree(value)
    if isinstance(value, bpy.types.Object):
        return [value.name, [tuple(row) for row in value.matrix_world]]
    if isinstance(value, bpy.types.ID) or depth >= DEEPEST:
        return str(getattr(value, "name", ""))
    return _describe(value, depth + 1)


def _plain(value: object) -> object:
    """Return a number or text as it is, and a vector as its numbers."""
    if isinstance(value, bool | int | float | str) or value is None:
        return value
    if isinstance(value, bpy.types.ID):
        return value.name
    if isinstance(value, set):
        return sorted(value)
    return [round(float(part), 7) for part in value] if hasattr(value, "__iter__") else str(value)
