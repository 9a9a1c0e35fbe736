# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that make objects translucent, bring them up to date, and make them opaque again."""

from __future__ import annotations

import math

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty

from ...blender.material.translucent import translucent_materials_on, translucent_objects
from ...blender.removal import remove_translucency
from ...blender.setup import Setup
from ...core.curvature.creases import NO_CREASE
from ...core.curvature.estimators import DEFAULT_METHOD, DEFAULT_RADIUS, METHODS
from ...core.curvature.field import Options
from ...core.errors import CdrfError
from .shared import SetupOperator, in_object_mode, refuse


class CDRF_OT_setup(SetupOperator):
    """Make the selected objects translucent in EEVEE: curvature, table, node group and lights"""

    bl_idname = "cdrf.setup"
    bl_label = "Make Translucent"
    bl_options = {"REGISTER", "UNDO"}

    only_active_slot: BoolProperty(
        name="Only Active Material Slot",
        description="Leave the object's other materials (eyes, teeth, cloth) as they are",
        default=False,
    )
    method: EnumProperty(
        name="Curvature",
        description="How the curvature is estimated",
        items=[(key, method.label, method.description) for key, method in METHODS.items()],
        default=DEFAULT_METHOD,
    )
    radius: IntProperty(
        name="Smoothing Rings",
        description=(
            "Rings of neighbouring vertices the curvature is measured over. 2 is the most exact; "
            "3 to 5 suit noisy scans"
        ),
        default=DEFAULT_RADIUS,
        min=2,
        max=10,
    )
    crease_angle: FloatProperty(
        name="Split Creases",
        description=(
            "Measure the two sides of an edge apart where faces meet at a sharper angle than "
            "this, so that a crease does not count as curved. 180 degrees splits nothing"
        ),
        subtype="ANGLE",
        default=NO_CREASE,
        min=math.radians(1.0),
        max=NO_CREASE,
    )
    only_active_object: BoolProperty(
        name="Only Active Object",
        description="Work on the active object instead of the selected ones",
        default=False,
        options={"HIDDEN", "SKIP_SAVE"},
    )
    recompute: BoolProperty(
        name="Recompute",
        description="Measure the curvature again even where nothing has changed",
        default=False,
        options={"SKIP_SAVE"},
    )

    def make_job(self, context: bpy.types.Context) -> Setup:
        return Setup(
            context,
            [context.object] if self.only_active_object else context.selected_objects,
            options=Options(self.method, self.radius, self.crease_angle),
            only_active_slot=self.only_active_slot,
            recompute=self.recompute,
        )


class CDRF_OT_update(SetupOperator):
    """Bring the scene's translucent objects up to date: new lights, edited or scaled meshes"""

    bl_idname = "cdrf.update"
    bl_label = "Update"
    bl_options = {"REGISTER", "UNDO"}

    def make_job(self, context: bpy.types.Context) -> Setup:
        return Setup(context, translucent_objects(context.view_layer), convert=False)


class CDRF_OT_remove(bpy.types.Operator):
    """Make the selected objects opaque again: restores their materials and removes the curvature"""

    bl_idname = "cdrf.remove"
    bl_label = "Remove Translucency"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not in_object_mode(cls, context):
            return False
        if not any(translucent_materials_on(obj) for obj in context.selected_objects):
            cls.poll_message_set("Select a translucent object")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        materials = {
            material
            for obj in context.selected_objects
            for material in translucent_materials_on(obj)
        }
        try:
            remove_translucency(context, materials)
        except CdrfError as error:
            return refuse(self, error)
        plural = "s are" if len(materials) > 1 else " is"
        self.report({"INFO"}, f"CDRF: {len(materials)} material{plural} as before")
        return {"FINISHED"}


CLASSES = (CDRF_OT_setup, CDRF_OT_update, CDRF_OT_remove)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
