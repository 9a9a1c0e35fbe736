# SPDX-License-Identifier: GPL-3.0-or-later
"""From the radius of Blender's subsurface scattering to sigma0 of the sphere model.

A random walk's reach over its radius is a function of the albedo: light that is seldom absorbed
travels further. The numbers are the best fits to a path-traced head (docs/results/model_choice.md),
between those of its smaller and its larger radii. Other methods interpret the radius differently:

* the random walk of Blender 4.5, later called legacy, takes radius * 0.25 / pi as its mean free
  path where the present one takes the radius itself;
* the skin variant takes radius * sqrt(3 (1 - alpha')), alpha' the albedo of a single scattering for
  which a dipole of that refractive index has the surface's albedo (Jensen et al. 2001);
* Christensen and Burley's profile has the variance 7 d^2 along one axis, with d = radius * 0.25 /
  (pi s(albedo)), s = 1.9 - a + 3.5 (a - 0.8)^2 (Christensen and Burley 2015).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from .dipole import mismatch

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

RANDOM_WALK, LEGACY = "RANDOM_WALK", "RANDOM_WALK_LEGACY"
SKIN, BURLEY = "RANDOM_WALK_SKIN", "BURLEY"
ALBEDOS = (0.0, 0.2, 0.5, 0.75, 0.9, 0.99, 1.0)
SIGMA0_PER_RADIUS = (0.3, 0.45, 0.93, 1.5, 1.95, 2.6, 2.7)
# Mean free path over radius in the legacy random walk, and d over radius in Burley's profile.
OLD_FREE_PATH = 0.25 / math.pi
# Refractive index that Blender's nodes have by default.
ETA = 1.4


def sigma0_per_radius(albedo: ArrayLike, method: str = RANDOM_WALK) -> NDArray[np.float64]:
    """Return the factor from Blender's radius times scale to sigma0.

    Args:
        albedo: Albedo of the surface, clamped to [0, 1], any shape.
        method: Blender's name of the subsurface method; one that is not known counts as a random
            walk.

    Returns:
        The factor, of albedo's shape.
    """
    a = np.clip(np.asarray(albedo, dtype=np.float64), 0.0, 1.0)
    if method == BURLEY:
        return np.asarray(math.sqrt(7.0) * OLD_FREE_PATH / (1.9 - a + 3.5 * (a - 0.8) ** 2))
    walk = np.interp(a, ALBEDOS, SIGMA0_PER_RADIUS)
    if method == LEGACY:
        return np.asarray(walk * OLD_FREE_PATH)
    return np.asarray(walk * _skin_free_path(a)) if method == SKIN else walk


def _skin_free_path(albedo: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return sqrt(3 (1 - alpha')) of the dipole with this diffuse reflectance, by bisection."""
    depth = 4.0 / 3.0 * mismatch(ETA)
    low, high = np.zeros_like(albedo), np.ones_like(albedo)
    for _ in range(50):
        middle = (low + high) / 2.0
        s = np.sqrt(3.0 * (1.0 - middle))
        less = middle / 2.0 * (1.0 + np.exp(-depth * s)) * np.exp(-s) < albedo
        low, high = np.where(less, middle, low), np.where(less, high, middle)
    # With an albedo of 1 no light would be lost; Blender, too, ends at 0.999999.
    return np.asarray(np.sqrt(3.0 * (1.0 - np.minimum(low, 0.999999))))
