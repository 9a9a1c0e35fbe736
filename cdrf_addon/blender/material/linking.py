# SPDX-License-Identifier: GPL-3.0-or-later
"""Light linking: which objects receive a light, as EEVEE decides it.

A light that no object of a material receives is left out of the material's group. Where the objects
differ each says by itself, in a property that the group reads, which lights it does not receive.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import bpy

from ... import ids
from ..instances import is_instance
from ..lights.scene_lights import SceneLight
from ..shader.bits import light_bits
from .install import cdrf_node
from .lighting import lights_on_skin

INCLUDE, EXCLUDE = "INCLUDE", "EXCLUDE"


def receives(light: SceneLight, item: bpy.types.Object) -> bool:
    """Tell whether a light shines on an object."""
    if light.receivers is None:
        return True
    states = _states(light.receivers)
    # Who is not named is lit unless somebody is included.
    return states.get(item, EXCLUDE if INCLUDE in states.values() else INCLUDE) == INCLUDE


def _states(collection: bpy.types.Collection) -> dict[bpy.types.Object, str]:
    """Map the objects of a receiver collection to INCLUDE or EXCLUDE.

    Child collections come first, so that an object of the collection itself has the last word; the
    state of a child counts for all that is in it, whatever its own children say.
    """
    states: dict[bpy.types.Object, str] = {}
    for child, how in zip(collection.children, collection.collection_children, strict=True):
        states.update(dict.fromkeys(child.all_objects, how.light_linking.link_state))
    for item, how in zip(collection.objects, collection.collection_objects, strict=True):
        states[item] = how.light_linking.link_state
    return states


def material_lights(
    material: bpy.types.Material, scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer
) -> list[SceneLight]:
    """List the lights of a scene that an object with the material may receive."""
    return reaching(lights_on_skin(scene, view_layer), material, view_layer)


def reaching(
    lights: Sequence[SceneLight], material: bpy.types.Material, view_layer: bpy.types.ViewLayer
) -> list[SceneLight]:
    """Leave out the lights that no object of the material receives; mark those that some do."""
    if all(light.receivers is None for light in lights):
        return list(lights)
    users = {
        item
        for layer in view_layer.id_data.view_layers
        for item in layer.objects
        if material in _materials(item)
    }
    found = []
    for light in lights:
        received = {receives(light, item) for item in users}
        if received != {False}:
            found.append(replace(light, selective=len(received) > 1))
    return found


def links_of(lights: Iterable[SceneLight]) -> str:
    """Name the lights with light linking, by which groups of one variant are told apart."""
    linked = [
        f"{[one.name_full for one in light.source if one]}{' on some' if light.selective else ''}"
        for light in lights
        if light.receivers is not None
    ]
    return "; ".join(linked)


def write_unlit() -> None:
    """Tell every object of the file which of its groups' lights it does not receive."""
    for item in bpy.data.objects:
        if not item.is_editable:
            continue
        unlit = _unlit(item)
        # An instance without the property would have that of the object in it.
        if unlit or (is_instance(item) and _has_bits(item)):
            item[ids.UNLIT_KEY] = float(unlit)
        elif ids.UNLIT_KEY in item:
            del item[ids.UNLIT_KEY]


def unlit_is_due(item: bpy.types.Object) -> bool:
    """Tell whether an object, or an instance of it, says wrongly which lights it does not get."""
    if not _has_bits(item):
        return item.is_editable and ids.UNLIT_KEY in item
    seen = [item] + [
        empty
        for empty in bpy.data.objects
        if is_instance(empty) and item.name in empty.instance_collection.all_objects
    ]
    return any(one.is_editable and int(one.get(ids.UNLIT_KEY, 0)) != _unlit(one) for one in seen)


def lost_on_saving(items: Iterable[bpy.types.Object]) -> list[str]:
    """Name the library overrides whose property Blender will not save."""
    return [
        item.name for item in items if item.override_library is not None and ids.UNLIT_KEY in item
    ]


def _has_bits(item: bpy.types.Object) -> bool:
    nodes = (cdrf_node(material) for material in _materials(item))
    return any(node is not None and light_bits(node.node_tree) for node in nodes)


def without_bit(group: bpy.types.ShaderNodeTree) -> list[str]:
    """Name the lights for which an object's property had no bit left, so that they shine on all."""
    return [lamp.name for (lamp, _), bit in light_bits(group).items() if bit < 0 and lamp]


def _unlit(item: bpy.types.Object) -> int:
    unlit = 0
    for material in _materials(item):
        node = cdrf_node(material)
        for (lamp, empty), bit in light_bits(node.node_tree).items() if node else ():
            if lamp and bit >= 0 and not receives(SceneLight(lamp, "", instance=empty), item):
                unlit |= 1 << bit
    return unlit


def _materials(item: bpy.types.Object) -> set[bpy.types.Material]:
    """Materials of an object; of an instance those of what it shows, as EEVEE asks the empty."""
    shown = item.instance_collection.all_objects if is_instance(item) else (item,)
    return {slot.material for one in shown for slot in one.material_slots if slot.material}
