# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's unit of length."""

from __future__ import annotations

import bpy


def metres_per_unit(scene: bpy.types.Scene) -> float:
    """Return the metres in a unit of the scene; 1 where it has none, as elsewhere in Blender."""
    units = scene.unit_settings
    return 1.0 if units.system == "NONE" else float(units.scale_length)


def length_text(metres: float) -> str:
    """Format a length as Blender's own fields do: "24 cm"."""
    return str(bpy.utils.units.to_string("METRIC", "LENGTH", metres))
