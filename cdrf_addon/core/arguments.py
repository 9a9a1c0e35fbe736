# SPDX-License-Identifier: GPL-3.0-or-later
"""What every model of reflectance takes: an angle and a blur width, checked and folded."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from .errors import ParameterError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


def angle_and_width(
    theta: ArrayLike, sigma: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64], tuple[int, ...]]:
    """Broadcast theta and sigma, fold theta into [0, pi].

    Args:
        theta: Angle between normal and light, radians, any shape, any finite value.
        sigma: Blur width, radians, broadcast against theta, in [0, inf].

    Returns:
        Both as flat arrays, (n,), and the broadcast shape.

    Raises:
        ParameterError: theta is not finite, or sigma is negative or not a number.
    """
    angle, width = np.broadcast_arrays(
        np.asarray(theta, dtype=np.float64), np.asarray(sigma, dtype=np.float64)
    )
    if not np.isfinite(angle).all():
        raise ParameterError("The angle between normal and light must be a finite number.")
    if np.isnan(width).any() or (width < 0.0).any():
        raise ParameterError("The blur width sigma must be zero or positive, not negative or NaN.")
    shape = angle.shape
    angle = np.abs(angle.ravel())
    # Folding rounds, so angles that need none are left to the last bit.
    far = angle > math.pi
    angle[far] = np.abs(np.remainder(angle[far] + math.pi, 2.0 * math.pi) - math.pi)
    return angle, width.ravel(), shape
