# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a shader group still has the lights of its scene, and which of them differs.

lights of the scene --+-> wanted --+
variant of the group -+            +-> equal: current; else a sentence for the panel
nodes, drivers of the group -> wired
"""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from ... import ids
from ..lights.scene_lights import SceneLight
from ..nodes.tables import find_table
from ..nodes.tree import is_intact
from ..world.surface import world_shines
from .bits import bits_due
from .build import VERSION
from .variant import stamped_variant
from .wired import light_sources, wanted_light, wired_lights


def is_current(group: bpy.types.ShaderNodeTree, lights: Sequence[SceneLight]) -> bool:
    """Return whether a group has exactly these lights, each wired as it would be now."""
    if group.get(ids.VERSION_KEY) != VERSION or not is_intact(group):
        return False
    variant = stamped_variant(group)
    table = find_table(variant.model)
    if table is None:
        # Blender drops an unused table on saving: none is needed where only the world shines.
        return not lights and not wired_lights(group)
    wanted = {wanted_light(table, variant, light) for light in lights}
    if layers_due(group, lights) or shadows_due(group, lights) or bits_due(group):
        return False
    return set(wired_lights(group)) == wanted


def layers_due(group: bpy.types.ShaderNodeTree, lights: Sequence[SceneLight]) -> str:
    """Return which light other view layers leave out than when it was wired; else ""."""
    sources = light_sources(group)
    wired = {
        sources.get(node.name): tuple(node.get(ids.EXCLUDED_KEY, "").splitlines())
        for node in group.nodes
        if ids.LIGHT_KEY in node
    }
    for light in lights:
        if wired.get(light.source, light.excluded) != light.excluded:
            return f"light '{light.name}' is in other view layers now"
    return ""


def shadows_due(group: bpy.types.ShaderNodeTree, lights: Sequence[SceneLight]) -> str:
    """Return how the shadows differ from those that were wired; "" if they do not."""
    choice = stamped_variant(group).shadows
    if not choice.cast:
        return ""
    wired = {node.name for node in group.nodes if node.get(ids.SHADOW_KEY)}
    sources = light_sources(group)
    casting = {sources.get(name) for name in wired}
    changed = [light for light in lights if light.casts != (light.source in casting)]
    if changed:
        return f"light '{changed[0].name}' casts shadows now, or no more"
    if choice.edges:
        picky = {sources.get(name) for name in wired if group.nodes[name].get(ids.BLOCKERS_KEY)}
        for light in lights:
            if light.casts and light.picks_blockers != (light.source in picky):
                return f"other objects block light '{light.name}' now"
    scene = bpy.data.scenes.get(group[ids.SCENE_KEY])
    if wired and scene and world_shines(scene.world) != group.get(ids.SHADOW_WORLD_KEY):
        return "the world's light was switched on or off"
    return ""
