# SPDX-License-Identifier: GPL-3.0-or-later
"""How far two pictures are apart: RMSE in linear radiance, SSIM as they are looked at."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter

from cdrf_addon.core.colour_scale import srgb

from ..common.arrays import Array, Mask

# Wang, Bovik, Sheikh and Simoncelli 2004: 11 x 11 Gaussian window, constants for a range of 1.
WINDOW, REACH = 1.5, 5
STEADY = (0.01**2, 0.03**2)


def rmse(one: Array, other: Array, mask: Mask) -> float:
    """Root mean square difference over the pixels of a mask, mean of red, green and blue."""
    off = (one[..., :3] - other[..., :3])[mask]
    return float(np.sqrt((off**2).mean(axis=0)).mean())


def displayed(picture: Array) -> Array:
    """Linear radiance as a screen shows it, [0, 1]."""
    return srgb(np.clip(picture[..., :3], 0.0, 1.0))


def ssim(one: Array, other: Array, mask: Mask) -> float:
    """Mean structural similarity over the pixels of a mask; 1 is the same.

    Args:
        one: Linear radiance, (height, width, 3 or more).
        other: The same of another picture.
        mask: (height, width).
    """
    return float(ssim_map(displayed(one), displayed(other))[mask].mean())


def ssim_map(x: Array, y: Array) -> Array:
    """Structural similarity at each pixel and channel of pictures with a range of 1."""

    def mean(values: Array) -> Array:
        # No blur along the last axis, the channels.
        widths, reach = (WINDOW, WINDOW, 0.0), (REACH, REACH, 0)
        return np.asarray(gaussian_filter(values, widths, radius=reach))

    mean_x, mean_y = mean(x), mean(y)
    var_x, var_y = mean(x * x) - mean_x**2, mean(y * y) - mean_y**2
    both = mean(x * y) - mean_x * mean_y
    c1, c2 = STEADY
    likeness = (2.0 * mean_x * mean_y + c1) * (2.0 * both + c2)
    return np.asarray(likeness / ((mean_x**2 + mean_y**2 + c1) * (var_x + var_y + c2)))
