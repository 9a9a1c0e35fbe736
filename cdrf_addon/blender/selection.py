# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects and material slots a job works on, and what it refuses."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import bpy

from ..core.errors import SceneError
from .instances import shown_objects
from .material.install import cdrf_node, require_editable
from .material.lighting import lit_elsewhere
from .material.translucent import (
    linked_translucent_materials,
    materials_on,
    translucent_objects,
)
from .mesh.attributes import is_measured


@dataclass
class Selection:
    """What a job works on."""

    objects: list[bpy.types.Object] = field(default_factory=list)
    slots: list[bpy.types.MaterialSlot] = field(default_factory=list)
    """Slots whose material becomes translucent or is brought up to date."""
    bare: list[bpy.types.Object] = field(default_factory=list)
    """Objects without any slot, one for each mesh: they get a first material."""
    linked_slots: list[bpy.types.MaterialSlot] = field(default_factory=list)
    """Slots whose translucent material another file owns: they get a copy of it."""
    warnings: list[str] = field(default_factory=list)

    def leave_out(self, mesh: bpy.types.Mesh, users: Iterable[bpy.types.Object]) -> None:
        """Work neither on a mesh nor on the slots of it and its users."""
        self.bare = [obj for obj in self.bare if obj.data != mesh]
        owners = {*users, mesh}
        self.slots = [slot for slot in self.slots if slot.id_data not in owners]


def select(
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    objects: Sequence[bpy.types.Object],
    *,
    only_active_slot: bool,
    convert: bool,
) -> Selection:
    """Choose the slots to work on, and the objects that need a first material.

    Args:
        scene: Its lights will shine on the materials.
        view_layer: The one that is open.
        objects: Objects of any type.
        only_active_slot: Choose an object's active material slot only.
        convert: False to leave materials alone that are not translucent yet, or not this scene's.

    Raises:
        SceneError: There is nothing to work on, or something may not be changed.
    """
    selection = Selection()
    _choose_objects(selection, view_layer, objects, convert)
    for obj in selection.objects:
        slots = list(obj.material_slots)
        if only_active_slot and slots:
            slots = [slots[obj.active_material_index]]
        if not convert:
            slots = [slot for slot in slots if _is_ours(slot.material, scene, selection.warnings)]
        elif not slots:
            _choose_bare(selection, obj)
        _choose_slots(selection, obj, slots)
    if not (selection.slots or selection.bare or selection.linked_slots):
        raise SceneError(selection.warnings[-1])
    if convert:
        selection.warnings += _taken_from_other_scenes(selection.slots, scene)
    return selection


def _choose_objects(
    selection: Selection,
    view_layer: bpy.types.ViewLayer,
    objects: Sequence[bpy.types.Object],
    convert: bool,
) -> None:
    """Choose the meshes; when materials are only updated, those that somebody sees."""
    for obj in objects:
        if obj.type != "MESH":
            if convert and obj.type not in {"LIGHT", "CAMERA", "EMPTY"}:
                selection.warnings.append(
                    f"'{obj.name}' is not a mesh: convert it first (Object > Convert > Mesh)."
                )
        elif convert or not obj.hide_render or obj.visible_get(view_layer=view_layer):
            if obj.mode == "EDIT":
                raise SceneError(f"'{obj.name}' is in Edit Mode: leave it first (Tab).")
            selection.objects.append(obj)
    if not selection.objects:
        raise SceneError(_nothing_to_do(view_layer, objects, convert))


def _choose_bare(selection: Selection, obj: bpy.types.Object) -> None:
    require_editable(obj.data)
    if all(other.data != obj.data for other in selection.bare):
        selection.bare.append(obj)


def _choose_slots(
    selection: Selection, obj: bpy.types.Object, slots: Iterable[bpy.types.MaterialSlot]
) -> None:
    for slot in slots:
        linked = slot.material is not None and not slot.material.is_editable
        if linked and obj.is_editable and cdrf_node(slot.material) is not None:
            selection.linked_slots.append(slot)
        else:
            require_editable(slot.material or obj.data)
            selection.slots.append(slot)


def _is_ours(
    material: bpy.types.Material | None, scene: bpy.types.Scene, warnings: list[str]
) -> bool:
    """Return whether Update may change a material: translucent, local, lit by this scene."""
    if material is None or cdrf_node(material) is None or not material.is_editable:
        return False
    other = lit_elsewhere(material, scene)
    if other is not None:
        line = (
            f"'{material.name}' was left as it is, with the lights of the scene "
            f"'{other.name}', where it is seen too. Give this scene objects and materials of "
            "its own (Object > Relations > Make Single User > Object & Data & Materials) and "
            "update again, or take them over with Make Translucent."
        )
        if line not in warnings:
            warnings.append(line)
    return other is None


def _taken_from_other_scenes(
    slots: Iterable[bpy.types.MaterialSlot], scene: bpy.types.Scene
) -> list[str]:
    """Name the materials that had another scene's lights, where they are seen too."""
    found = []
    for material in dict.fromkeys(slot.material for slot in slots):
        other = lit_elsewhere(material, scene) if material is not None else None
        if other is not None:
            found.append(
                f"'{material.name}' has this scene's lights now, in the scene '{other.name}' "
                "too: press Make Translucent there to change back."
            )
    return found


def _nothing_to_do(
    view_layer: bpy.types.ViewLayer, objects: Sequence[bpy.types.Object], convert: bool
) -> str:
    """Explain why there is no mesh to work on, and what to do."""
    instances = [obj.name for obj in objects if obj.type == "EMPTY" and obj.instance_collection]
    if convert and instances:
        return (
            f"'{instances[-1]}' is an instance of a collection: make the objects in it "
            "translucent, or turn it into a library override (Object > Library Override > "
            "Make) or into real objects (Object > Apply > Make Instances Real) first."
        )
    if convert:
        return "No mesh object is selected: click the object that should become translucent."
    if translucent_objects(view_layer):
        return "Every translucent object is hidden: show one and update again."
    if any(linked_translucent_materials(obj) for obj in shown_objects(view_layer)):
        return (
            "The translucent materials here are linked from another file and have its lights: "
            "update them there, or turn their objects into library overrides (Object > Library "
            "Override > Make) and press Make Translucent for copies lit by this scene."
        )
    return "Nothing in this scene is translucent yet: press Make Translucent first."


def users_of(selection: Selection, view_layer: bpy.types.ViewLayer) -> list[bpy.types.Object]:
    """List the selected objects, and all others of the view layer that show their materials.

    Raises:
        SceneError: A mesh of theirs is linked from another file and was not measured there.
    """
    materials = {slot.material for slot in selection.slots if slot.material is not None}
    users = list(selection.objects)
    for obj in shown_objects(view_layer):
        if obj.type == "MESH" and obj not in users and materials & materials_on(obj):
            users.append(obj)
    others = len(users) - len(selection.objects)
    if others:
        selection.warnings.append(
            f"{others} more object{'s' if others > 1 else ''} with the same material "
            f"{'are' if others > 1 else 'is'} translucent with it."
        )
    for obj in users:
        if not is_measured(obj.data):  # a linked mesh keeps what was measured in its file
            require_editable(obj.data)
    return users
