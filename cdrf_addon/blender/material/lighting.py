# SPDX-License-Identifier: GPL-3.0-or-later
"""The lights of a skin, which several view layers, or another scene, may see as well.

A render draws every view layer of a scene with the same material, so the skin's group holds the
lights of all layers that show it. A light that one of them leaves out is switched by a driver that
reads the *Exclude* flags of the view layer being drawn.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import bpy

from ... import ids
from ..instances import shown_objects
from ..lights.scene_lights import SceneLight, scene_lights
from ..shader.wired import Source, wired_lights
from .install import cdrf_node


def _shows(
    view_layer: bpy.types.ViewLayer,
    skins: set[bpy.types.Material],
    fresh: set[bpy.types.Object],
) -> bool:
    """Tell whether anything in a view layer is translucent, or about to be."""
    return any(
        item in fresh or any(slot.material in skins for slot in item.material_slots)
        for item in shown_objects(view_layer)
        if item.type == "MESH"
    )


def lights_on_skin(
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    fresh: Iterable[bpy.types.Object] = (),
) -> list[SceneLight]:
    """List the lights that reach the skin in any rendered view layer of a scene, by name.

    Args:
        scene: The scene.
        view_layer: Counts whether or not it is rendered; alone if no layer shows any skin.
        fresh: Objects that are about to become translucent.
    """
    layers, others = [view_layer], [one for one in scene.view_layers if one != view_layer]
    if others:  # asked at every redraw of the panel, so not without need
        skins = {skin for skin in bpy.data.materials if cdrf_node(skin) is not None}
        seen = [
            one
            for one in (view_layer, *others)
            if (one.use or one == view_layer) and _shows(one, skins, set(fresh))
        ]
        layers = seen or layers
    found: dict[Source, SceneLight] = {}
    everywhere: set[Source] = set()
    for number, layer in enumerate(layers):
        here = {light.source: light for light in scene_lights(scene, layer)}
        everywhere = everywhere & set(here) if number else set(here)
        found = here | found
    lights = [
        light if source in everywhere else replace(light, excluded=_flags_of(scene, light))
        for source, light in found.items()
    ]
    return sorted(lights, key=lambda light: light.name)


def _flags_of(scene: bpy.types.Scene, light: SceneLight) -> tuple[str, ...]:
    """Paths from a view layer to the Exclude flags of the collections that show a light."""
    item = light.instance or light.object
    flags: list[str] = []

    def visit(layer: bpy.types.LayerCollection, path: str) -> None:
        for child in layer.children:
            inside = f'{path}.children["{bpy.utils.escape_identifier(child.name)}"]'
            if any(part == item for part in child.collection.objects):
                flags.append(f"{inside}.exclude")
            visit(child, inside)

    visit(scene.view_layers[0].layer_collection, "layer_collection")
    return tuple(flags)


def _home_of(group: bpy.types.ShaderNodeTree) -> bpy.types.Scene | None:
    """Return the scene whose lights a group has; if it was renamed, the one that has them all."""
    named = bpy.data.scenes.get(group.get(ids.SCENE_KEY, ""))
    if named is not None:
        return named
    lamps = {branch.instance or branch.object for branch in wired_lights(group)} - {None}
    scenes = bpy.data.scenes if lamps else ()
    return next((one for one in scenes if lamps <= set(one.objects)), None)


def lit_elsewhere(material: bpy.types.Material, scene: bpy.types.Scene) -> bpy.types.Scene | None:
    """Return the other scene whose lights a translucent material has, if it is seen there."""
    node = cdrf_node(material)
    other = _home_of(node.node_tree) if node is not None else None
    if other is None or other == scene:
        return None
    seen = any(slot.material == material for item in other.objects for slot in item.material_slots)
    return other if seen else None
