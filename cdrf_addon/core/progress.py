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


def _mapped(
    steps: Generator[Any, None, Result], convert: Callable[[Any], float]
) -> Generator[float, None, Result]:
    """Run steps and convert what each yields to a progress from 0 to 1."""
    while True:
        try:
            value = next(steps)
        except StopIteration as done:
            result: Result = done.value
            return result
        yield convert(value)


def portion(
    steps: Generator[float, None, Result], start: float, end: float
) -> Generator[float, None, Result]:
    """Run steps as a part of a longer job.

    Args:
        steps: Yields its own progress from 0 to 1.
        start: Progress of the whole job when the steps begin.
        end: Progress of the whole job when they end.

    Yields:
        Progress of the whole job.
    """
    return _mapped(steps, lambda done: start + (end - start) * done)


def counted(steps: Generator[None, None, Result], expected: int) -> Generator[float, None, Result]:
    """Turn pauses, of which so many are expected, into progress."""
    passed = itertools.count(1)
    return _mapped(steps, lambda _: min(next(passed) / expected, 1.0))


def with_progress(
    steps: Generator[None, None, Result], part: float
) -> Generator[float, None, Result]:
    """Turn pauses of unknown number into progress that stays at `part`."""
    return _mapped(steps, lambda _: part)


def in_words(part: float, elapsed: float) -> str:
    """Describe the progress of long work: "40%, 3 s left".

    Args:
        part: Progress from 0 to 1.
        elapsed: Seconds since the start.
    """
    left = f", {elapsed * (1.0 - part) / part:.0f} s left" if part > 0.1 else ""
    return f"{part:.0%}{left}"
