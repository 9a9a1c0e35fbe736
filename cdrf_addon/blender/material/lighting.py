# SPDX-License-Identifier: GPL-3.0-or-later
"""The lights of translucent materials, which several view layers or scenes may show.

A render draws every view layer of a scene with the same material, so the material's group holds the
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
    materials: set[bpy.types.Material],
    fresh: set[bpy.types.Object],
) -> bool:
    """Return whether anything in a view layer is translucent, or about to be."""
    return any(
        obj in fresh or any(slot.material in materials for slot in obj.material_slots)
        for obj in shown_objects(view_layer)
        if obj.type == "MESH"
    )


def lights_of_translucent(
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    fresh: Iterable[bpy.types.Object] = (),
) -> list[SceneLight]:
    """List the lights of any rendered view layer that shows something translucent, by name.

    Args:
        scene: The scene.
        view_layer: Counts whether or not it is rendered; alone if nothing is translucent yet.
        fresh: Objects that are about to become translucent.
    """
    layers, others = [view_layer], [one for one in scene.view_layers if one != view_layer]
    if others:  # asked at every redraw of the panel, so not without need
        materials = {one for one in bpy.data.materials if cdrf_node(one) is not None}
        showing = [
            one
            for one in (view_layer, *others)
            if (one.use or one == view_layer) and _shows(one, materials, set(fresh))
        ]
        layers = showing or layers
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
    """Return the paths from a view layer to the Exclude flags of the collections with a light."""
    obj = light.instance or light.object
    flags: list[str] = []

    def visit(layer: bpy.types.LayerCollection, path: str) -> None:
        for child in layer.children:
            inside = f'{path}.children["{bpy.utils.escape_identifier(child.name)}"]'
            if any(part == obj for part in child.collection.objects):
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
    seen = any(slot.material == material for obj in other.objects for slot in obj.material_slots)
    return other if seen else None
