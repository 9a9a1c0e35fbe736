# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that show the curvature in colours, in the viewport or as a picture."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import EnumProperty, StringProperty

from ... import ids
from ...blender.display import curvature, legend, viewport
from ...blender.material.translucent import translucent_materials_of
from ...core.errors import CdrfError, SceneError
from .shared import any_translucent, refuse

QUANTITY_ITEMS = [(key, *texts) for key, texts in curvature.QUANTITIES.items()]


class CDRF_OT_show_curvature(bpy.types.Operator):
    """Show the curvature in colours with a legend, or hide it again; green marks filled-in parts"""

    bl_idname = "cdrf.show_curvature"
    bl_label = "Show Curvature"
    bl_options = {"REGISTER", "UNDO"}

    display: EnumProperty(
        name="Display",
        description="What the translucent materials show",
        items=[
            ("TOGGLE", "Toggle", "Switch between the curvature and the material"),
            ("ON", "Curvature", "The curvature in colours"),
            ("OFF", "Material", "The translucent material"),
        ],
        default="TOGGLE",
        options={"SKIP_SAVE"},
    )
    quantity: EnumProperty(
        name="Quantity",
        description="Which curvature the colours show",
        items=QUANTITY_ITEMS,
        default="KAPPA",
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        # A display that is on can be switched off, whatever became of the objects since.
        return ids.DISPLAY_KEY in context.scene or any_translucent(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        materials = translucent_materials_of(context.view_layer)
        shown = ids.DISPLAY_KEY in context.scene or any(map(curvature.shows_curvature, materials))
        if self.display == "OFF" or (self.display == "TOGGLE" and shown):
            curvature.hide(curvature.showing_materials())
            viewport.restore(context)
            return {"FINISHED"}
        try:
            curvature.show(context.scene, materials, self.quantity)
        except CdrfError as error:
            return refuse(self, error)
        viewport.show_materials(context)
        return {"FINISHED"}


class CDRF_OT_save_curvature(bpy.types.Operator):
    """Render the curvature in colours, with its legend, to a PNG; the scene stays as it is"""

    bl_idname = "cdrf.save_curvature"
    bl_label = "Save Curvature Picture"

    filepath: StringProperty(
        name="File",
        description="Where the picture is saved",
        subtype="FILE_PATH",
        default="//curvature.png",
    )
    quantity: EnumProperty(
        name="Quantity",
        description="Which curvature the colours show",
        items=QUANTITY_ITEMS,
        default="KAPPA",
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.scene.camera is None:
            cls.poll_message_set("The scene has no camera; add one first")
            return False
        return any_translucent(cls, context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        materials = translucent_materials_of(context.view_layer)
        try:
            path = _png_path(self.filepath)
            legend.render_curvature(context.scene, materials, path, self.quantity)
        except (CdrfError, OSError, RuntimeError) as error:
            return refuse(self, error)
        self.report({"INFO"}, f"CDRF: curvature saved as {path}")
        return {"FINISHED"}


def _png_path(text: str) -> Path:
    """Return the PNG that a path, perhaps relative to the .blend file, stands for.

    Raises:
        SceneError: The path has no folder or no name.
    """
    path = Path(bpy.path.abspath(text))
    if not path.is_absolute():
        raise SceneError("Save the file first, or choose a folder for the picture.")
    if not path.name or path.is_dir():
        raise SceneError("Choose a name for the picture, not only a folder.")
    return path if path.suffix.lower() == ".png" else path.with_name(f"{path.name}.png")


CLASSES = (CDRF_OT_show_curvature, CDRF_OT_save_curvature)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
