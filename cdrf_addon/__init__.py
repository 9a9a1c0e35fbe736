# SPDX-License-Identifier: GPL-3.0-or-later
"""CDRF: curvature-dependent translucency for EEVEE (Kubo, Dobashi and Morishima 2011).

`cdrf_addon.core` is usable without Blender, so nothing here imports bpy before it registers.
"""

from __future__ import annotations

from types import ModuleType


def _modules() -> tuple[ModuleType, ...]:
    from . import auto_update, ops, ops_measure, ops_model, panels, props

    return props, ops, ops_model, ops_measure, panels, auto_update


def register() -> None:
    """Register every class, property and handler of the extension."""
    for module in _modules():
        module.register()


def unregister() -> None:
    """Undo `register` in the reverse order."""
    for module in reversed(_modules()):
        module.unregister()
