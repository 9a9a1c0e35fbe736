# SPDX-License-Identifier: GPL-3.0-or-later
"""Candidates at rising lengths, and the slider that fits each of them best."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from ..common.arrays import Array
from ..common.rays import Hits
from ..common.shapes import Shape
from .cases import Case
from .curvature import KINDS, Diffusion
from .settings import FACTORS, FIXED, LADDER, RATIO, SIGMA0_GRID, SIGMA0_RANGE

Rule = tuple[str, float]
"""("raw", 0), ("fixed", l) or ("factor", c), where l = c * sigma0 of the channel."""
RULES: tuple[Rule, ...] = (
    ("raw", 0.0),
    *(("fixed", length) for length in FIXED),
    *(("factor", factor) for factor in FACTORS),
)


def length_of(rule: Rule, sigma0: float) -> float:
    """Length over which the curvature of one channel is diffused."""
    return rule[1] * sigma0 if rule[0] == "factor" else rule[1]


class Levels:
    """The curvature of every pixel of a case at rising lengths, linear in log l in between."""

    def __init__(self, kappa: NDArray[Any], lengths: Sequence[float]) -> None:
        self.kappa = kappa
        self._lengths = np.array(lengths)
        positive = self._lengths[self._lengths > 0.0]
        step = positive[1] / positive[0]
        # Unchanged values, l = 0, stand one step before the first.
        self._log = np.log(np.where(self._lengths > 0.0, self._lengths, positive[0] / step))

    def at(self, length: float) -> Array:
        """Curvature at one length; beyond the ends, that of the end."""
        if length <= 0.0:
            return self.kappa[0].astype(np.float64)
        place = float(np.interp(math.log(length), self._log, np.arange(len(self._log))))
        lower = min(int(place), len(self._log) - 2)
        part = place - lower
        return np.asarray(
            self.kappa[lower] * (1.0 - part) + self.kappa[lower + 1] * part, dtype=np.float64
        )


@dataclass
class Fit:
    """Fitted slider and errors of one candidate on one case."""

    sigma0: float
    rmse: float
    sigma0_channels: list[float]
    rmse_channels: float


def least(objective: Callable[[float], float]) -> tuple[float, float]:
    """Minimise over the logarithm of sigma0: a grid, then a search around its best point."""
    grid = np.linspace(math.log(SIGMA0_RANGE[0]), math.log(SIGMA0_RANGE[1]), SIGMA0_GRID)
    values = [objective(math.exp(x)) for x in grid]
    at = int(np.argmin(values))
    ends = grid[max(at - 1, 0)], grid[min(at + 1, SIGMA0_GRID - 1)]
    found = minimize_scalar(
        lambda x: objective(math.exp(x)), bounds=ends, method="bounded", options={"xatol": 2e-3}
    )
    if found.fun > values[at]:
        return math.exp(grid[at]), values[at]
    return math.exp(found.x), float(found.fun)


def channel_rmse_at(
    case: Case, levels: Levels, rule: Rule, kernel: str, channel: int, sigma0: float
) -> float:
    """RMSE of one channel with its own slider."""
    return case.error(kernel, channel, sigma0 * levels.at(length_of(rule, sigma0)))


def rmse_at(case: Case, levels: Levels, rule: Rule, kernel: str, sigma0: float) -> float:
    """Mean over R, G, B of the RMSE with one slider."""
    errors = [
        channel_rmse_at(case, levels, rule, kernel, channel, sigma0 * ratio)
        for channel, ratio in enumerate(RATIO)
    ]
    return sum(errors) / 3.0


def fit(case: Case, levels: Levels, rule: Rule, kernel: str) -> Fit:
    """Fit the slider, and each channel by itself."""
    sigma0, rmse = least(partial(rmse_at, case, levels, rule, kernel))
    channels = [
        least(partial(channel_rmse_at, case, levels, rule, kernel, channel)) for channel in range(3)
    ]
    each = [value for value, _ in channels]
    return Fit(sigma0, rmse, each, sum(error for _, error in channels) / 3.0)


def pixel_fields(
    shape: Shape, hits: Hits, diffusion: Diffusion, lengths: Iterable[float]
) -> NDArray[np.float32]:
    """Diffused curvatures at the pixels: (lengths, pixels, columns)."""
    return np.stack(
        [hits.interpolate(shape, diffusion.at(length)).astype(np.float32) for length in lengths]
    )


def levels_of(case: Case, fields: NDArray[np.float32]) -> dict[str, Levels]:
    """Every kind of curvature of a case on the ladder."""
    return {
        kind: Levels(make(fields, case.tangent.astype(np.float32)), LADDER)
        for kind, make in KINDS.items()
    }


def rule_name(rule: Rule) -> str:
    """Head of a column."""
    if rule[0] == "raw":
        return "raw"
    return f"l = {rule[1]:g}" if rule[0] == "fixed" else f"{rule[1]:g} σ0"


def difference(
    case: Case, one: Levels, other: Levels, rule: Rule, kernel: str, sigma0: float
) -> float:
    """RMS difference of two images, mean over the channels."""
    total = 0.0
    for ratio in RATIO:
        own = sigma0 * ratio
        length = length_of(rule, own)
        images = [case.image(kernel, own * levels.at(length)) for levels in (one, other)]
        total += float(np.sqrt(((images[0] - images[1]) ** 2).mean()))
    return total / 3.0
