# SPDX-License-Identifier: GPL-3.0-or-later
"""Chandrasekhar's H for isotropic scattering, and the light a half-space gives back.

H(mu) = 1 + mu H(mu) omega / 2 integral of H(x) / (mu + x) over x from 0 to 1 (Chandrasekhar,
Radiative Transfer, 1950, section 38). Its logarithm is a plain integral (Stibbs and Weir 1959);
with mu tan(latitude) = tan(phi) the kernel goes away:

    ln H(mu) = -1 / pi integral of ln(1 - omega atan(t) / t) over phi from 0 to pi / 2,
    t = tan(phi) / mu.

What is left is a logarithm at phi = 0 where omega = 1, and a layer of width mu there: both are
smooth in ln(phi), which is how the nodes of the double exponential rule lie (Takahasi and Mori
1974). The error is below 1e-12 for mu >= 1e-6 and below 1e-10 everywhere.
"""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

# Half the number of nodes, and how far they reach in the rule's own variable: the outermost lie
# 1e-30 from the ends.
_NODES, _REACH = 80, 3.8
# Below it 1 - atan(t) / t is the series of five terms, accurate to 1e-17 there.
_SERIES_BELOW = 0.02


def chandrasekhar_h(mu: ArrayLike, omega: ArrayLike) -> NDArray[np.float64]:
    """Evaluate H(mu; omega), accurate to 1e-10.

    Args:
        mu: Cosine to the normal, in [0, 1], any shape.
        omega: Albedo of a single scattering, in [0, 1], broadcast against mu.

    Returns:
        H, at least 1 and at most 2.9078 (mu = omega = 1).
    """
    cosine, albedo = np.broadcast_arrays(
        np.clip(np.asarray(mu, dtype=np.float64), 0.0, 1.0),
        np.clip(np.asarray(omega, dtype=np.float64), 0.0, 1.0),
    )
    tangent, weight = _rule()
    total = np.zeros(cosine.shape)
    least = np.maximum(cosine, 1e-290)
    # Node by node: the arguments are many, the nodes few, and so nothing large is held.
    for own, part in zip(tangent, weight, strict=True):
        with np.errstate(over="ignore"):
            t = np.minimum(own / least, 1e300)
        total += part * np.log((1.0 - albedo) + albedo * _one_minus_atan(t))
    value = np.exp(-total / math.pi)
    return np.where(cosine > 0.0, value, 1.0)


def escape(mu: ArrayLike, omega: ArrayLike) -> NDArray[np.float64]:
    """Share of the light entered at cosine mu that a half-space scatters out again, any way.

    1 - sqrt(1 - omega) H(mu), the hemispherical reflectance (Chandrasekhar, section 38): by
    reciprocity also what is seen along mu under a uniform sky.
    """
    albedo = np.clip(np.asarray(omega, dtype=np.float64), 0.0, 1.0)
    return np.asarray(1.0 - np.sqrt(1.0 - albedo) * chandrasekhar_h(mu, albedo))


def cut_off(mu: ArrayLike, omega: ArrayLike, bounces: float) -> NDArray[np.float64]:
    """Share of the light that would get out after `bounces` scatterings or more.

    A walk that is ended there loses it. `escape` is the generating function of the number of
    scatterings; its root at omega = 1 makes their probability H(mu; 1) / (2 sqrt(pi) n^1.5), and
    the sum of omega^n times that, over n, is an error function. The next term is 1 / n of it.

    Args:
        mu: Cosine to the normal, in [0, 1].
        omega: Albedo of a single scattering, in [0, 1].
        bounces: Scatterings at which the walk ends, at least 10; infinity loses nothing.
    """
    from scipy.special import erfcx  # late: scipy takes 0.2 s to load

    albedo = np.clip(np.asarray(omega, dtype=np.float64), 1e-300, 1.0)
    if not math.isfinite(bounces):
        return np.zeros(np.broadcast_shapes(np.shape(mu), albedo.shape))
    n = bounces - 0.5  # the sum over n >= bounces, as an integral
    decay = -np.log(albedo)
    root = np.sqrt(n * decay)
    tail = np.exp(-n * decay) * (1.0 / math.sqrt(math.pi * n) - np.sqrt(decay) * erfcx(root))
    return np.asarray(np.maximum(tail, 0.0) * chandrasekhar_h(mu, 1.0))


def _one_minus_atan(t: NDArray[np.float64]) -> NDArray[np.float64]:
    square = np.minimum(t, _SERIES_BELOW) ** 2
    series = square * (
        1.0 / 3.0 - square * (1.0 / 5.0 - square * (1.0 / 7.0 - square * (1.0 / 9.0 - square / 11)))
    )
    far = np.maximum(t, _SERIES_BELOW)
    return np.where(t < _SERIES_BELOW, series, 1.0 - np.arctan(far) / far)


@cache
def _rule() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """tan(phi) at the nodes, and their weights, of the double exponential rule on [0, pi / 2]."""
    u = np.linspace(-_REACH, _REACH, 2 * _NODES + 1)
    step = u[1] - u[0]
    inner = 0.5 * math.pi * np.sinh(u)
    # Distances to both ends, each without cancellation: phi = pi / 2 / (1 + exp(-2 inner)).
    phi = 0.5 * math.pi / (1.0 + np.exp(-2.0 * inner))
    rest = 0.5 * math.pi / (1.0 + np.exp(2.0 * inner))
    tangent = np.where(u < 0.0, np.tan(phi), 1.0 / np.tan(rest))
    weight = step * math.pi * np.cosh(u) * phi * rest / (0.5 * math.pi)
    return tangent, weight
