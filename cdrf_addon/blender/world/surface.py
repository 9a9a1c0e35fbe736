# SPDX-License-Identifier: GPL-3.0-or-later
"""What the surface of a world is made of, as far as drivers can follow it.

colour    without nodes: the world's colour
plain     Background with a colour and a strength of its own
scaled    Background with a linked colour; its strength follows, and so does the rotation in
          Texture Coordinate (Generated) -> Mapping -> Environment Texture -> Background
fixed     anything else: nothing follows
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ...compat import animation_curves, uses_nodes

COLOUR, PLAIN, SCALED, FIXED = "colour", "plain", "scaled", "fixed"
"""What drives: the world's colour; Background's colour and strength; its strength; nothing."""


@dataclass(frozen=True)
class WorldSurface:
    """What the surface of a world is made of."""

    kind: str
    """COLOUR, PLAIN, SCALED or FIXED."""
    background: bpy.types.ShaderNode | None
    """The Background node that drives."""
    black: bool
    """Whether it sends no light and nothing animates it."""
    mapping: bpy.types.ShaderNode | None = None
    """The Mapping node whose rotation drives."""

    def driven(self) -> list[bpy.types.NodeSocket]:
        """List the inputs that drivers follow."""
        found = [self.background.inputs["Strength"]] if self.background else []
        return found + ([self.mapping.inputs["Rotation"]] if self.mapping else [])


def scene_world(
    scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer | None
) -> bpy.types.World | None:
    """Return the world that lights a view layer."""
    return getattr(view_layer, "world_override", None) or scene.world


def read_surface(world: bpy.types.World) -> WorldSurface:
    """Read what the surface of a world is made of."""
    if not uses_nodes(world):
        return WorldSurface(COLOUR, None, not (any(world.color) or _animates(world, "color")))
    tree = world.node_tree
    output = tree.get_output_node("EEVEE")
    node = _source(output.inputs["Surface"]) if output else None
    if node is None:
        return WorldSurface(FIXED, None, True)
    if node.type != "BACKGROUND" or node.mute or node.inputs["Strength"].is_linked:
        return WorldSurface(FIXED, None, False)
    strength, colour = node.inputs["Strength"], node.inputs["Color"]
    dark = not (strength.default_value > 0.0 or is_moved(tree, strength))
    if colour.is_linked:
        return WorldSurface(SCALED, node, dark, _mapping(tree, colour))
    dark = dark or not (max(colour.default_value[:3]) > 0.0 or is_moved(tree, colour))
    return WorldSurface(PLAIN, node, dark)


def _source(socket: bpy.types.NodeSocket, output: str | None = None) -> bpy.types.ShaderNode | None:
    """Return the node that feeds a socket; None if there is none, or it is not by that output."""
    while socket.is_linked:
        link = socket.links[0]
        if link.from_node.type != "REROUTE":
            named = output is None or link.from_socket.name == output
            return link.from_node if named and not link.is_muted else None
        socket = link.from_node.inputs[0]
    return None


def _mapping(
    tree: bpy.types.ShaderNodeTree, colour: bpy.types.NodeSocket
) -> bpy.types.ShaderNode | None:
    """Return the Mapping node that does nothing but turn a world's only picture, or None."""
    chain = []
    socket = colour
    for kind, output in (("TEX_ENVIRONMENT", "Color"), ("MAPPING", "Vector")):
        node = _source(socket, output)
        if node is None or node.type != kind or node.mute:
            return None
        chain.append(node)
        socket = node.inputs["Vector"]
    start = _source(socket, "Generated")
    if start is None or start.type != "TEX_COORD" or start.mute:
        return None
    mapping = chain[-1]
    for name, neutral in (("Location", 0.0), ("Scale", 1.0)):
        given = mapping.inputs.get(name)  # a mapping of type Vector has no location
        if given is None:
            continue
        if (
            given.is_linked
            or is_moved(tree, given)
            or any(v != neutral for v in given.default_value)
        ):
            return None
    return None if mapping.inputs["Rotation"].is_linked else mapping


def _animates(world: bpy.types.World, path: str) -> bool:
    return bool(animation_curves(world, path))


def is_moved(tree: bpy.types.ShaderNodeTree, socket: bpy.types.NodeSocket) -> bool:
    """Return whether the value of an input is animated."""
    return bool(animation_curves(tree, socket.path_from_id("default_value")))


def is_animated(world: bpy.types.World) -> bool:
    """Return whether the world is animated in a way that drivers do not follow."""
    surface = read_surface(world)
    if surface.kind in {COLOUR, PLAIN}:
        return False
    tree = world.node_tree
    driven = surface.driven()
    return any(
        is_moved(tree, socket)
        for node in tree.nodes
        for socket in node.inputs
        if hasattr(socket, "default_value") and not socket.is_linked and socket not in driven
    )


def world_shines(world: bpy.types.World | None) -> bool:
    """Return whether the world may send light; False only where it is black for certain."""
    if world is None:
        return False
    tree = world.node_tree
    if tree is None or not uses_nodes(world):
        return bool(max(world.color) > 0.0)
    if world.animation_data is not None or tree.animation_data is not None:
        return True
    output = tree.get_output_node("EEVEE")
    links = output.inputs["Surface"].links if output is not None else ()
    if not links:
        return False
    node = links[0].from_node
    if node.type != "BACKGROUND":
        return True
    colour, strength = node.inputs["Color"], node.inputs["Strength"]
    black = not colour.is_linked and max(colour.default_value[:3]) <= 0.0
    return not black and (strength.is_linked or strength.default_value != 0.0)
