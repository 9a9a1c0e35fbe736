# SPDX-License-Identifier: GPL-3.0-or-later
"""From the radius of Blender's subsurface scattering to sigma0.

Both are lengths of the same light: a sphere path-traced by Cycles at a small radius looks like the
sphere model at sigma0 = c radius, with c a function of the albedo alone (docs/measured.md).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

RANDOM_WALK, BURLEY = "RANDOM_WALK", "BURLEY"
ALBEDOS = (0.1, 0.9)
SIGMA0_PER_RADIUS = (0.4, 1.49)


def sigma0_per_radius(albedo: ArrayLike, method: str = RANDOM_WALK) -> NDArray[np.float64]:
    """Factor from Blender's radius times scale to sigma0 of the sphere model, of albedo's shape."""
    return np.interp(np.asarray(albedo, dtype=np.float64), ALBEDOS, SIGMA0_PER_RADIUS)
