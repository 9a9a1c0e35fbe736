# SPDX-License-Identifier: GPL-3.0-or-later
"""The shading of the 3D Views while curvature is shown, and the way back."""

from __future__ import annotations

import bpy

# Shown by EEVEE, whatever the render engine is.
_SHOWS_MATERIALS = "MATERIAL"
_before: dict[int, str] = {}
"""Former shading of the views that were changed, by address of their space."""


def _spaces(context: bpy.types.Context) -> list[bpy.types.SpaceView3D]:
    areas = context.screen.areas if context.screen is not None else ()
    return [area.spaces.active for area in areas if area.type == "VIEW_3D"]


def show_materials(context: bpy.types.Context) -> None:
    """Switch the window's 3D Views to show materials; those that do already stay as they are."""
    for space in _spaces(context):
        if space.shading.type in {"SOLID", "WIREFRAME"}:
            _before[space.as_pointer()] = space.shading.type
            space.shading.type = _SHOWS_MATERIALS


def restore(context: bpy.types.Context) -> None:
    """Give the views their former shading, unless the artist has chosen another meanwhile."""
    for space in _spaces(context):
        former = _before.pop(space.as_pointer(), None)
        if former is not None and space.shading.type == _SHOWS_MATERIALS:
            space.shading.type = former
    _before.clear()
