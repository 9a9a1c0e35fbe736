# SPDX-License-Identifier: GPL-3.0-or-later
"""The panels: in the 3D View's sidebar (tab CDRF) and in the material's properties."""

from __future__ import annotations

import textwrap

import bpy

from .. import ids
from ..blender import state
from ..blender.display.curvature import shows_curvature
from ..blender.material.install import cdrf_node
from ..blender.material.model import kind_of_model, profile_problem
from ..blender.material.specular import find_principled
from ..blender.material.translucent import active_translucent_material
from ..blender.shader.variant import stamped_variant
from ..blender.shader.wired import wired_lights
from ..blender.world.stamps import stamped_world
from ..blender.world.surface import FIXED, SCALED
from ..compat import EEVEE, HAS_RAYCAST
from ..core.curvature.estimators import METHODS
from ..core.curvature.summary import CONSTANT, FLAT, VARYING
from ..core.reflectance.model import MODEL_ITEMS, PROFILE, SPHERE

_MOST_LINES = 6


def _wrapped(layout: bpy.types.UILayout, text: str, width: int, icon: str = "NONE") -> None:
    for number, line in enumerate(textwrap.wrap(text, max(width, 20))):
        layout.label(text=line, icon=icon if number == 0 else "BLANK1")


def _characters(context: bpy.types.Context) -> int:
    scale = context.preferences.system.ui_scale
    return int((context.region.width - 60.0 * scale) / (7.0 * scale))


def draw_surface(
    layout: bpy.types.UILayout, context: bpy.types.Context, material: bpy.types.Material
) -> None:
    """Draw how the light scatters, the colour and the shadows of a translucent material."""
    node = cdrf_node(material)
    assert node is not None
    column = layout.column()
    column.use_property_split = True
    column.use_property_decorate = False
    column.enabled = material.is_editable
    if node.inputs[ids.SIGMA0].is_linked:
        column.label(text="Scatter Distance comes from a node")
    else:
        # The socket itself, so that the key I keyframes it, and a file works without the extension.
        column.prop(node.inputs[ids.SIGMA0], "default_value", text="Scatter \u03c3\u2080")
    column.prop(material.cdrf, "sigma0_ratio", text="Ratio R, G, B")
    if not node.inputs[ids.BASE_COLOR].is_linked:
        column.prop(node.inputs[ids.BASE_COLOR], "default_value", text="Base Color")
    column.prop(node.inputs[ids.STRENGTH], "default_value", text="Strength")
    if ids.DETAIL_SIZE in node.inputs:
        column.prop(node.inputs[ids.DETAIL_SIZE], "default_value", text="Detail Size")
    column.prop(material.cdrf, "shadows")
    shadowed = stamped_variant(node.node_tree).shadows
    if shadowed.cast and HAS_RAYCAST:
        column.prop(material.cdrf, "shadow_edges")
    wired = wired_lights(node.node_tree)
    lookups = sum(len(light.lookups.split()) for light in wired)
    plural = "" if lookups == 1 else "s"
    text = f"{lookups} look-up{plural} for {len(wired)} light(s)"
    text += ", shadows" if shadowed.cast else ""
    layout.label(text=text, icon="TEXTURE")
    if not material.is_editable:
        _wrapped(layout, "Linked: make it local to change it.", _characters(context), "LINKED")


def draw_model(layout: bpy.types.UILayout, material: bpy.types.Material) -> None:
    """Draw the choice of model, and the buttons that find a scatter distance."""
    kind = kind_of_model(material)
    name = next(label for key, label, *_ in MODEL_ITEMS if key == kind)
    column = layout.column(align=True)
    column.menu("CDRF_MT_model", text=name, icon="SHADING_TEXTURE")
    if kind == SPHERE:
        row = column.row(align=True)
        row.enabled = material.is_editable
        row.prop(material.cdrf, "view_dependence", toggle=True, icon="HIDE_OFF")
    row = layout.row(align=True)
    row.operator_menu_enum("cdrf.preset", "preset", text="Preset", icon="PRESET")
    row.operator("cdrf.fit", icon="GRAPH")
    row.operator("cdrf.read_shader", text="", icon="EYEDROPPER")
    if kind == PROFILE:
        column = layout.column()
        column.prop(material.cdrf, "profile", text="")
        column.prop(material.cdrf, "profile_base", expand=False)
        problem = profile_problem(material)
        if problem:
            column.label(text=problem, icon="ERROR")


def draw_ambient(layout: bpy.types.UILayout, material: bpy.types.Material) -> None:
    """Draw what is followed of the world's light, and the switch of its occlusion."""
    node = cdrf_node(material)
    assert node is not None
    light = stamped_world(node.node_tree)
    if light is None:
        layout.label(text="No light from the world", icon="WORLD")
        return
    text = {
        FIXED: "World as of the last Update",
        SCALED: "World; its strength is followed",
    }.get(light.kind, "World; colour and strength followed")
    if light.rotation():
        text = "World; strength and rotation followed"
    if light.environment.sun is not None:
        text += ", with a sun"
    layout.label(text=text, icon="WORLD")
    row = layout.row(align=True)
    row.enabled = material.is_editable
    row.prop(material.cdrf, "ambient_occlusion", toggle=True)
    if ids.OCCLUSION_DISTANCE in node.inputs:
        row.prop(node.inputs[ids.OCCLUSION_DISTANCE], "default_value", text="Distance")


