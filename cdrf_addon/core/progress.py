# SPDX-License-Identifier: GPL-3.0-or-later
"""Long work as generators that yield their progress, so that it can be shown and stopped."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, TypeVar

Result = TypeVar("Result")


def run_steps(steps: Generator[Any, None, Result]) -> Result:
    """Run a generator of steps to its end and return its result."""
    while True:
        try:
            next(steps)
        except StopIteration as done:
            result: Result = done.value
            return result


def portion(
    steps: Generator[float, None, Result], start: float, end: float
) -> Generator[float, None, Result]:
    """Run steps as the part from start to end of a longer job."""
    while True:
        try:
            done = next(steps)
        except StopIteration as stop:
            result: Result = stop.value
            return result
        yield start + (end - start) * done


def in_words(part: float, elapsed: float) -> str:
    """Say how far long work is and how long it will take: "40%, 3 s left"."""
    left = f", {elapsed * (1.0 - part) / part:.0f} s left" if part > 0.1 else ""
    return f"{part:.0%}{left}"


def counted(steps: Generator[None, None, Result], expected: int) -> Generator[float, None, Result]:
    """Turn pauses into progress."""
    done = 0
    while True:
        try:
            next(steps)
        except StopIteration as stop:
            result: Result = stop.value
            return result
        done += 1
        yield min(done / expected, 1.0)


def with_progress(
    steps: Generator[None, None, Result], part: float
) -> Generator[float, None, Result]:
    """Turn pauses of unknown number into progress that stands still at `part`."""
    while True:
        try:
            next(steps)
        except StopIteration as stop:
            result: Result = stop.value
            return result
        yield part
