# SPDX-License-Identifier: GPL-3.0-or-later
"""Light linking: which objects receive a light, as EEVEE decides it.

A light that no object of a material receives is left out of the material's group. Where the objects
differ, each has a property that the group reads: which lights it does not receive.
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
from .lighting import lights_of_translucent

INCLUDE, EXCLUDE = "INCLUDE", "EXCLUDE"


def receives(light: SceneLight, obj: bpy.types.Object) -> bool:
    """Return whether a light shines on an object."""
    if light.receivers is None:
        return True
    states = _states(light.receivers)
    # An object that is not named is lit unless another is included.
    return states.get(obj, EXCLUDE if INCLUDE in states.values() else INCLUDE) == INCLUDE


def _states(collection: bpy.types.Collection) -> dict[bpy.types.Object, str]:
    """Map the objects of a receiver collection to INCLUDE or EXCLUDE.

    Child collections come first, so that the state of an object in the collection itself overrides
    theirs; the state of a child holds for all that is in it, whatever its own children have.
    """
    states: dict[bpy.types.Object, str] = {}
    for child, how in zip(collection.children, collection.collection_children, strict=True):
        states.update(dict.fromkeys(child.all_objects, how.light_linking.link_state))
    for obj, how in zip(collection.objects, collection.collection_objects, strict=True):
        states[obj] = how.light_linking.link_state
    return states


def lights_of_material(
    material: bpy.types.Material, scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer
) -> list[SceneLight]:
    """List the lights of a scene that an object with the material may receive."""
    return lights_reaching(lights_of_translucent(scene, view_layer), material, view_layer)


def lights_reaching(
    lights: Sequence[SceneLight], material: bpy.types.Material, view_layer: bpy.types.ViewLayer
) -> list[SceneLight]:
    """Return the lights that an object of the material receives; mark those that only some do.

    Args:
        lights: Those of the scene.
        material: The material.
        view_layer: All layers of its scene count.
    """
    if all(light.receivers is None for light in lights):
        return list(lights)
    users = {
        obj
        for layer in view_layer.id_data.view_layers
        for obj in layer.objects
        if material in _materials(obj)
    }
    found = []
    for light in lights:
        received = {receives(light, obj) for obj in users}
        if received != {False}:
            found.append(replace(light, selective=len(received) > 1))
    return found


def links_of(lights: Iterable[SceneLight]) -> str:
    """Name the lights with light linking; groups of one variant differ by them."""
    linked = [
        f"{[one.name_full for one in light.source if one]}{' on some' if light.selective else ''}"
        for light in lights
        if light.receivers is not None
    ]
    return "; ".join(linked)


def write_unlit() -> None:
    """Write on every object of the file which of its groups' lights it does not receive."""
    for obj in bpy.data.objects:
        if not obj.is_editable:
            continue
        unlit = _unlit(obj)
        # An instance without the property would have that of the object in it.
        if unlit or (is_instance(obj) and _has_bits(obj)):
            obj[ids.UNLIT_KEY] = float(unlit)
        elif ids.UNLIT_KEY in obj:
            del obj[ids.UNLIT_KEY]


def unlit_is_due(obj: bpy.types.Object) -> bool:
    """Return whether the property of an object, or of an instance of it, is out of date."""
    if not _has_bits(obj):
        return obj.is_editable and ids.UNLIT_KEY in obj
    seen = [obj] + [
        empty
        for empty in bpy.data.objects
        if is_instance(empty) and obj.name in empty.instance_collection.all_objects
    ]
    return any(one.is_editable and int(one.get(ids.UNLIT_KEY, 0)) != _unlit(one) for one in seen)


def lost_on_saving(objects: Iterable[bpy.types.Object]) -> list[str]:
    """Name the library overrides whose property Blender will not save."""
    return [
        obj.name for obj in objects if obj.override_library is not None and ids.UNLIT_KEY in obj
    ]


def _has_bits(obj: bpy.types.Object) -> bool:
    nodes = (cdrf_node(material) for material in _materials(obj))
    return any(node is not None and light_bits(node.node_tree) for node in nodes)


def without_bit(group: bpy.types.ShaderNodeTree) -> list[str]:
    """Name the lights for which the objects' property had no bit left: they shine on all."""
    return [lamp.name for (lamp, _), bit in light_bits(group).items() if bit < 0 and lamp]


def _unlit(obj: bpy.types.Object) -> int:
    unlit = 0
    for material in _materials(obj):
        node = cdrf_node(material)
        for (lamp, empty), bit in light_bits(node.node_tree).items() if node else ():
            if lamp and bit >= 0 and not receives(SceneLight(lamp, "", instance=empty), obj):
                unlit |= 1 << bit
    return unlit


def _materials(obj: bpy.types.Object) -> set[bpy.types.Material]:
    """Return an object's materials; for an instance those of what it shows, as EEVEE does."""
    shown = obj.instance_collection.all_objects if is_instance(obj) else (obj,)
    return {slot.material for one in shown for slot in one.material_slots if slot.material}
