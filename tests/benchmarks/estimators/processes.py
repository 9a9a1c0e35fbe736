# SPDX-License-Identifier: GPL-3.0-or-later
"""A measurement in a process of its own, with its time and peak memory."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable
from typing import Any

from ..common.memory import whole_peak_megabytes

# A run that takes longer than this hangs.
LIMIT = 3_600.0


FORK = multiprocessing.get_context("fork")


class ChildFailedError(RuntimeError):
    """A measurement crashed, raised (its traceback is on the terminal) or hung."""


def in_child(call: Callable[..., Any], *arguments: Any) -> Any:
    """Run a call in a process of its own.

    Raises:
        ChildFailedError: It sent no result.
    """
    receiver, sender = FORK.Pipe(duplex=False)

    def run() -> None:
        sender.send(call(*arguments))

    child = FORK.Process(target=run)
    child.start()
    sender.close()
    try:
        if not receiver.poll(LIMIT):
            raise ChildFailedError(f"no result after {LIMIT:.0f} s")
        return receiver.recv()
    except EOFError:
        child.join()
        raise ChildFailedError(f"the process ended with code {child.exitcode}") from None
    finally:
        child.kill()
        child.join()


def timed(call: Callable[[], Any], patience: float) -> tuple[Any, dict[str, float]]:
    """Run a call and measure it; the memory is that of the first run."""
    before = whole_peak_megabytes()
    spent: list[tuple[float, float]] = []
    while not spent or (sum(wall for _, wall in spent) < patience and len(spent) < 3):
        cpu, wall = time.process_time(), time.perf_counter()
        result = call()
        spent.append((time.process_time() - cpu, time.perf_counter() - wall))
        if len(spent) == 1:
            megabytes = whole_peak_megabytes() - before
    seconds, wall = min(spent)
    return result, {"seconds": seconds, "wall": wall, "megabytes": megabytes}
