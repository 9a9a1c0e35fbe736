# SPDX-License-Identifier: GPL-3.0-or-later
"""The name under which Blender knows the extension, and the folder it may write to."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Final

import bpy

EXTENSION: Final = (__package__ or "").removesuffix(".cdrf_addon")
"""`bl_ext.<repository>.cdrf` once installed, `cdrf_addon` in a checkout; keys the preferences."""
INSTALLED: Final = EXTENSION.startswith("bl_ext.")


def user_folder(subject: str) -> Path:
    """Return the folder for files of one subject, and make it.

    An installed extension has a folder of its own, which Blender deletes with it. A checkout has
    one among Blender's data files. Where neither can be made, there is the system's temporary one.

    Raises:
        OSError: No folder can be made.
    """
    if INSTALLED:
        found = bpy.utils.extension_path_user(EXTENSION, path=subject, create=True)
    else:
        found = bpy.utils.user_resource("DATAFILES", path=f"cdrf_{subject}", create=True)
    folder = Path(found) if found else Path(tempfile.gettempdir()) / f"cdrf_{subject}"
    folder.mkdir(parents=True, exist_ok=True)
    return folder
