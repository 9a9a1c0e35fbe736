# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of the two kernels over theta and the root of sigma."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from cdrf_addon.core.reflectance.ring_model import ring_reflectance

from ..common.arrays import Array

# Kernels are tabulated over theta and sqrt(sigma).
THETA_NODES, SIGMA_NODES, SIGMA_MOST, DEGREES = 2049, 384, 8.0, 1600


def sigma_nodes() -> Array:
    """Widths at which the kernels are tabulated."""
    return SIGMA_MOST * np.linspace(0.0, 1.0, SIGMA_NODES) ** 2


def ring_table() -> Array:
    """The paper's reflectance: blur along a circle."""
    theta = np.linspace(0.0, math.pi, THETA_NODES)
    return ring_reflectance(theta[:, None], sigma_nodes()[None, :])


def sphere_table() -> Array:
    """Blur by the heat kernel of the sphere, as a Legendre series; keeps the energy."""
    theta, sigma = np.linspace(0.0, math.pi, THETA_NODES), sigma_nodes()
    cosine = np.cos(theta)

    def damping(degree: int) -> Array:
        return np.exp(-0.5 * degree * (degree + 1) * sigma**2)

    total = 0.25 + 0.5 * cosine[:, None] * damping(1)[None, :]
    before, now = np.ones_like(cosine), cosine
    moment = 0.125  # integral of x P_2 over [0, 1]
    for degree in range(2, DEGREES):
        before, now = now, ((2 * degree - 1) * cosine * now - (degree - 1) * before) / degree
        if degree % 2:
            continue
        damped = damping(degree)
        seen = int((damped > 1e-9).sum())
        total[:, :seen] += (degree + 0.5) * moment * now[:, None] * damped[None, :seen]
        moment *= -(degree - 1) / (degree + 4)
    total[:, 0] = np.maximum(cosine, 0.0)
    return np.asarray(total)


KERNELS: dict[str, Callable[[], Array]] = {"ring": ring_table, "sphere": sphere_table}
