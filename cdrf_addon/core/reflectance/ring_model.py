# SPDX-License-Identifier: GPL-3.0-or-later
"""The ring model: the curvature-dependent reflectance of Kubo, Dobashi and Morishima (2011).

f(theta, sigma) = (E * g_sigma)(theta): the 2 pi-periodic E(theta) = max(cos theta, 0), convolved
over the whole real line with a Gaussian of standard deviation sigma (paper, Eqs. 3 and 4).

Two exact forms share the range of sigma, so that neither is used where it converges slowly:

* sigma <  SERIES_FROM: the lobes of E, one per period, each convolved in closed form
  (a complex error function). For theta in [0, pi] only the lobes centred on 0 and 2 pi count;
  the next one, centred on -2 pi, is at least 3 pi / 2 = 18 sigma away: below 1e-78.
* sigma >= SERIES_FROM: the Fourier series of E, each term damped by the Gaussian's transform.
  The remainder after SERIES_TERMS terms is below 1e-29 (`series_remainder`).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ..arguments import evaluate_forms

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

SERIES_FROM = 0.25
SERIES_TERMS = 22
# From here on erf(x - i y), y <= SERIES_FROM / sqrt(2), differs from 1 by less than 5e-20.
_ERF_IS_ONE = 6.5


def series_remainder(sigma: float, terms: int = SERIES_TERMS) -> float:
    """Bound on the Fourier series' remainder after `terms` terms at standard deviation `sigma`.

    The terms fall at least as fast as a geometric series of ratio exp(-2 (2 terms + 3) sigma^2).
    """
    first = terms + 1
    if first * sigma > 30.0:
        return 0.0  # exp(-1800) underflows
    leading = 2.0 / math.pi / (4.0 * first**2 - 1.0) * math.exp(-2.0 * (first * sigma) ** 2)
    fall = -math.expm1(-2.0 * (2 * first + 1) * sigma**2)
    return leading / fall if fall > 0.0 else math.inf


def ring_reflectance(theta: ArrayLike, sigma: ArrayLike) -> NDArray[np.float64]:
    """Evaluate f(theta, sigma), accurate to 1e-12 absolute for every sigma in [0, inf].

    Args:
        theta: Angle between normal and light, radians, any shape; any finite value (f is even and
            2 pi-periodic in it).
        sigma: Standard deviation sigma0 * kappa, radians, broadcast against theta. 0 gives Lambert
            exactly, infinity gives 1/pi.

    Returns:
        The reflectance in [0, 1], of the broadcast shape.

    Raises:
        ParameterError: theta is not finite, or sigma is negative or not a number.
    """
    return evaluate_forms(theta, sigma, SERIES_FROM, _lobes, _series)


def _lobes(theta: NDArray[np.float64], sigma: NDArray[np.float64]) -> NDArray[np.float64]:
    return _lobe(theta, sigma) + _lobe(theta - 2.0 * math.pi, sigma)


def _lobe(theta: NDArray[np.float64], sigma: NDArray[np.float64]) -> NDArray[np.float64]:
    """Convolve one lobe, cos on [-pi/2, pi/2], with the Gaussian; theta is the distance to it."""
    from scipy.special import erf  # late: scipy takes 0.2 s to load

    def end(position: float) -> NDArray[np.complex128]:
        with np.errstate(over="ignore"):
            along = (position - theta) / (math.sqrt(2.0) * sigma)
        value = np.sign(along).astype(np.complex128)
        near = np.abs(along) < _ERF_IS_ONE
        value[near] = erf(along[near] - 1j * sigma[near] / math.sqrt(2.0))
        return value

    lobe = (
        0.5 * np.exp(-0.5 * sigma**2) * np.exp(1j * theta) * (end(math.pi / 2) - end(-math.pi / 2))
    )
    real: NDArray[np.float64] = lobe.real
    return real


def _series(theta: NDArray[np.float64], sigma: NDArray[np.float64]) -> NDArray[np.float64]:
    # exp(-sigma^2 ...) of an infinite sigma is a clean 0, but its square must not warn on the way.
    with np.errstate(over="ignore", under="ignore"):
        variance = sigma**2
        total = np.asarray(1.0 / math.pi + 0.5 * np.exp(-0.5 * variance) * np.cos(theta))
        term = np.empty_like(total)
        for k in range(1, SERIES_TERMS + 1):
            weight = 2.0 / math.pi * (-1.0) ** (k + 1) / (4.0 * k**2 - 1.0)
            damped = weight * np.exp(-2.0 * k**2 * variance)
            total += np.multiply(damped, np.cos(2.0 * k * theta), out=term)
    return total
