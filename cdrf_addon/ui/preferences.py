# SPDX-License-Identifier: GPL-3.0-or-later
"""The preferences of the extension: whether lights are updated automatically."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty

from .. import paths
from . import light_updates


def _auto_update_changed(self: CdrfPreferences, _context: bpy.types.Context) -> None:
    light_updates.stop()
    if self.auto_update:
        light_updates.start()
        light_updates.schedule()


class CdrfPreferences(bpy.types.AddonPreferences):
    """Preferences of the extension."""

    bl_idname = paths.EXTENSION

    auto_update: BoolProperty(
        name="Update Lights Automatically",
        description=(
            "When a light is added, deleted or changes its type, give it to the translucent "
            "materials without a click. Meshes and the world still wait for Update"
        ),
        default=False,
        update=_auto_update_changed,
    )

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw the switch."""
        self.layout.prop(self, "auto_update")


def register() -> None:
    """Register the preferences, and watch the lights if they are to be updated automatically."""
    bpy.utils.register_class(CdrfPreferences)
    addon = bpy.context.preferences.addons.get(CdrfPreferences.bl_idname)
    if addon is not None and addon.preferences is not None and addon.preferences.auto_update:
        light_updates.start()


def unregister() -> None:
    """Undo `register`."""
    light_updates.stop()
    bpy.utils.unregister_class(CdrfPreferences)
