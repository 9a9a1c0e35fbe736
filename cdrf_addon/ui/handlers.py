# SPDX-License-Identifier: GPL-3.0-or-later
"""Handlers that always run: they note edited meshes, clear caches and draw the legend.

Those that update lights automatically run only while the preference is on (light_updates.py).
"""

from __future__ import annotations

import bpy

from ..blender import state
from ..blender.display import legend

_HANDLERS = (
    ("depsgraph_update_post", state.note_touched),
    ("load_post", state.clear_caches),
    ("load_post", state.clear_world_cache),
    ("undo_post", state.clear_caches),
    ("redo_post", state.clear_caches),
)


def register() -> None:
    """Add the handlers, and the legend to the 3D Views."""
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)
    legend.register()


def unregister() -> None:
    """Undo `register`."""
    legend.unregister()
    for name, handler in reversed(_HANDLERS):
        getattr(bpy.app.handlers, name).remove(handler)
