# SPDX-License-Identifier: GPL-3.0-or-later
"""The world's light: what it is, whether it has changed, and its harmonics.

A world of one plain Background needs no picture: drivers carry its colour and strength. Any other
is rendered once, alone, all around (world_capture.py) and kept as nine numbers for each colour;
the strength of its Background, where it has a plain one, is driven too, and so is the rotation of
a picture's Mapping node: the picture is kept as it lies, and the surface turned instead.

A world is known again by a fingerprint of all its nodes that can change its light, so the same one
is never rendered twice.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ... import ids
from ...compat import animation_curves, uses_nodes
from ...core.reflectance.environment import Environment, Sun, uniform
from .capture import capture

VERSION = 1
BLACK = ""
"""Fingerprint of no light."""
COLOUR, PLAIN, SCALED, FIXED = "colour", "plain", "scaled", "fixed"
"""What drives: the world's colour; Background's colour and strength; its strength; nothing."""

# Properties of nodes that say nothing of their light.
_COSMETIC = {
    "rna_type", "name", "label", "location", "location_absolute", "width", "height", "dimensions",
    "color", "use_custom_color", "color_tag", "select", "hide", "parent", "show_options",
    "show_preview", "show_texture", "warning_propagation", "inputs", "outputs", "internal_links",
    "type", "debug_zone_body_lazy_function_graph", "debug_zone_lazy_function_graph",
}  # fmt: skip
_captured: dict[str, Environment] = {}
"""By fingerprint: what was rendered since this file was opened."""


@dataclass(frozen=True)
class WorldLight:
    """What a shader group needs to know of a world."""

    world: bpy.types.World | None
    """What drives it; None where nothing does, or it was deleted."""
    fingerprint: str
    kind: str
    """COLOUR, PLAIN, SCALED or FIXED."""
    node: str
    """Name of the Background node that drives."""
    environment: Environment
    mapping: str = ""
    """Name of the Mapping node whose rotation drives; the environment is that before it."""
    inverse: bool = False
    """Whether that node turns the other way (type Texture)."""

    def rotation(self) -> list[str]:
        """Paths, from the world, of the angles around X, Y and Z; empty if nothing turns."""
        if not self.mapping or self.world is None:
            return []
        name = bpy.utils.escape_identifier(self.mapping)
        path = f'node_tree.nodes["{name}"].inputs["Rotation"].default_value'
        return [f"{path}[{i}]" for i in range(3)]

    def drivers(self) -> list[tuple[str, dict[str, str]]]:
        """Expression and paths, from the world, of the factor on each channel; empty if fixed."""
        if self.kind == COLOUR:
            return [("c", {"c": f"color[{i}]"}) for i in range(3)]
        name = bpy.utils.escape_identifier(self.node)
        inputs = f'node_tree.nodes["{name}"].inputs'
        strength = f'{inputs}["Strength"].default_value'
        if self.kind == PLAIN:
            colour = f'{inputs}["Color"].default_value'
            return [("max(c,0)*max(s,0)", {"c": f"{colour}[{i}]", "s": strength}) for i in range(3)]
        return [("max(s,0)", {"s": strength})] * 3 if self.kind == SCALED else []

    def to_text(self) -> str:
        """Write all but the world as JSON."""
        sun = self.environment.sun
        return json.dumps(
            {
                "kind": self.kind,
                "node": self.node,
                "harmonics": np.round(self.environment.harmonics, 9).ravel().tolist(),
                "sun": [sun.direction, sun.radiance, sun.sin2_half_angle] if sun else None,
                "mapping": [self.mapping, self.inverse],
            }
        )


def from_text(text: str, fingerprint: str, world: bpy.types.World | None) -> WorldLight:
    """Undo `WorldLight.to_text`."""
    parts = json.loads(text)
    sun = None
    if parts["sun"]:
        direction, radiance, sin2 = parts["sun"]
        sun = Sun(tuple(direction), tuple(radiance), sin2)
    harmonics = np.array(parts["harmonics"]).reshape(9, 3)
    return WorldLight(
        world,
        fingerprint,
        parts["kind"],
        parts["node"],
        Environment(harmonics, sun),
        *parts.get("mapping", ("", False)),
    )


@dataclass(frozen=True)
class _Surface:
    kind: str
    node: bpy.types.ShaderNode | None
    black: bool
    mapping: bpy.types.ShaderNode | None = None

    def driven(self) -> list[bpy.types.NodeSocket]:
        """Inputs that drivers follow."""
        found = [self.node.inputs["Strength"]] if self.node else []
        return found + ([self.mapping.inputs["Rotation"]] if self.mapping else [])


def scene_world(
    scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer | None
) -> bpy.types.World | None:
    """Return the world that lights a view layer."""
    return getattr(view_layer, "world_override", None) or scene.world


def _surface(world: bpy.types.World) -> _Surface:
    """See what a world's surface is made of."""
    if not uses_nodes(world):
        return _Surface(COLOUR, None, not (any(world.color) or _animates(world, "color")))
    tree = world.node_tree
    output = tree.get_output_node("EEVEE")
    node = _source(output.inputs["Surface"]) if output else None
    if node is None:
        return _Surface(FIXED, None, True)
    if node.type != "BACKGROUND" or node.mute or node.inputs["Strength"].is_linked:
        return _Surface(FIXED, None, False)
    strength, colour = node.inputs["Strength"], node.inputs["Color"]
    dark = not (strength.default_value > 0.0 or _moved(tree, strength))
    if colour.is_linked:
        return _Surface(SCALED, node, dark, _mapping(tree, colour))
    dark = dark or not (max(colour.default_value[:3]) > 0.0 or _moved(tree, colour))
    return _Surface(PLAIN, node, dark)


