# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators for a material's model of reflectance and its scatter distance."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty

from ... import ids
from ...blender.material import model as reflectance_models
from ...blender.material.install import active_skin, cdrf_node
from ...blender.material.scattering import read_scattering
from ...core.errors import CdrfError
from ...core.reflectance.model import DEFAULT_KIND, MODEL_ITEMS
from ...core.scattering.presets import PRESETS

# Blurs of the middle of an object that look like none at all, and like wax throughout.
OPAQUE, MOLTEN = 0.02, 1.5


class OnSkin(bpy.types.Operator):
    """An operator on the active translucent material; never registered itself."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        skin = active_skin(context.object)
        if skin is None:
            cls.poll_message_set("Make the object translucent first")
            return False
        if not skin.is_editable:
            cls.poll_message_set("The material is linked from another file: make it local first")
            return False
        return True


def skin_of(context: bpy.types.Context) -> bpy.types.Material:
    """Return the material that `OnSkin.poll` found."""
    skin = active_skin(context.object)
    assert skin is not None
    return skin


def warn_if_overridden(operator: bpy.types.Operator, skin: bpy.types.Material) -> None:
    """Say so where a keyframe or a link decides the scatter distance, whatever was set."""
    what = reflectance_models.overridden(skin)
    if what:
        operator.report({"WARNING"}, what)


class CDRF_OT_set_model(OnSkin):
    """Choose how the light that spreads under the surface shades it"""

    bl_idname = "cdrf.set_model"
    bl_label = "Model"
    bl_options = {"REGISTER", "UNDO"}

    model: EnumProperty(name="Model", items=MODEL_ITEMS, default=DEFAULT_KIND)

    def execute(self, context: bpy.types.Context) -> set[str]:
        skin = skin_of(context)
        try:
            reflectance_models.set_kind(skin, self.model)
        except CdrfError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        warn_if_overridden(self, skin)
        return {"FINISHED"}


class CDRF_OT_preset(OnSkin):
    """Scatter distance of a real material, in millimetres, for each colour"""

    bl_idname = "cdrf.preset"
    bl_label = "Preset"
    bl_options = {"REGISTER", "UNDO"}

    preset: EnumProperty(
        name="Material",
        items=[(key, item.label, item.description) for key, item in PRESETS.items()],
    )
    real_height: FloatProperty(
        name="Real Height",
        description=(
            "How tall the object is meant to be. A head modelled 2 m tall scatters like one of "
            "24 cm if you say so here. 0 takes the object as it is"
        ),
        subtype="DISTANCE",
        default=0.0,
        min=0.0,
        options={"SKIP_SAVE"},
    )
    with_color: BoolProperty(
        name="Color Too",
        description="Set the base color to the material's, where no texture feeds it",
        default=False,
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        skin = skin_of(context)
        preset = PRESETS[self.preset]
        size = 1.0
        if self.real_height > 0.0:
            dimensions = context.object.dimensions
            size = (dimensions.z or max(dimensions)) / self.real_height
        metres = reflectance_models.metres_of(context.scene)
        try:
            reflectance_models.apply_preset(skin, preset, metres, size)
        except CdrfError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        node = cdrf_node(skin)
        assert node is not None
        if self.with_color and not node.inputs[ids.BASE_COLOR].is_linked:
            node.inputs[ids.BASE_COLOR].default_value = (*preset.albedo, 1.0)
        self._warn_of_size(context.object, skin.cdrf.sigma0, metres)
        warn_if_overridden(self, skin)
        self.report({"INFO"}, f"CDRF: {preset.label}. {preset.description}")
        return {"FINISHED"}

    def _warn_of_size(self, item: bpy.types.Object, sigma0: float, metres: float) -> None:
        """Say so where the object is so large or small that the material does not show."""
        blur = sigma0 * item.data.cdrf.median
        tall = bpy.utils.units.to_string("METRIC", "LENGTH", item.dimensions.z * metres)
        advice = "give its Real Height in the panel below the viewport (F9)."
        if 0.0 < blur < OPAQUE:
            self.report({"WARNING"}, f"At {tall} tall this object looks opaque: {advice}")
        elif blur > MOLTEN:
            self.report({"WARNING"}, f"At {tall} tall light passes right through: {advice}")


class CDRF_OT_read_shader(OnSkin):
    """Take the scatter distance from the material's own Principled or Subsurface Scattering node"""

    bl_idname = "cdrf.read_shader"
    bl_label = "From Shader Nodes"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        skin = skin_of(context)
        found = read_scattering(skin)
        if found is None:
            self.report(
                {"ERROR"},
                f"Nothing in '{skin.name}' scatters: give its Principled BSDF a Subsurface Weight "
                "and a Scale, or choose a preset.",
            )
            return {"CANCELLED"}
        if reflectance_models.has_colour(skin):
            reflectance_models.set_kind(skin, DEFAULT_KIND)
        reflectance_models.set_scattering(skin, found)
        for note in found.notes:
            self.report({"WARNING"}, note)
        warn_if_overridden(self, skin)
        self.report({"INFO"}, f"CDRF: scatter distance {skin.cdrf.sigma0:.4g} from the nodes")
        return {"FINISHED"}


CLASSES = (CDRF_OT_set_model, CDRF_OT_preset, CDRF_OT_read_shader)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