def draw_specular(layout: bpy.types.UILayout, material: bpy.types.Material) -> None:
    """Draw the switch of the specular part, where the material has one to keep."""
    if find_principled(material) is not None:
        row = layout.row()
        row.enabled = material.is_editable
        row.prop(
            material.cdrf, "gloss", text="Gloss of Principled BSDF", toggle=True, icon="MATERIAL"
        )


def draw_display(
    layout: bpy.types.UILayout, context: bpy.types.Context, material: bpy.types.Material
) -> None:
    """Draw the buttons that show the curvature in colours, and the one to remove translucency."""
    row = layout.row(align=True)
    shown = shows_curvature(material)
    button = row.operator(
        "cdrf.show_curvature",
        text="Show Material" if shown else "Show Curvature",
        icon="HIDE_OFF",
        depress=shown,
    )
    button.display = "OFF" if shown else "ON"
    row.operator("cdrf.remove", text="", icon="TRASH")
    kept = context.scene.get(ids.DISPLAY_KEY)
    if not shown or kept is None:
        return
    row = layout.row(align=True)
    for quantity, text in (("KAPPA", "Measured"), ("DIFFUSED", "Rendered"), ("MEAN", "Signed")):
        button = row.operator(
            "cdrf.show_curvature", text=text, depress=kept["quantity"] == quantity
        )
        button.display, button.quantity = "ON", quantity
    row.operator("cdrf.save_curvature", text="", icon="RENDER_STILL")


def draw_state(
    layout: bpy.types.UILayout, context: bpy.types.Context, obj: bpy.types.Object
) -> None:
    """Draw the object's curvature, and what is out of date."""
    known = obj.data.cdrf
    width = _characters(context)
    box = layout.box().column(align=True)
    if known.kind == FLAT:
        box.label(text="Flat: nothing to scatter", icon="MESH_PLANE")
    elif known.kind == CONSTANT:
        box.label(text=f"Curvature {known.mean_values[0]:.4g} everywhere", icon="SPHERE")
    else:
        box.label(text=f"Curvature {known.low:.3g} to {known.high:.3g}", icon="SPHERECURVE")
        box.label(text=f"Median {known.median:.3g}, radius {1 / max(known.median, 1e-9):.3g}")
    box.label(text=f"{known.evaluated_vertices:,} vertices in {known.seconds:.2f} s", icon="TIME")
    if known.kind == VARYING:
        method = METHODS[known.method].label if known.method in METHODS else known.method
        box.label(text=f"{method}, {known.radius} rings", icon="MOD_SMOOTH")
    for line in known.warnings.splitlines()[:_MOST_LINES]:
        _wrapped(box, line, width, "INFO")
    playing = bool(context.screen and context.screen.is_animation_playing)
    reasons = state.reasons_to_update(obj, context.scene, context.view_layer, playing=playing)
    if reasons:
        due = layout.box().column(align=True)
        due.alert = True
        for reason in reasons[:_MOST_LINES]:
            _wrapped(due, reason, width, "ERROR")
        due.operator("cdrf.update", icon="FILE_REFRESH")
    else:
        row = layout.row()
        row.label(text="Up to date", icon="CHECKMARK")
        row.operator("cdrf.update", text="", icon="FILE_REFRESH")


class _View3D:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "CDRF"


class CDRF_PT_main(_View3D, bpy.types.Panel):
    """Make Translucent, and the material and the curvature of the active object."""

    bl_label = "Translucency"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        obj = context.active_object
        material = active_translucent_material(obj)
        row = layout.row()
        row.scale_y = 1.5
        row.operator("cdrf.setup", icon="SHADING_RENDERED")
        if context.mode != "OBJECT":
            layout.label(text="Leave this mode to continue (Tab)", icon="INFO")
        elif obj is None or obj.type != "MESH":
            layout.label(text="Select a mesh object", icon="INFO")
        if material is None:
            return
        engine = context.scene.render.engine
        if engine != EEVEE:
            layout.label(text="Shown by EEVEE only", icon="INFO")
            layout.prop(context.scene.render, "engine", text="Render Engine")
        layout.label(text=material.name, icon="MATERIAL")
        draw_surface(layout, context, material)
        draw_model(layout, material)
        draw_ambient(layout, material)
        draw_specular(layout, material)
        draw_display(layout, context, material)
        draw_state(layout, context, obj)


class CDRF_PT_material(bpy.types.Panel):
    """The same controls among the material's properties."""

    bl_label = "Translucency (CDRF)"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.object is not None and context.object.type == "MESH"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        material = context.object.active_material
        if cdrf_node(material) is None:
            button = layout.operator("cdrf.setup", icon="SHADING_RENDERED")
            button.only_active_slot = button.only_active_object = True
            return
        draw_surface(layout, context, material)
        draw_model(layout, material)
        draw_ambient(layout, material)
        draw_specular(layout, material)
        draw_state(layout, context, context.object)


CLASSES = (CDRF_PT_main, CDRF_PT_material)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
