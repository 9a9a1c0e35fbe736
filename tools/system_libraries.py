# SPDX-License-Identifier: GPL-3.0-or-later
"""Print the Debian packages that EEVEE still needs here, on one line.

`import bpy` fails on the first library that it is linked to and cannot find, and a render aborts
the process when EGL is missing or has no driver. So this checks before either is tried, and does
not import bpy. It prints nothing where all is there, nor on systems other than Linux.
"""

from __future__ import annotations

import ctypes
import importlib.util
import re
import subprocess
import sys
from pathlib import Path

PACKAGES = {
    "libGL.so.1": "libgl1",
    "libICE.so.6": "libice6",
    "libSM.so.6": "libsm6",
    "libX11.so.6": "libx11-6",
    "libXext.so.6": "libxext6",
    "libXfixes.so.3": "libxfixes3",
    "libXi.so.6": "libxi6",
    "libXrender.so.1": "libxrender1",
    "libXxf86vm.so.1": "libxxf86vm1",
    "libgcc_s.so.1": "libgcc-s1",
    "libstdc++.so.6": "libstdc++6",
    "libxkbcommon.so.0": "libxkbcommon0",
}
EGL_LOADER = "libegl1"
# The software renderer; with a vendor's driver the check passes without it.
EGL_DRIVER = ["libegl-mesa0", "libgl1-mesa-dri"]
EGL_PLATFORM_SURFACELESS = 0x31DD


def missing_linked() -> set[str]:
    """Return the libraries that bpy is linked to and the loader does not find."""
    spec = importlib.util.find_spec("bpy")
    if spec is None or spec.origin is None:
        raise SystemExit("system_libraries: this Python has no bpy wheel.")
    listing = subprocess.run(
        ["ldd", str(Path(spec.origin))], capture_output=True, text=True, check=False
    ).stdout
    return set(re.findall(r"^\s*(\S+) => not found", listing, re.MULTILINE))


def egl_packages() -> list[str]:
    """Return what EGL needs to start without a display; bpy loads it only when it renders."""
    try:
        egl = ctypes.CDLL("libEGL.so.1")
    except OSError:
        return [EGL_LOADER, *EGL_DRIVER]
    egl.eglGetDisplay.restype = egl.eglGetPlatformDisplay.restype = ctypes.c_void_p
    egl.eglGetDisplay.argtypes = [ctypes.c_void_p]
    egl.eglGetPlatformDisplay.argtypes = [ctypes.c_uint, ctypes.c_void_p, ctypes.c_void_p]
    egl.eglInitialize.argtypes = [ctypes.c_void_p] * 3
    displays = (
        egl.eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS, None, None),
        egl.eglGetDisplay(None),
    )
    if any(display and egl.eglInitialize(display, None, None) for display in displays):
        return []
    return EGL_DRIVER


def main() -> None:
    """Print the packages; exit with a sentence if no package is known for a library."""
    if sys.platform != "linux":
        return
    missing = missing_linked()
    if unknown := missing - PACKAGES.keys():
        raise SystemExit(f"system_libraries: bpy needs {', '.join(sorted(unknown))}.")
    print(*sorted({PACKAGES[name] for name in missing} | set(egl_packages())))


if __name__ == "__main__":
    main()
