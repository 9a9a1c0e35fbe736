# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: gather from the context, call, report."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ... import ids
from ...blender import state
from ...blender.display import curvature as display
from ...blender.display import legend, viewport
from ...blender.material import install as materials
from ...blender.material import linking
from ...blender.material import model as reflectance_models
from ...blender.mesh.attributes import remove_curvature
from ...blender.setup import Report, Setup, skins_of, skins_on, translucent_objects
from ...core.curvature.creases import NO_CREASE
from ...core.curvature.estimators import DEFAULT_METHOD, DEFAULT_RADIUS, METHODS
from ...core.curvature.field import Options
from ...core.errors import CdrfError
from ..modal import StepByStep

# Meshes up to this size are done in under half a second; above it a progress bar comes up.
MODAL_FROM_VERTICES = 15_000


class _Job(StepByStep):
    """Runs a Setup at once from a script, or step by step behind a progress bar for a person.

    Never registered itself; it has no bl_idname.
    """

    _job: Setup

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.mode != "OBJECT":
            cls.poll_message_set("Go to Object Mode first (Tab)")
            return False
        return True

    def make_job(self, context: bpy.types.Context) -> Setup:
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            self._job = self.make_job(context)
            for _ in self._job.steps():
                pass
        except CdrfError as error:
            return self.refuse(error)
        return self.finish_or_say(context, None)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        try:
            self._job = self.make_job(context)
        except CdrfError as error:
            return self.refuse(error)
        if self._evaluated_vertices(context) < MODAL_FROM_VERTICES:
            return self.execute(context)
        self._steps = self._job.steps()
        return self.begin(context)

    def _evaluated_vertices(self, context: bpy.types.Context) -> int:
        depsgraph = context.evaluated_depsgraph_get()
        return sum(
            len(work.users[0].evaluated_get(depsgraph).data.vertices) for work in self._job.work
        )

    def finish(self, _context: bpy.types.Context, _result: Any) -> set[str]:
        _tell(self, self._job.commit())
        return {"FINISHED"}


def _tell(operator: bpy.types.Operator, report: Report) -> None:
    for line in report.warnings:
        operator.report({"WARNING"}, line)
    operator.report({"INFO"}, f"CDRF: {report.sentence()}")


class CDRF_OT_setup(_Job):
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
            "Do not let the curvature see across edges at which faces meet at a sharper angle than "
            "this, so that a crease does not count as bent. 180 degrees splits nothing"
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


class CDRF_OT_update(_Job):
    """Bring the scene's translucent objects up to date: new lights, edited or scaled meshes"""

    bl_idname = "cdrf.update"
    bl_label = "Update"
    bl_options = {"REGISTER", "UNDO"}

    def make_job(self, context: bpy.types.Context) -> Setup:
        objects = translucent_objects(context.view_layer)
        return Setup(context, objects, convert=False)


class CDRF_OT_remove(bpy.types.Operator):
    """Make the selected objects opaque again: restores their materials and removes the curvature"""

    bl_idname = "cdrf.remove"
    bl_label = "Remove Translucency"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.mode != "OBJECT":
            cls.poll_message_set("Go to Object Mode first (Tab)")
            return False
        if not any(skins_on(item) for item in context.selected_objects):
            cls.poll_message_set("Select a translucent object")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        chosen = {skin for item in context.selected_objects for skin in skins_on(item)}
        try:
            for material in chosen:
                materials.require_editable(material)
        except CdrfError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        users = [item for item in bpy.data.objects if chosen & set(skins_on(item))]
        for material in chosen:
            display.show_skin(material)
            materials.remove(material)
        rest = skins_of(context.view_layer)
        if not any(display.shows_curvature(skin) for skin in rest):
            display.hide(())
            viewport.restore(context)
        for item in users:
            if not skins_on(item) and item.is_editable and item.data.is_editable:
                remove_curvature(item.data)
                item.data.cdrf.fingerprint = ""
                if ids.SCALE_KEY in item:
                    del item[ids.SCALE_KEY]
        linking.write_unlit()
        reflectance_models.remove_unused()
        self.report({"INFO"}, f"CDRF: {len(chosen)} material(s) as before")
        return {"FINISHED"}


