# SPDX-License-Identifier: GPL-3.0-or-later
"""Times of calls, and how repeated times are summarised."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from .memory import peak_megabytes, reset_peak

Spent = dict[str, float]


def timed(call: Callable[[], Any]) -> Spent:
    """Return seconds on the clock, seconds of all cores, and megabytes more at the peak."""
    before, start = os.times(), time.perf_counter()
    memory = reset_peak()
    call()
    after = os.times()
    cpu = after.user + after.system - before.user - before.system
    return {"wall": time.perf_counter() - start, "cpu": cpu,
            "megabytes": peak_megabytes() - memory}  # fmt: skip


def least_cpu_milliseconds(call: Callable[[], Any], repeat: int = 5) -> float:
    """Return the least CPU time of a few runs."""
    times = []
    for _ in range(repeat):
        start = time.process_time()
        call()
        times.append(time.process_time() - start)
    return 1e3 * min(times)


def interleaved(calls: dict[str, Callable[[], Any]], rounds: int) -> dict[str, list[float]]:
    """Return the CPU seconds of calls that take turns, so that a drift of the machine meets all."""
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(rounds):
        for name, call in calls.items():
            start = time.process_time()
            call()
            seconds[name].append(time.process_time() - start)
    return seconds


def spread(values: Iterable[float]) -> tuple[float, float, float]:
    """Return the median, the 10 % and the 90 % quantile."""
    low, middle, high = np.percentile(list(values), (10, 50, 90))
    return float(middle), float(low), float(high)