def _source(socket: bpy.types.NodeSocket, output: str | None = None) -> bpy.types.ShaderNode | None:
    """Return the node that feeds a socket; None if none does, or by another output than asked."""
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
    """Return the Mapping node that does no more than turn a world's only picture.

    Texture Coordinate (Generated) -> Mapping -> Environment Texture -> colour
    """
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
        if given.is_linked or _moved(tree, given) or any(v != neutral for v in given.default_value):
            return None
    return None if mapping.inputs["Rotation"].is_linked else mapping


def _animates(world: bpy.types.World, path: str) -> bool:
    return bool(animation_curves(world, path))


def _moved(tree: bpy.types.ShaderNodeTree, socket: bpy.types.NodeSocket) -> bool:
    return bool(animation_curves(tree, socket.path_from_id("default_value")))


def fingerprint(world: bpy.types.World | None) -> str:
    """Hash what decides a world's light, apart from what drivers follow; BLACK for no light.

    Well under a millisecond, so that a panel may ask.
    """
    if world is None:
        return BLACK
    surface = _surface(world)
    if surface.black:
        return BLACK
    node = surface.node
    parts: list[object] = [VERSION, surface.kind, node.name if node else ""]
    if surface.kind in {SCALED, FIXED}:
        parts.append(world.sun_threshold)
        parts += _describe_tree(world.node_tree, surface.driven())
        if surface.mapping is not None:
            parts.append(["turned", surface.mapping.name])
    text = json.dumps(parts, default=str)
    return hashlib.blake2b(text.encode(), digest_size=12).hexdigest()


def is_same(one: WorldLight | None, other: WorldLight | None) -> bool:
    """Tell whether two lights would be wired alike."""
    if one is None or other is None:
        return one is other
    same = (one.fingerprint, one.world) == (other.fingerprint, other.world)
    return same and one.to_text() == other.to_text()


def is_due(group: bpy.types.ShaderNodeTree, world: bpy.types.World | None) -> bool:
    """Tell whether a shader group has another light than this world's."""
    name = fingerprint(world)
    if group.get(ids.WORLD_KEY, BLACK) != name:
        return True
    driving = group.get(ids.WORLD_DATA_KEY)
    return name != BLACK and driving is not None and driving != world


def _describe_tree(
    tree: bpy.types.ShaderNodeTree, driven: Sequence[bpy.types.NodeSocket] = ()
) -> list[object]:
    parts: list[object] = []
    for node in tree.nodes:
        if node.type in {"FRAME", "REROUTE"}:
            continue
        parts.append([node.bl_idname, node.name, _describe(node)])
        for socket in node.inputs:
            if not socket.is_linked and hasattr(socket, "default_value") and socket not in driven:
                # What is keyframed would be another at every frame.
                value = "animated" if _moved(tree, socket) else _plain(socket.default_value)
                parts.append(value)
    parts += [
        [link.from_node.name, link.from_socket.identifier, link.to_node.name,
         link.to_socket.identifier, link.is_muted]
        for link in tree.links
    ]  # fmt: skip
    return parts


