# SPDX-License-Identifier: GPL-3.0-or-later
"""Aggregates of the rows: errors of a family, costs, Pareto fronts, exponents."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from surfaces import ALL_SURFACES

from cdrf_addon.core.curvature.estimators import METHODS

from .cases import CLICK, EXACT, Config, Family, configurations, name_of
from .results import Results, Row


@dataclass(frozen=True)
class Point:
    """An estimator's error and time on a family at one size and noise."""

    config: Config
    error: float
    seconds: float

    @property
    def product(self) -> float:
        return self.error * self.seconds


class Summary:
    """Aggregates of the rows; a number is NaN where a surface is missing or failed."""

    def __init__(self, results: Results) -> None:
        self.rows = results.rows
        present = {(row.method, row.rings) for row in self.rows.values()}
        self.configs = [config for config in configurations() if config in present]
        self.sizes = sorted({row.size for row in self.rows.values()})
        self.noises = sorted({row.noise for row in self.rows.values()})

    def _of(self, surfaces: Iterable[str], size: int, noise: float, config: Config) -> list[Row]:
        keys = [(surface, size, noise, *config) for surface in surfaces]
        return [self.rows[key] for key in keys if key in self.rows]

    def error(
        self, family: Family, size: int, noise: float, config: Config, quantity: str, kind: str
    ) -> float:
        """RMS over the surfaces of the RMS errors, or the worst of the worst."""
        rows = self._of(family.surfaces, size, noise, config)
        values = [row.errors.get(f"{family.part} {quantity} {kind}", math.nan) for row in rows]
        if len(values) < len(family.surfaces) or any(math.isnan(value) for value in values):
            return math.nan
        return max(values) if kind == "worst" else math.sqrt(statistics.fmean(v**2 for v in values))

    def cost(self, config: Config, size: int, what: str, family: Family | None = None) -> float:
        """Median of seconds or megabytes over the surfaces and noises; they hardly differ."""
        surfaces = family.surfaces if family else ALL_SURFACES
        rows = [row for noise in self.noises for row in self._of(surfaces, size, noise, config)]
        values = [getattr(row, what) for row in rows if not row.failure]
        return statistics.median(values) if values else math.nan

    def filled(self, config: Config, size: int) -> float:
        """Per cent of vertices that an estimator left to their neighbours, on the worst mesh."""
        found = [
            row for noise in self.noises for row in self._of(ALL_SURFACES, size, noise, config)
        ]
        return max((100.0 * r.filled / r.vertices for r in found if r.vertices), default=math.nan)

    def points(self, family: Family, size: int, noise: float) -> list[Point]:
        """Error of the curvedness and time of every estimator that has both."""
        points = [
            Point(
                config,
                self.error(family, size, noise, config, "kappa", "rms"),
                self.cost(config, size, "seconds", family),
            )
            for config in self.configs
        ]
        return [point for point in points if math.isfinite(point.product)]

    def order(self, family: Family, config: Config) -> float:
        """Power of the edge length with which the RMS error of the curvedness falls."""
        errors = {
            size: self.error(family, size, 0.0, config, "kappa", "rms") for size in self.sizes
        }
        known = {size: error for size, error in errors.items() if error > EXACT}
        if len(known) < 2:
            return math.nan
        return -2.0 * exponent(list(known), list(known.values()))[0]


def pareto(points: Iterable[Point]) -> list[Point]:
    """Those that none other beats in error and time both, from quick to accurate."""
    front: list[Point] = []
    for point in sorted(points, key=lambda p: (p.seconds, p.error)):
        if not front or point.error < front[-1].error:
            front.append(point)
    return front


def exponent(sizes: ArrayLike, values: ArrayLike) -> tuple[float, float]:
    """Slope in the log-log plot and its standard error (NaN from two points)."""
    x, y = np.log(sizes), np.log(values)
    slope, base = np.polyfit(x, y, 1)
    if len(x) < 3:
        return float(slope), math.nan
    spread = ((y - base - slope * x) ** 2).sum() / (len(x) - 2)
    return float(slope), math.sqrt(float(spread / ((x - x.mean()) ** 2).sum()))


def scaling_series(results: Results) -> dict[str, list[Row]]:
    """Successful runs of the pipeline by name, by size."""
    named: dict[str, list[Row]] = {}
    for row in sorted(results.scaling.values(), key=lambda row: row.vertices):
        if not row.failure and row.method in (*METHODS, CLICK):
            named.setdefault(name_of((row.method, row.rings)), []).append(row)
    return named
