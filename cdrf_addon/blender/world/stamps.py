# SPDX-License-Identifier: GPL-3.0-or-later
"""Which world's light a shader group has, as noted on the group."""

from __future__ import annotations

import bpy

from ... import ids
from .fingerprint import BLACK, fingerprint
from .light import WorldLight, from_text


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
    """Return the world's light that a shader group has; None for no light."""
    name = group.get(ids.WORLD_KEY, BLACK)
    if name == BLACK or ids.WORLD_LIGHT_KEY not in group:
        return None
    return from_text(group[ids.WORLD_LIGHT_KEY], name, group.get(ids.WORLD_DATA_KEY))


def is_same(one: WorldLight | None, other: WorldLight | None) -> bool:
    """Return whether two lights are wired alike."""
    if one is None or other is None:
        return one is other
    same = (one.fingerprint, one.world) == (other.fingerprint, other.world)
    return same and one.to_text() == other.to_text()


def is_due(group: bpy.types.ShaderNodeTree, world: bpy.types.World | None) -> bool:
    """Return whether a shader group has another light than this world's."""
    name = fingerprint(world)
    if group.get(ids.WORLD_KEY, BLACK) != name:
        return True
    driving = group.get(ids.WORLD_DATA_KEY)
    return name != BLACK and driving is not None and driving != world
