# SPDX-License-Identifier: GPL-3.0-or-later
"""CDRF: curvature-dependent translucency for EEVEE (Kubo, Dobashi and Morishima 2011).

`cdrf_addon.core` is usable without Blender, so nothing here imports bpy before it registers.
"""

from __future__ import annotations

from types import ModuleType


def _modules() -> tuple[ModuleType, ...]:
    from .ui import light_updates as auto_update
    from .ui import panels
    from .ui import properties as props
    from .ui.operators import measure as ops_measure
    from .ui.operators import model as ops_model
    from .ui.operators import translucency as ops

    return props, ops, ops_model, ops_measure, panels, auto_update


def register() -> None:
    """Register every class, property and handler of the extension."""
    for module in _modules():
        module.register()


def unregister() -> None:
    """Undo `register` in the reverse order."""
    for module in reversed(_modules()):
        module.unregister()
