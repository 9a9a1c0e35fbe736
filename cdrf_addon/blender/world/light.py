# SPDX-License-Identifier: GPL-3.0-or-later
"""The light of a world, as a shader group wires it: nine harmonics, a sun, and what drives them.

A world of one plain Background needs no picture: drivers carry its colour and strength. Any other
is rendered once, alone, all around (capture.py), and kept as nine numbers for each colour. Drivers
follow the strength of a plain Background, and the rotation of a picture's Mapping node: the picture
stays as it lies, and the surface is turned instead.
"""

from __future__ import annotations

import json
from dataclasses import dataclass

import bpy
import numpy as np

from ... import ids
from ...core.reflectance.environment import Environment, Sun, uniform
from .capture import capture
from .fingerprint import BLACK, fingerprint
from .surface import COLOUR, PLAIN, SCALED, read_surface

_captured: dict[str, Environment] = {}
"""By fingerprint: the worlds rendered since this file was opened."""


@dataclass(frozen=True)
class WorldLight:
    """What a shader group needs of a world."""

    world: bpy.types.World | None
    """The world whose properties drive it; None where nothing drives, or it was deleted."""
    fingerprint: str
    kind: str
    """COLOUR, PLAIN, SCALED or FIXED."""
    node: str
    """Name of the Background node that drives."""
    environment: Environment
    mapping: str = ""
    """Name of the Mapping node whose rotation drives; the environment is the one before it."""
    inverse: bool = False
    """Whether that node turns the other way (its type is Texture)."""

    def rotation(self) -> list[str]:
        """Return paths, from the world, of the angles around X, Y and Z; empty if nothing turns."""
        if not self.mapping or self.world is None:
            return []
        name = bpy.utils.escape_identifier(self.mapping)
        path = f'node_tree.nodes["{name}"].inputs["Rotation"].default_value'
        return [f"{path}[{i}]" for i in range(3)]

    def drivers(self) -> list[tuple[str, dict[str, str]]]:
        """Return expression and paths, from the world, of each channel's factor; empty if fixed."""
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
        """Return all but the world as JSON."""
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
    """Read back what `WorldLight.to_text` returned."""
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


def clear_captured() -> None:
    """Clear the captured worlds: another file may have pictures of the same names."""
    _captured.clear()


def world_light(world: bpy.types.World | None, *, again: bool = False) -> WorldLight | None:
    """Return a world's light, rendered if it is neither plain nor captured; None if it is black.

    Args:
        world: The world, or None for no light.
        again: Render it even if it was captured before.

    Raises:
        SceneError: It could not be rendered; the text names a remedy.
    """
    name = fingerprint(world)
    if world is None or name == BLACK:
        return None
    surface = read_surface(world)
    node = surface.background.name if surface.background else ""
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
    """Return the environment with that fingerprint if it was captured, or is on a shader group."""
    if name in _captured:
        return _captured[name]
    for group in bpy.data.node_groups:
        if group.get(ids.WORLD_KEY) == name and ids.WORLD_LIGHT_KEY in group:
            return from_text(group[ids.WORLD_LIGHT_KEY], name, None).environment
    return None
