# SPDX-License-Identifier: GPL-3.0-or-later
"""What the numbers of a benchmark were measured on."""

from __future__ import annotations

import os
import platform
import time
from importlib.metadata import version

import bpy


def machine() -> dict[str, str]:
    """Name what the numbers were measured on."""
    packages = {name: version(name) for name in ("numpy", "scipy", "libigl")}
    return {
        "date": time.strftime("%Y-%m-%d"),
        "cores": str(os.cpu_count()),
        "architecture": platform.machine(),
        "python": platform.python_version(),
        "blender": bpy.app.version_string,
        **packages,
    }
