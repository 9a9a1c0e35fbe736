# SPDX-License-Identifier: GPL-3.0-or-later
"""Smooth a measured shading curve, as far as its Monte-Carlo error allows.

The curve is split into the best closed-form model, which has the sharp terminator of a small
scatter distance, and a remainder. The remainder becomes a penalised spline (Eilers and Marx 1996),
as stiff as the discrepancy principle (Morozov 1966) allows: chi-squared per degree of freedom
reaches 1. Its knots are dense around the terminator, within about the width of the blur.

Two multiples of the closed-form model are not penalised: itself, and itself times sin theta. The
walk of Cycles enters the surface partly by refraction, so that low albedos look brighter at grazing
angles, and sin theta is, up to a factor, the mean cosine to the viewer over the pixels of one N.L
when the light comes from the side.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from .fitting import MODELS, ModelFitter

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

# Rows that a cubic is fitted to: more would lose detail, a higher degree would keep noise.
ROWS_AT_ONCE, ROW_DEGREE = 7, 3
LEAST_MOVE = 1e-12
INTERVALS = 32
STIFFNESSES = 10.0 ** np.arange(-4.0, 9.0, 0.25)
# The spline's knots are densest within this many radians of the terminator.
LEAST_WIDTH, MOST_WIDTH = 0.02, 0.5
# Factor by which chi-squared may exceed the least that any stiffness reaches, if that is above 1.
SLACK = 1.1
RIDGE = 1e-10
# Median of the absolute value of a normal variable.
NORMAL_MEDIAN = 0.6745
# Least error of a bin: one that no path reached is not exact.
LEAST_ERROR = 1e-4


@dataclass(frozen=True)
class Curve:
    """A smoothed shading curve.

    Attributes:
        model: Name of the closed-form part.
        sigma: Its width, radians.
        gain: Its gain.
        chi_squared: Chi-squared per degree of freedom of the curve against the measured values.
        freedom: Degrees of freedom of the spline.
    """

    model: str
    sigma: float
    gain: float
    chi_squared: float
    freedom: float
    _spline: Callable[[Array], Array]

    def __call__(self, theta: Array) -> Array:
        """Evaluate at any angles in [0, pi], radians; never negative."""
        base = self.gain * MODELS[self.model](theta, self.sigma)
        return np.maximum(base + self._spline(theta), 0.0)


def _stretch(theta: Array, width: float) -> Array:
    """Map angles to a coordinate in which the knots are uniform, half of them at the terminator."""
    x = theta - math.pi / 2.0
    crowded = np.arcsinh(x / width) / math.asinh(math.pi / 2.0 / width)
    return np.asarray(crowded + x * (2.0 / math.pi))


class Smoother:
    """Smooths curves that were measured at the same angles.

    Args:
        theta: (B,) angles of the bins, radians.
        weights: (B,) weights for the fit of the closed-form part.
        models: Names of the closed forms to choose from.
    """

    def __init__(
        self, theta: Array, weights: Array, models: Sequence[str] = ("ring", "sphere")
    ) -> None:
        self._theta = theta
        self._fitters = {name: ModelFitter(name, theta, weights) for name in models}

    def smooth(self, values: Array, errors: Array) -> Curve:
        """Smooth one curve; values and errors are (B,)."""
        fits = {name: fitter.fit(values, None) for name, fitter in self._fitters.items()}
        name = min(fits, key=lambda model: fits[model].rms)
        sigma, gain = fits[name].sigma, fits[name].gain
        rest = values - gain * MODELS[name](self._theta, sigma)
        width = float(np.clip(sigma, LEAST_WIDTH, MOST_WIDTH))
        base = partial(MODELS[name], sigma=sigma)
        found = penalised_spline(self._theta, rest, np.maximum(errors, LEAST_ERROR), width, base)
        return Curve(name, sigma, gain, found.chi_squared, found.freedom, found.evaluate)


@dataclass(frozen=True)
class PenalisedSpline:
    """A smoothing spline, and how well it agrees with the data."""

    chi_squared: float
    """Per degree of freedom."""
    freedom: float
    """Degrees of freedom that the spline takes."""
    evaluate: Callable[[Array], Array]
    """Angles, radians, to values."""


def penalised_spline(
    theta: Array, values: Array, errors: Array, width: float, free: Callable[[Array], Array]
) -> PenalisedSpline:
    """Find the stiffest spline that agrees with the values within their errors.

    Args:
        theta: (B,) angles, radians.
        values: (B,) values to smooth.
        errors: (B,) their standard errors.
        width: Width of the dense knots around the terminator, radians.
        free: A function of the angle; it, and it times sin theta, are not penalised.
    """
    from scipy.interpolate import BSpline  # late: scipy takes 0.2 s to load

    low, high = _stretch(np.array([0.0, math.pi]), width)
    step = (high - low) / INTERVALS
    knots = low + step * np.arange(-3, INTERVALS + 4)

    def design(angles: Array) -> Array:
        place = np.clip(_stretch(angles, width), knots[3], knots[-4])
        spline = BSpline.design_matrix(place, knots, 3).toarray()
        model = free(angles)
        return np.column_stack((spline, model, model * np.sin(angles)))

    basis = design(theta)
    count = basis.shape[1]
    bend = np.zeros((count - 4, count))
    bend[:, :-2] = np.diff(np.eye(count - 2), 2, axis=0)
    normal = basis.T @ (basis / errors[:, None] ** 2)
    right = basis.T @ (values / errors**2)
    # More unknowns than data do no harm: the penalty determines what the data leave open.
    scale = float(np.trace(normal)) / count
    found = []
    for stiffness in STIFFNESSES:
        system = normal + stiffness * scale * bend.T @ bend
        system += RIDGE * scale * np.eye(count)
        freedom = float(np.trace(np.linalg.solve(system, normal)))
        coefficients = np.linalg.solve(system, right)
        left = (((basis @ coefficients - values) / errors) ** 2).sum()
        found.append((float(left / max(len(values) - freedom, 1.0)), freedom, coefficients))
    least = min(chi_squared for chi_squared, *_ in found)
    target = max(noise_factor(values, errors), SLACK * least)
    best = next(entry for entry in reversed(found) if entry[0] <= target)
    kept = best[2]
    return PenalisedSpline(best[0], best[1], lambda angles: design(angles) @ kept)


def noise_factor(values: Array, errors: Array) -> float:
    """Estimate the squared ratio of the noise to the stated errors, at least 1.

    The pixels of one bin are seen at different angles, so they differ a little more than by the
    noise of the paths. The estimate is the median of the second differences, which the few bins
    where the curve itself bends do not move.

    Args:
        values: (B,) values at ascending or descending angles.
        errors: (B,) their stated standard errors.
    """
    second = values[:-2] - 2.0 * values[1:-1] + values[2:]
    expected = np.sqrt(errors[:-2] ** 2 + 4.0 * errors[1:-1] ** 2 + errors[2:] ** 2)
    return max(1.0, float(np.median(np.abs(second / expected)) / NORMAL_MEDIAN) ** 2)


def smooth_rows(place: Array, rows: Array, noise: Array) -> Array:
    """Smooth across rows by local cubics (Savitzky and Golay 1964), as far as their noise allows.

    A cubic is fitted to seven rows, three octaves, and evaluated at the middle one; near the ends
    to the last seven. Four rows or fewer stay as they are.

    Args:
        place: (S,) logarithm of each row's scale.
        rows: (S, C, N) curves.
        noise: (S, C) standard error of each curve, RMS: no curve is moved by more than that.

    Returns:
        (S, C, N) smoothed curves.
    """
    window = min(ROWS_AT_ONCE, len(place))
    degree = min(ROW_DEGREE, window - 1)
    smooth = np.empty_like(rows)
    for row, here in enumerate(place):
        first = min(max(row - window // 2, 0), len(place) - window)
        some = slice(first, first + window)
        basis = np.vander(place[some] - here, degree + 1)
        smooth[row] = np.tensordot(np.linalg.pinv(basis)[-1], rows[some], axes=1)
    moved = np.sqrt(((smooth - rows) ** 2).mean(axis=-1))
    part = np.minimum(1.0, noise / np.maximum(moved, LEAST_MOVE))
    return np.asarray(rows + part[..., None] * (smooth - rows))
