# SPDX-License-Identifier: GPL-3.0-or-later
"""What every command needs that runs inside Blender or with Blender as a module."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import NoReturn

import bpy


def own_arguments(argv: Sequence[str]) -> list[str]:
    """Drop Blender's arguments where the script runs inside it."""
    own = list(argv)
    if bpy.app.binary_path:
        return own[own.index("--") + 1 :] if "--" in own else []
    return own[1:]


def say(text: str) -> None:
    """Print at once, also into a pipe."""
    print(text, flush=True)


def leave(code: int) -> NoReturn:
    """End the process; Blender 4.5 as a module now and then hangs in its libraries' destructors."""
    if bpy.app.binary_path:
        sys.exit(code)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)