def _some_translucent(cls: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    if not translucent_objects(context.view_layer):
        cls.poll_message_set("Nothing is translucent yet: press Make Translucent first")
        return False
    return True


class CDRF_OT_show_curvature(bpy.types.Operator):
    """Show the curvature in colours with a legend, or the skin again; green marks are filled in"""

    bl_idname = "cdrf.show_curvature"
    bl_label = "Show Curvature"
    bl_options = {"REGISTER", "UNDO"}

    display: EnumProperty(
        name="Display",
        items=[
            ("TOGGLE", "Toggle", "Switch between curvature and skin"),
            ("ON", "Curvature", "Colours for curvature"),
            ("OFF", "Skin", "The translucent surface"),
        ],
        default="TOGGLE",
        options={"SKIP_SAVE"},
    )
    quantity: EnumProperty(
        name="Quantity",
        description="What is shown",
        items=[(key, *texts) for key, texts in display.QUANTITIES.items()],
        default="KAPPA",
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if ids.DISPLAY_KEY in context.scene:
            return True  # whatever became of the objects since, it can be switched off
        return _some_translucent(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        skins = skins_of(context.view_layer)
        showing = ids.DISPLAY_KEY in context.scene or any(map(display.shows_curvature, skins))
        if self.display == "OFF" or (self.display == "TOGGLE" and showing):
            display.hide(display.showing_materials())
            viewport.restore(context)
            return {"FINISHED"}
        try:
            display.show(context.scene, skins, self.quantity)
        except CdrfError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        viewport.show_materials(context)
        return {"FINISHED"}


class CDRF_OT_save_curvature(bpy.types.Operator):
    """Render the curvature in colours, with its legend, to a PNG; the scene stays as it is"""

    bl_idname = "cdrf.save_curvature"
    bl_label = "Save Curvature Picture"

    filepath: StringProperty(name="File", subtype="FILE_PATH", default="//curvature.png")
    quantity: EnumProperty(
        name="Quantity",
        description="What is shown",
        items=[(key, *texts) for key, texts in display.QUANTITIES.items()],
        default="KAPPA",
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.scene.camera is None:
            cls.poll_message_set("The scene has no camera; add one first")
            return False
        return _some_translucent(cls, context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        path = Path(bpy.path.abspath(self.filepath))
        if not path.is_absolute():
            self.report({"ERROR"}, "Save the file first, or choose a folder for the picture.")
            return {"CANCELLED"}
        if not path.name or path.is_dir():
            self.report({"ERROR"}, "Choose a name for the picture, not only a folder.")
            return {"CANCELLED"}
        if path.suffix.lower() != ".png":
            path = path.with_name(f"{path.name}.png")
        try:
            legend.render_curvature(
                context.scene, skins_of(context.view_layer), path, self.quantity
            )
        except (CdrfError, OSError, RuntimeError) as error:
            self.report({"ERROR"}, str(error).strip())
            return {"CANCELLED"}
        self.report({"INFO"}, f"CDRF: curvature saved as {path}")
        return {"FINISHED"}


CLASSES = (
    CDRF_OT_setup,
    CDRF_OT_update,
    CDRF_OT_remove,
    CDRF_OT_show_curvature,
    CDRF_OT_save_curvature,
)

_HANDLERS = (
    ("depsgraph_update_post", state.note_touched),
    ("load_post", state.forget_all),
    ("load_post", state.forget_worlds),
    ("undo_post", state.forget_all),
    ("redo_post", state.forget_all),
)


def register() -> None:
    """Register the operators and the handlers that watch for edits."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)
    legend.register()


def unregister() -> None:
    """Undo `register`."""
    legend.unregister()
    for name, handler in reversed(_HANDLERS):
        getattr(bpy.app.handlers, name).remove(handler)
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
