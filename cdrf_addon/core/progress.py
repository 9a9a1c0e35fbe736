# SPDX-License-Identifier: GPL-3.0-or-later
"""Long work as generators that yield their progress, so that it can be shown and stopped."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Generator
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


def _told(
    steps: Generator[Any, None, Result], tell: Callable[[Any], float]
) -> Generator[float, None, Result]:
    """Run steps and yield, for what each yields, the progress that `tell` makes of it."""
    while True:
        try:
            told = next(steps)
        except StopIteration as done:
            result: Result = done.value
            return result
        yield tell(told)


def portion(
    steps: Generator[float, None, Result], start: float, end: float
) -> Generator[float, None, Result]:
    """Run steps as the part from start to end of a longer job."""
    return _told(steps, lambda done: start + (end - start) * done)


def counted(steps: Generator[None, None, Result], expected: int) -> Generator[float, None, Result]:
    """Turn pauses into progress."""
    passed = itertools.count(1)
    return _told(steps, lambda _: min(next(passed) / expected, 1.0))


def with_progress(
    steps: Generator[None, None, Result], part: float
) -> Generator[float, None, Result]:
    """Turn pauses of unknown number into progress that stands still at `part`."""
    return _told(steps, lambda _: part)


def in_words(part: float, elapsed: float) -> str:
    """Say how far long work is and how long it will take: "40%, 3 s left"."""
    left = f", {elapsed * (1.0 - part) / part:.0f} s left" if part > 0.1 else ""
    return f"{part:.0%}{left}"
