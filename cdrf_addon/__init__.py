# SPDX-License-Identifier: GPL-3.0-or-later
"""CDRF: curvature-dependent translucency for EEVEE (Kubo, Dobashi and Morishima 2011).

`cdrf_addon.core` works without Blender, so importing this package does not import bpy.
"""

from __future__ import annotations

from types import ModuleType


def _modules() -> tuple[ModuleType, ...]:
    """Return the modules to register, in order: panels show properties and operators."""
    from .ui import handlers, panels, preferences, properties
    from .ui.operators import display, measure, model, translucency

    operators = translucency, display, model, measure
    return properties, *operators, handlers, panels, preferences


def register() -> None:
    """Register every class, property and handler of the extension."""
    for module in _modules():
        module.register()


def unregister() -> None:
    """Undo `register`, in reverse order."""
    for module in reversed(_modules()):
        module.unregister()
