# SPDX-License-Identifier: GPL-3.0-or-later
"""What every model of reflectance takes: an angle and a blur width, checked and folded."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from .errors import ParameterError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


def checked(theta: ArrayLike, sigma: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Fold theta into [0, pi]; both keep their shapes, which are to be broadcast.

    Args:
        theta: Angle between normal and light, radians, any shape, any finite value.
        sigma: Blur width, radians, any shape, in [0, inf].

    Raises:
        ParameterError: theta is not finite, or sigma is negative or not a number.
    """
    angle = np.abs(np.asarray(theta, dtype=np.float64))
    width = np.asarray(sigma, dtype=np.float64)
    if not np.isfinite(angle).all():
        raise ParameterError("The angle between normal and light must be a finite number.")
    if np.isnan(width).any() or (width < 0.0).any():
        raise ParameterError("The blur width sigma must be zero or positive, not negative or NaN.")
    # Folding rounds, so angles that need none are left to the last bit.
    folded = np.abs(np.remainder(angle + math.pi, 2.0 * math.pi) - math.pi)
    return np.where(angle > math.pi, folded, angle), width


def angle_and_width(
    theta: ArrayLike, sigma: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64], tuple[int, ...]]:
    """Check and fold as `checked`, then broadcast.

    Returns:
        Both as flat arrays, (n,), and the broadcast shape.

    Raises:
        ParameterError: theta is not finite, or sigma is negative or not a number.
    """
    angle, width = np.broadcast_arrays(*checked(theta, sigma))
    return angle.ravel(), width.ravel(), angle.shape
