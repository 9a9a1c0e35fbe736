# SPDX-License-Identifier: GPL-3.0-or-later
"""Arguments, output and exit of a command that runs inside Blender or with Blender as a module."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Generator, Sequence
from typing import NoReturn, TypeVar

import bpy

from ..core.progress import in_words

Result = TypeVar("Result")


def own_arguments(argv: Sequence[str]) -> list[str]:
    """Drop Blender's arguments where the script runs inside it."""
    own = list(argv)
    if bpy.app.binary_path:
        return own[own.index("--") + 1 :] if "--" in own else []
    return own[1:]


def print_line(text: str) -> None:
    """Print at once, also into a pipe."""
    print(text, flush=True)


def run_with_progress(steps: Generator[tuple[float, str], None, Result], interval: float) -> Result:
    """Run steps to their end and print their progress.

    Args:
        steps: Yield the part that is done, from 0 to 1, and what is being done.
        interval: Least time between two lines, seconds; quicker work prints nothing.

    Returns:
        What the steps return.
    """
    start = printed = time.perf_counter()
    try:
        while True:
            try:
                part, what = next(steps)
            except StopIteration as done:
                result: Result = done.value
                return result
            now = time.perf_counter()
            if now - printed >= interval:
                printed = now
                print_line(f"  {what}: {in_words(part, now - start)}")
    finally:
        steps.close()  # Ctrl-C ends what the steps have started, too


def leave(code: int) -> NoReturn:
    """End the process; Blender 4.5 as a module now and then hangs in its libraries' destructors."""
    if bpy.app.binary_path:
        sys.exit(code)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)
