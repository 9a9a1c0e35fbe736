# SPDX-License-Identifier: GPL-3.0-or-later
"""How Cycles' random walk enters a surface, on the camera's side.

The view is refracted at a micro-normal of the visible GGX normals, without Fresnel and without
masking (Blender, intern/cycles/kernel/integrator/subsurface.h). The visible normals are those of a
cap of the sphere, moved by the view and stretched (Dupuy and Benyoub 2023): two plain integrals, so
Gauss and a midpoint rule do for what Cycles samples.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

# Cycles clamps its index to this (closure/bssrdf.h).
LEAST_IOR, MOST_IOR = 1.01, 3.8
# Heights of the cap, and angles over half of it (the other half is its mirror image).
_HEIGHTS, _ANGLES = 40, 40
# At mu = 0 a smooth surface has no visible normal; nor has any a pixel there.
_LEAST_MU = 1e-6


@dataclass(frozen=True)
class Entry:
    """Directions in which light enters (traced backwards, from the camera), for some views."""

    mu: NDArray[np.float64]
    """Cosine of the view to the normal, (v,)."""
    depth: NDArray[np.float64]
    """Cosine of the entered direction to the inward normal, (v, d); negative ones are lost."""
    along: NDArray[np.float64]
    """Its component along the surface, away from the viewer, (v, d)."""
    weight: NDArray[np.float64]
    """Part of each direction, (v, d); each row adds up to 1 less what is lost."""

    def mean(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mean of values (v, d) over the directions, (v,)."""
        return np.asarray((values * self.weight).sum(axis=1))


def entry(mu: NDArray[np.float64], alpha: float, ior: float) -> Entry:
    """Directions of entry for views of cosines `mu` (v,), GGX's `alpha` and the index `ior`."""
    return _entry(tuple(float(m) for m in np.ravel(mu)), float(alpha), float(ior))


@lru_cache(maxsize=64)
def _entry(views: tuple[float, ...], alpha: float, ior: float) -> Entry:
    alpha = min(max(alpha, 0.0), 1.0)
    inverse = 1.0 / min(max(ior, LEAST_IOR), MOST_IOR)
    mu = np.clip(np.array(views), _LEAST_MU, 1.0)[:, None]
    sine = np.sqrt(1.0 - mu**2)
    nodes, parts = np.polynomial.legendre.leggauss(_HEIGHTS)
    angle = np.repeat(np.pi * (np.arange(_ANGLES) + 0.5) / _ANGLES, _HEIGHTS)[None, :]
    share = np.tile((nodes + 1.0) / 2.0, _ANGLES)[None, :]
    weight = np.tile(parts / (2.0 * _ANGLES), _ANGLES)[None, :]
    # The view, stretched so that the surface becomes one of hemispheres.
    length = np.hypot(alpha * sine, mu)
    x, z = alpha * sine / length, mu / length
    height = (1.0 - share) * (1.0 + z) - z
    around = np.sqrt(np.maximum(1.0 - height**2, 0.0))
    normal = np.stack(
        np.broadcast_arrays(
            alpha * (around * np.cos(angle) + x), alpha * around * np.sin(angle), height + z
        )
    )
    normal /= np.maximum(np.sqrt((normal**2).sum(axis=0)), 1e-300)
    cosine = normal[0] * sine + normal[2] * mu
    bend = inverse * cosine - np.sqrt(1.0 - inverse**2 * (1.0 - cosine**2))
    depth = inverse * mu - bend * normal[2]
    along = inverse * sine - bend * normal[0]
    kept = np.where(depth > 0.0, np.broadcast_to(weight, depth.shape), 0.0)
    return Entry(mu[:, 0], depth, along, kept)
