# SPDX-License-Identifier: GPL-3.0-or-later
"""How numbers, sizes and levels of noise are written on the page and in the figures."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from .cases import EXACT


def short(value: float) -> str:
    """Two significant digits without an exponent; 0 is less than any error of interest."""
    if not math.isfinite(value):
        return "–"
    if abs(value) < 100.0 * EXACT:
        return "0"
    return np.format_float_positional(value, 2, fractional=False, unique=False, trim="-")


def count_of(size: int) -> str:
    """1k, 10k, 1M."""
    return f"{size // 1_000_000}M" if size >= 1_000_000 else f"{size // 1_000}k"


def noise_of(noise: float) -> str:
    """Name a level of noise."""
    return f"{100 * noise:g} % noise" if noise else "clean"


def series(values: Iterable[float]) -> str:
    """A number for each size in one cell."""
    return " / ".join(short(value) for value in values)
