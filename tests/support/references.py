# SPDX-License-Identifier: GPL-3.0-or-later
"""Float64 references of ring and sphere that share nothing with the code under test.

From DENSE_FROM on, the plain series with as many terms as it takes, thousands where sigma is small.
Below, the blur of a straight edge: there the surface is flat at the scale of the blur, and what is
left out is below LIMIT_ERROR sigma^2 (tests/core/test_sphere_model.py measures it).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

Values = NDArray[np.float64]

SIGMAS = (0.0, 1e-12, 1e-6, 1e-3, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 1e3, 1e12, math.inf)
"""The list of issue 3."""
ANGLES = np.linspace(0.0, math.pi, 1_001)
DENSE_FROM = 5e-4
# The Gaussian factor of the first term left out is exp(-9^2 / 2) = 3e-18.
REACH = 9.0
LIMIT_ERROR = 1.0


def reference_error(sigma: float) -> float:
    """Bound on the error of the references below: rounding, or the flat limit's."""
    return LIMIT_ERROR * sigma**2 if 0.0 < sigma < DENSE_FROM else 1e-13


def sphere_reference(theta: Values, sigma: float) -> Values:
    """Diffusion of max(cos, 0) over the sphere."""
    if sigma < DENSE_FROM:
        return flat_limit(theta, sigma)
    if sigma > REACH:
        return np.full_like(theta, 0.25)
    x = np.cos(theta)
    total = 0.25 + 0.5 * math.exp(-(sigma**2)) * x
    before, legendre = np.ones_like(x), x
    central = 1.0
    for l in range(2, math.ceil(REACH / sigma) + 3):  # noqa: E741
        before, legendre = legendre, ((2 * l - 1) * x * legendre - (l - 1) * before) / l
        if l % 2 == 0:
            central *= (1 - l) / l  # (-1)^(l/2) times the binomial of l over l/2, over 2^l
            weight = -central * (2 * l + 1) / (2.0 * (l - 1) * (l + 2))
            total = total + weight * math.exp(-0.5 * l * (l + 1) * sigma**2) * legendre
    return total


def ring_reference(theta: Values, sigma: float) -> Values:
    """Convolution of max(cos, 0) with a Gaussian along the circle."""
    if sigma < DENSE_FROM:
        return flat_limit(theta, sigma)
    if sigma > REACH:
        return np.full_like(theta, 1.0 / math.pi)
    total = 1.0 / math.pi + 0.5 * math.exp(-0.5 * sigma**2) * np.cos(theta)
    for n in range(2, math.ceil(REACH / sigma) + 3, 2):
        weight = -2.0 * math.cos(n * math.pi / 2.0) / (math.pi * (n * n - 1.0))
        total = total + weight * math.exp(-0.5 * (n * sigma) ** 2) * np.cos(n * theta)
    return total


def flat_limit(theta: Values, sigma: float) -> Values:
    """Both, where the blur is too narrow to see the curvature."""
    if sigma == 0.0:
        return np.maximum(np.cos(theta), 0.0)
    z = (math.pi / 2.0 - theta) / sigma
    return np.cos(theta) * ndtr(z) + sigma * np.exp(-0.5 * z**2) / math.sqrt(2.0 * math.pi)