def _describe(struct: bpy.types.bpy_struct, depth: int = 0) -> list[object]:
    """List the values of a struct's properties, and of the structs in it."""
    parts: list[object] = []
    for prop in struct.bl_rna.properties:
        name = prop.identifier
        if name in _COSMETIC or name.startswith("bl_"):
            continue
        if prop.type == "COLLECTION":
            if depth < 3:
                parts += [_describe(item, depth + 1) for item in getattr(struct, name)]
        elif prop.type == "POINTER":
            parts.append(_describe_pointer(getattr(struct, name), depth))
        else:
            parts.append(_plain(getattr(struct, name)))
    return parts


def _describe_pointer(value: Any, depth: int) -> object:
    if value is None:
        return None
    if isinstance(value, bpy.types.Image):
        space = value.colorspace_settings.name
        return [value.name, value.filepath, tuple(value.size), space, value.source]
    if isinstance(value, bpy.types.ShaderNodeTree):
        return _describe_tree(value)
    if isinstance(value, bpy.types.Object):
        return [value.name, [tuple(row) for row in value.matrix_world]]
    if isinstance(value, bpy.types.ID) or depth >= 3:
        return str(getattr(value, "name", ""))
    return _describe(value, depth + 1)


def _plain(value: Any) -> object:
    """A number, a text, or the numbers of a vector."""
    if isinstance(value, bool | int | float | str) or value is None:
        return value
    if isinstance(value, bpy.types.ID):
        return value.name
    if isinstance(value, set):
        return sorted(value)
    return [round(float(part), 7) for part in value] if hasattr(value, "__iter__") else str(value)


def is_animated(world: bpy.types.World) -> bool:
    """Tell whether the world changes in a way that drivers do not follow."""
    surface = _surface(world)
    if surface.kind in {COLOUR, PLAIN}:
        return False
    tree = world.node_tree
    driven = surface.driven()
    return any(
        _moved(tree, socket)
        for node in tree.nodes
        for socket in node.inputs
        if hasattr(socket, "default_value") and not socket.is_linked and socket not in driven
    )


def forget() -> None:
    """Another file was loaded: its pictures may have the same names."""
    _captured.clear()


def world_light(world: bpy.types.World | None, *, again: bool = False) -> WorldLight | None:
    """Return a world's light, rendered if it is neither plain nor known; None if it is black.

    Args:
        world: The scene's.
        again: Render it even if it is known.

    Raises:
        SceneError: It could not be rendered; the text says what to do.
    """
    name = fingerprint(world)
    if world is None or name == BLACK:
        return None
    surface = _surface(world)
    node = surface.node.name if surface.node else ""
    if surface.kind in {COLOUR, PLAIN}:
        return WorldLight(world, name, surface.kind, node, uniform((1.0, 1.0, 1.0)))
    mapping = surface.mapping.name if surface.mapping else ""
    environment = None if again else _known(name)
    if environment is None:
        environment = capture(world, node, mapping)
    _captured[name] = environment
    driving = world if surface.kind == SCALED else None
    inverse = surface.mapping is not None and surface.mapping.vector_type == "TEXTURE"
    return WorldLight(driving, name, surface.kind, node, environment, mapping, inverse)


def _known(name: str) -> Environment | None:
    if name in _captured:
        return _captured[name]
    for group in bpy.data.node_groups:
        if group.get(ids.WORLD_KEY) == name and ids.WORLD_LIGHT_KEY in group:
            return from_text(group[ids.WORLD_LIGHT_KEY], name, None).environment
    return None


def stamp(group: bpy.types.ShaderNodeTree, light: WorldLight | None) -> None:
    """Note on a shader group which world's light it has."""
    for key in (ids.WORLD_KEY, ids.WORLD_LIGHT_KEY, ids.WORLD_DATA_KEY):
        if key in group:
            del group[key]
    group[ids.WORLD_KEY] = BLACK if light is None else light.fingerprint
    if light is not None:
        group[ids.WORLD_LIGHT_KEY] = light.to_text()
        if light.world is not None:
            group[ids.WORLD_DATA_KEY] = light.world


def stamped(group: bpy.types.ShaderNodeTree) -> WorldLight | None:
    """Return the world's light that a shader group has."""
    name = group.get(ids.WORLD_KEY, BLACK)
    if name == BLACK or ids.WORLD_LIGHT_KEY not in group:
        return None
    return from_text(group[ids.WORLD_LIGHT_KEY], name, group.get(ids.WORLD_DATA_KEY))
