# SPDX-License-Identifier: GPL-3.0-or-later
"""Enable, disable, enable: nothing is left behind, nothing is missing."""

from __future__ import annotations

from typing import Any

import bpy
import pytest

HANDLERS = ("depsgraph_update_post", "load_post", "undo_post", "redo_post")
OPERATORS = ["fit", "measure", "preset", "read_shader", "remove", "save_curvature", "set_model"]
OPERATORS += ["setup", "show_curvature", "update"]


def traces() -> dict[str, Any]:
    return {
        "operators": sorted(dir(bpy.ops.cdrf)),
        "classes": sorted(n for n in dir(bpy.types) if n.upper().startswith("CDRF")),
        "material": hasattr(bpy.types.Material, "cdrf"),
        "mesh": hasattr(bpy.types.Mesh, "cdrf"),
        "handlers": [
            handler.__name__
            for name in HANDLERS
            for handler in getattr(bpy.app.handlers, name)
            if "cdrf" in handler.__module__
        ],
    }


@pytest.mark.smoke
def test_enable_disable_enable(_enabled: None) -> None:
    with_it = traces()
    assert with_it["operators"] == OPERATORS
    assert with_it["material"] and with_it["mesh"] and len(with_it["handlers"]) == 5
    bpy.ops.preferences.addon_disable(module="cdrf_addon")
    gone = traces()
    assert not any(gone.values()), gone
    assert bpy.ops.preferences.addon_enable(module="cdrf_addon") == {"FINISHED"}
    assert traces() == with_it
