# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects and materials are translucent."""

from __future__ import annotations

import bpy

from ..instances import shown_objects
from .install import cdrf_node


def materials_on(obj: bpy.types.Object) -> set[bpy.types.Material]:
    """Return the materials in an object's slots."""
    return {slot.material for slot in obj.material_slots if slot.material is not None}


def translucent_materials_on(obj: bpy.types.Object) -> list[bpy.types.Material]:
    """List the translucent materials of an object, slot by slot."""
    return [
        slot.material
        for slot in obj.material_slots
        if obj.type == "MESH" and cdrf_node(slot.material) is not None
    ]


def active_translucent_material(obj: bpy.types.Object | None) -> bpy.types.Material | None:
    """Return the translucent material that panels show: the active slot's, or the first."""
    if obj is None or obj.type != "MESH":
        return None
    found = translucent_materials_on(obj)
    return obj.active_material if obj.active_material in found else next(iter(found), None)


def linked_translucent_materials(obj: bpy.types.Object) -> list[bpy.types.Material]:
    """List the translucent materials of an object that another file owns."""
    return [
        material
        for material in materials_on(obj)
        if cdrf_node(material) is not None and not material.is_editable
    ]


def translucent_objects(view_layer: bpy.types.ViewLayer) -> list[bpy.types.Object]:
    """List mesh objects with a translucent material of this file, in instances too."""
    return [
        obj
        for obj in shown_objects(view_layer)
        if obj.type == "MESH"
        and any(cdrf_node(material) and material.is_editable for material in materials_on(obj))
    ]


def translucent_materials_of(
    view_layer: bpy.types.ViewLayer,
) -> dict[bpy.types.Material, list[bpy.types.Mesh]]:
    """Map the translucent materials of a view layer to the meshes that show them."""
    found: dict[bpy.types.Material, list[bpy.types.Mesh]] = {}
    for obj in translucent_objects(view_layer):
        for material in translucent_materials_on(obj):
            found.setdefault(material, []).append(obj.data)
    return found
