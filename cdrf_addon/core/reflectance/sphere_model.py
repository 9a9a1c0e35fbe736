# SPDX-License-Identifier: GPL-3.0-or-later
"""The sphere model: light diffuses over a sphere as heat does; no energy is gained or lost.

f(theta, sigma) = exp(sigma^2 / 2 Laplacian) max(cos theta, 0) on the unit sphere. Where the paper's
f is a Gaussian blur along a circle, and so exact on a cylinder lit across its axis, this is the
blur along the sphere: its mean over the sphere is 1/4 for every sigma, as that of max(cos, 0).

Two forms share the range of sigma:

* sigma >= SERIES_FROM: the Legendre series of max(cos, 0), each term damped by
  exp(-l (l + 1) sigma^2 / 2). The remainder after SERIES_DEGREE is below 1e-15.
* sigma <  SERIES_FROM: the series would need thousands of terms. The Laplacian of max(cos, 0) is
  -2 max(cos, 0) plus a line source along the equator, so that with t = sigma^2 / 2

      f = exp(-2 t) (max(cos, 0) + integral over s from 0 to t of exp(2 s) D(s) ds),

  where D(s) is the heat of that line after s. At the latitude x its equation is, for
  v = D sqrt(cos x), v' = v'' + (1/2 + tan^2(x) / 4) v; with x^2 for tan^2 it is a harmonic
  oscillator and v is Mehler's kernel (Mehler 1866). Its powers of s are integrated in closed form.
  What is left out (x^4 / 6) is below 3e-10 at SERIES_FROM and falls as sigma^7.
"""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from ..arguments import evaluate_forms

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

SERIES_FROM = 0.1
SERIES_DEGREE = 82
# cos(latitude) is only divided by where the line's heat has gone to nothing long before.
LEAST_COSINE = 1e-3


def sphere_reflectance(theta: ArrayLike, sigma: ArrayLike) -> NDArray[np.float64]:
    """Evaluate f(theta, sigma), accurate to 1e-9 absolute for every sigma in [0, inf].

    Args:
        theta: Angle between normal and light, radians, any shape; any finite value (f is even and
            2 pi-periodic in it).
        sigma: Standard deviation sigma0 * kappa, radians, broadcast against theta. 0 gives Lambert
            exactly, infinity gives 1/4.

    Returns:
        The reflectance in [0, 1], of the broadcast shape.

    Raises:
        ParameterError: theta is not finite, or sigma is negative or not a number.
    """
    return evaluate_forms(theta, sigma, SERIES_FROM, _near_lambert, _series)


@cache
def lambert_coefficients(degree: int) -> NDArray[np.float64]:
    """Legendre coefficients of max(cos, 0), (degree + 1,): 1/4, 1/2, 5/16, 0, -3/32, ..."""
    coefficients = np.zeros(degree + 1)
    coefficients[:2] = 0.25, 0.5
    for l in range(2, degree + 1, 2):  # noqa: E741  (the name of the literature)
        central = math.comb(l, l // 2) / 2.0**l
        sign = -1.0 if l % 4 == 0 else 1.0
        coefficients[l] = sign * (2 * l + 1) * central / (2.0 * (l - 1) * (l + 2))
    return coefficients


def _series(theta: NDArray[np.float64], sigma: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sum the series; theta and sigma are broadcast in the sum alone."""
    x = np.cos(theta)
    before, legendre = np.ones_like(x), x
    coefficients = lambert_coefficients(SERIES_DEGREE)
    with np.errstate(over="ignore", under="ignore"):
        time = 0.5 * sigma**2
        total = np.asarray(coefficients[0] + coefficients[1] * np.exp(-2.0 * time) * x)
        term = np.empty_like(total)
        for l in range(2, SERIES_DEGREE + 1):  # noqa: E741  (the name of the literature)
            # Bonnet's recurrence; of the odd terms only the first is not zero.
            before, legendre = legendre, ((2 * l - 1) * x * legendre - (l - 1) * before) / l
            if l % 2 == 0:
                damped = coefficients[l] * np.exp(-l * (l + 1.0) * time)
                total += np.multiply(damped, legendre, out=term)
    return total


def _near_lambert(theta: NDArray[np.float64], sigma: NDArray[np.float64]) -> NDArray[np.float64]:
    from scipy.special import erfc  # late: scipy takes 0.2 s to load

    latitude = math.pi / 2.0 - theta
    width = sigma / math.sqrt(2.0)  # sqrt(t)
    with np.errstate(over="ignore", under="ignore"):
        time = width**2
        z = np.abs(latitude) / (2.0 * width)
        bell = np.exp(-(z**2))
        # exp(2 s) v(s) = exp(b s) (1 + s^2 / 12 + ...) exp(-x^2 / 4 s) / sqrt(4 pi s)
        b = 2.5 + latitude**2 / 12.0
        powers = (1.0, b, b**2 / 2.0 + 1.0 / 12.0, b**3 / 6.0 + b / 12.0)
        # J_n is the integral of s^(n - 1/2) exp(-x^2 / 4 s) from 0 to t, J_0 in closed form.
        integral = 2.0 * width * bell - math.sqrt(math.pi) * np.abs(latitude) * erfc(z)
        heat = integral.copy()
        for n, factor in enumerate(powers[1:], start=1):
            integral = (width ** (2 * n + 1) * bell - latitude**2 / 4.0 * integral) / (n + 0.5)
            heat += factor * integral
    heat /= np.sqrt(4.0 * math.pi * np.maximum(np.cos(latitude), LEAST_COSINE))
    return np.asarray(np.exp(-2.0 * time) * (np.maximum(np.cos(theta), 0.0) + heat))
