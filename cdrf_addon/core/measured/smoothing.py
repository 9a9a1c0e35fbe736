# SPDX-License-Identifier: GPL-3.0-or-later
"""Smooth a measured shading curve, but no further than its Monte-Carlo error allows.

The curve is split into the best closed-form model, which has the sharp terminator of a small
scatter distance, and a remainder. The remainder becomes a penalised spline (Eilers and Marx 1996),
as stiff as the discrepancy principle (Morozov 1966) lets it be: chi-squared per degree of freedom
reaches 1. Its knots are close together where the shading ends, about the width of the blur.

Of the closed-form model two multiples are free of the penalty: itself, and itself times sin theta.
Cycles' walk enters the surface half by refraction, so that low albedos look brighter at grazing
angles, and sin theta is, up to a factor, how squarely the pixels of one N.L are seen on average
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

# Rows that a cubic is fitted to; more lose detail, a higher degree keeps noise.
ROWS_AT_ONCE, ROW_DEGREE = 7, 3
LEAST_MOVE = 1e-12
INTERVALS = 32
STIFFNESSES = 10.0 ** np.arange(-4.0, 9.0, 0.25)
# The spline's knots are closest within this many radians of the terminator.
LEAST_WIDTH, MOST_WIDTH = 0.02, 0.5
# Chi-squared may be this much above the least that any stiffness reaches, if that is above 1.
SLACK = 1.1
RIDGE = 1e-10
# Median of the absolute value of a normal variable.
NORMAL_MEDIAN = 0.6745
# A bin no path reached is not exact.
LEAST_ERROR = 1e-4


@dataclass(frozen=True)
class Curve:
    """A smoothed shading curve.

    Attributes:
        model: Name of the closed-form part.
        sigma: Its width.
        gain: Its gain.
        chi_squared: Per degree of freedom, of the whole curve against the measured values.
        freedom: Degrees of freedom the spline took.
    """

    model: str
    sigma: float
    gain: float
    chi_squared: float
    freedom: float
    _spline: Callable[[Array], Array]

    def __call__(self, theta: Array) -> Array:
        """Evaluate at any angles in [0, pi]; never negative."""
        base = self.gain * MODELS[self.model](theta, self.sigma)
        return np.maximum(base + self._spline(theta), 0.0)


def _stretch(theta: Array, width: float) -> Array:
    """Coordinate in which the knots are uniform: half of them crowd around the terminator."""
    x = theta - math.pi / 2.0
    crowded = np.arcsinh(x / width) / math.asinh(math.pi / 2.0 / width)
    return np.asarray(crowded + x * (2.0 / math.pi))


class Smoother:
    """Smooths curves measured at the same angles.

    Args:
        theta: (B,) angles of the bins, radians.
        weights: (B,) for the fit of the closed-form part.
        models: Closed forms to choose from.
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
        return Curve(name, sigma, gain, *found)


def penalised_spline(
    theta: Array, values: Array, errors: Array, width: float, free: Callable[[Array], Array]
) -> tuple[float, float, Callable[[Array], Array]]:
    """Find the stiffest spline that agrees with the values within their errors.

    Args:
        theta: (B,) angles.
        values: (B,) to smooth.
        errors: (B,) their standard errors.
        width: Of the crowd of knots around the terminator, radians.
        free: A function of the angle; it, and it times sin theta, are not penalised.

    Returns:
        Chi-squared per degree of freedom, the degrees the spline took, and the spline.
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
    # One more unknown than data is no trouble: the penalty decides what the data leave open.
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
    return best[0], best[1], lambda angles: design(angles) @ kept


def noise_factor(values: Array, errors: Array) -> float:
    """Squared ratio of the noise to the stated errors, at least 1, from second differences.

    Pixels of one bin see it from different directions, which scatters them a little more than the
    paths do. The median is not moved by the few bins where the curve itself bends.
    """
    second = values[:-2] - 2.0 * values[1:-1] + values[2:]
    expected = np.sqrt(errors[:-2] ** 2 + 4.0 * errors[1:-1] ** 2 + errors[2:] ** 2)
    return max(1.0, float(np.median(np.abs(second / expected)) / NORMAL_MEDIAN) ** 2)


def smooth_rows(place: Array, rows: Array, noise: Array) -> Array:
    """Smooth across rows by local cubics (Savitzky and Golay 1964), no further than their noise.

    Seven rows, three octaves, are fitted by a cubic and its value at the row is taken; near the
    ends the last seven. Four rows or fewer come back as they are.

    Args:
        place: (S,) where the rows stand: the logarithm of their scale.
        rows: (S, C, N) curves.
        noise: (S, C) standard error of each curve, RMS: no curve is moved by more than that.
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
