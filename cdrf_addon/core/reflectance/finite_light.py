# SPDX-License-Identifier: GPL-3.0-or-later
"""The irradiance of a light of finite size, as a Gaussian blur of the cosine lobe.

A sphere of half-angle w, seen from a point, has the irradiance pi L sin^2(w) cos(theta) while it is
wholly above the horizon, and a soft terminator of width w where the horizon cuts it. Blurring the
lobe with a Gaussian of variance s^2 gives the terminator, and multiplies the lobe by exp(-s^2 / 2),
along a sphere by exp(-s^2), which the gain undoes. The two blurs, of the light and of the material,
then add as variances, so that one look-up serves both.

s^2 / sin^2(w) is a fit to the exact sphere (numerical integration): worst error of the irradiance,
in units of its peak, 0.1 % to w = 6 deg, 0.3 % to 17 deg, 0.7 % to 29 deg, 1.5 % to 46 deg.
EEVEE treats every light as such a sphere with the same form factor; so does this.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

# s^2 = x (C0 + C1 x + C2 x^2), x = sin^2(half-angle)
VARIANCE_COEFFICIENTS = (0.2614, 0.1, 0.25)
# Part of the variance in the gain's exponent: half of it along a ring (the first harmonic of a
# circle), all of it along a sphere (l (l + 1) / 2 of its first).
RING_GAIN, SPHERE_GAIN = 0.5, 1.0


def finite_light(
    sin2_half_angle: ArrayLike, gain: float = RING_GAIN
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the blur and the gain that replace a spherical light by a distant point.

    Args:
        sin2_half_angle: Squared sine of the half-angle under which the light is seen, 0 to 1.
        gain: Part of the variance in the gain's exponent, by what the model blurs along.

    Returns:
        The variance in rad^2 and the factor on the irradiance, both of the argument's shape.
    """
    x = np.asarray(sin2_half_angle, dtype=np.float64)
    c0, c1, c2 = VARIANCE_COEFFICIENTS
    variance = x * (c0 + x * (c1 + x * c2))
    return variance, np.exp(variance * gain)
