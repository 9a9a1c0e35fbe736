# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that choose a material's reflectance model and its scatter distance."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty

from ... import ids
from ...blender.material import settings
from ...blender.material.install import cdrf_node
from ...blender.material.model import has_colour, set_kind
from ...blender.material.scatter_distance import apply_preset, set_scattering
from ...blender.material.scattering import read_scattering
from ...blender.units import length_text, metres_per_unit
from ...core.errors import CdrfError
from ...core.reflectance.model import DEFAULT_KIND, MODEL_ITEMS, OFFERED_KINDS, SPHERE
from ...core.scattering.presets import PRESETS
from .shared import OnTranslucentMaterial, refuse, warn_if_overridden

# sigma0 times the median curvature: below, the surface looks opaque; above, lit from all sides.
LOOKS_OPAQUE, LOOKS_CLEAR = 0.02, 1.5


class CDRF_OT_set_model(OnTranslucentMaterial):
    """Choose how the light that spreads under the surface shades it"""

    bl_idname = "cdrf.set_model"
    bl_label = "Model"
    bl_options = {"REGISTER", "UNDO"}

    model: EnumProperty(
        name="Model",
        description="How the light that spreads under the surface shades it",
        items=MODEL_ITEMS,
        default=DEFAULT_KIND,
    )
    view_dependence: BoolProperty(
        name="View Dependence",
        description="Switch View Dependence on with Path-Traced Look; without this it stays as is",
        default=False,
        options={"HIDDEN", "SKIP_SAVE"},
    )

    @classmethod
    def description(
        cls, _context: bpy.types.Context, properties: bpy.types.OperatorProperties
    ) -> str:
        return next(tip for kind, _, tip in MODEL_ITEMS if kind == properties.model)

    def draw(self, _context: bpy.types.Context) -> None:
        column = self.layout.column(align=True)
        for kind in OFFERED_KINDS:
            column.prop_enum(self, "model", kind)

    def execute(self, context: bpy.types.Context) -> set[str]:
        material = self.material(context)
        switched_on = True if self.view_dependence and self.model == SPHERE else None
        try:
            set_kind(material, self.model, view_dependent=switched_on)
        except CdrfError as error:
            return refuse(self, error)
        warn_if_overridden(self, material)
        return {"FINISHED"}


class CDRF_OT_preset(OnTranslucentMaterial):
    """Scatter distance of a real material, in millimetres, for each colour"""

    bl_idname = "cdrf.preset"
    bl_label = "Preset"
    bl_options = {"REGISTER", "UNDO"}

    preset: EnumProperty(
        name="Material",
        description="The real material to scatter like",
        items=[(key, preset.label, preset.description) for key, preset in PRESETS.items()],
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
        description="Set the base color to the real material's, too, where no texture feeds it",
        default=False,
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        material = self.material(context)
        preset = PRESETS[self.preset]
        size = 1.0
        if self.real_height > 0.0:
            dimensions = context.object.dimensions
            size = (dimensions.z or max(dimensions)) / self.real_height
        metres = metres_per_unit(context.scene)
        try:
            apply_preset(material, preset, metres, size)
        except CdrfError as error:
            return refuse(self, error)
        node = cdrf_node(material)
        assert node is not None
        if self.with_color and not node.inputs[ids.BASE_COLOR].is_linked:
            node.inputs[ids.BASE_COLOR].default_value = (*preset.albedo, 1.0)
        self._warn_of_size(context.object, material.cdrf.sigma0, metres)
        warn_if_overridden(self, material)
        self.report({"INFO"}, f"CDRF: {preset.label}. {preset.description}")
        return {"FINISHED"}

    def _warn_of_size(self, obj: bpy.types.Object, sigma0: float, metres: float) -> None:
        """Warn where the object is so large or small that its translucency does not show.

        Args:
            obj: A translucent object.
            sigma0: Scatter distance, in world units.
            metres: Length of a world unit.
        """
        blur = sigma0 * obj.data.cdrf.median
        tall = length_text(obj.dimensions.z * metres)
        advice = "give its Real Height in the panel below the viewport (F9)."
        if 0.0 < blur < LOOKS_OPAQUE:
            self.report({"WARNING"}, f"At {tall} tall this object looks opaque: {advice}")
        elif blur > LOOKS_CLEAR:
            self.report({"WARNING"}, f"At {tall} tall light passes right through: {advice}")


class CDRF_OT_read_shader(OnTranslucentMaterial):
    """Take the scatter distance from the material's own Principled or Subsurface Scattering node"""

    bl_idname = "cdrf.read_shader"
    bl_label = "From Shader Nodes"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        material = self.material(context)
        found = read_scattering(material)
        if found is None:
            return refuse(
                self,
                f"Nothing in '{material.name}' scatters: give its Principled BSDF a Subsurface "
                "Weight and a Scale, or choose a preset.",
            )
        if has_colour(material):
            set_kind(material, DEFAULT_KIND)
        set_scattering(material, found)
        for note in found.notes_for(settings.is_view_dependent(material)):
            self.report({"WARNING"}, note)
        warn_if_overridden(self, material)
        self.report({"INFO"}, f"CDRF: scatter distance {material.cdrf.sigma0:.4g} from the nodes")
        return {"FINISHED"}


class CDRF_MT_model(bpy.types.Menu):
    """The models that the panel offers"""

    bl_label = "Model"

    def draw(self, _context: bpy.types.Context) -> None:
        for kind, name, _ in MODEL_ITEMS:
            if kind in OFFERED_KINDS:
                button = self.layout.operator("cdrf.set_model", text=name)
                button.model, button.view_dependence = kind, True


CLASSES = (CDRF_OT_set_model, CDRF_MT_model, CDRF_OT_preset, CDRF_OT_read_shader)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
