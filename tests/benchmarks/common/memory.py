# SPDX-License-Identifier: GPL-3.0-or-later
"""Peak memory of this process, MB."""

from __future__ import annotations

import resource
from pathlib import Path


def reset_peak() -> float:
    """Start a new measurement of peak memory (Linux); return what is in use, MB."""
    Path("/proc/self/clear_refs").write_text("5")
    return peak_megabytes()


def peak_megabytes() -> float:
    """Return the peak memory of this process since the last reset (Linux)."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return int(next(line for line in lines if line.startswith("VmHWM")).split()[1]) / 1024.0


def whole_peak_megabytes() -> float:
    """Return the most memory this process has held; a fork starts anew, from what it shares."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
