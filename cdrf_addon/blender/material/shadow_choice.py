# SPDX-License-Identifier: GPL-3.0-or-later
"""Which cast shadows a material gets: by its setting, and by what the scene has to cast them."""

from __future__ import annotations

import bpy

from ...compat import HAS_RAYCAST
from ..instances import shown_objects
from ..shader.variant import NO_SHADOWS, ShadowChoice

AUTO, ON, OFF = "AUTO", "ON", "OFF"
SHADOW_ITEMS = [
    (AUTO, "Auto", "Cast shadows where the scene has another object that can cast one"),
    (ON, "On", "Cast shadows always, those of the object on itself too"),
    (OFF, "Off", "No cast shadows: faster"),
]
SURFACES = {"MESH", "CURVE", "SURFACE", "META", "FONT", "CURVES", "POINTCLOUD"}
"""Types of objects that can cast a shadow."""


def choose_shadows(material: bpy.types.Material, view_layer: bpy.types.ViewLayer) -> ShadowChoice:
    """Decide which cast shadows a material gets in the scene of a view layer."""
    setting = material.cdrf.shadows
    if setting == ON or (setting == AUTO and _casters(view_layer) > 1):
        return ShadowChoice(True, HAS_RAYCAST and material.cdrf.shadow_edges)
    return NO_SHADOWS


def _casters(view_layer: bpy.types.ViewLayer) -> int:
    """Count the objects that can cast a shadow in any rendered layer, the translucent one included.

    All layers share the material, so the count must not depend on which of them is open.
    """
    layers = [layer for layer in view_layer.id_data.view_layers if layer.use] or [view_layer]
    return len(
        {
            obj
            for layer in layers
            for obj in shown_objects(layer)
            if obj.type in SURFACES and obj.visible_shadow and not obj.hide_render
        }
    )
