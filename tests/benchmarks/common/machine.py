# SPDX-License-Identifier: GPL-3.0-or-later
"""What the numbers of a benchmark were measured on."""

from __future__ import annotations

import os
import platform
import time
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path


def machine() -> dict[str, str]:
    """Return date, cores and versions, Blender's among them."""
    import bpy  # late: `machine_without_blender` must not load it

    packages = {name: version(name) for name in ("numpy", "scipy", "libigl")}
    return {
        "date": time.strftime("%Y-%m-%d"),
        "cores": str(os.cpu_count()),
        "architecture": platform.machine(),
        "python": platform.python_version(),
        "blender": bpy.app.version_string,
        **packages,
    }


def machine_without_blender() -> dict[str, str]:
    """Return date, processor and versions without loading Blender into this process."""
    processors = Path("/proc/cpuinfo")
    lines = processors.read_text().splitlines() if processors.exists() else []
    model = next((line.split(":")[1].strip() for line in lines if "model name" in line), "unknown")
    versions = {}
    for name in ("numpy", "scipy", "libigl", "bpy", "matplotlib"):
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "unknown"
    return {
        "date": time.strftime("%Y-%m-%d"),
        "processor": model,
        "cores": str(os.cpu_count()),
        "architecture": platform.machine(),
        "system": platform.system(),
        "python": platform.python_version(),
        **versions,
    }
