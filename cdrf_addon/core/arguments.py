# SPDX-License-Identifier: GPL-3.0-or-later
"""What every model of reflectance takes: an angle and a blur width, checked, folded, broadcast."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from .errors import ParameterError

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    Evaluate = Callable[[ArrayLike, ArrayLike], NDArray[np.float64]]
    """A model of reflectance: theta and sigma, radians, broadcast, to f(theta, sigma)."""
    Form = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]


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


def evaluate_forms(
    theta: ArrayLike, sigma: ArrayLike, series_from: float, narrow: Form, series: Form
) -> NDArray[np.float64]:
    """Evaluate a reflectance that has one form for small sigma and a series for the rest.

    Args:
        theta: As for `checked`.
        sigma: As for `checked`, broadcast against theta; 0 gives max(cos theta, 0) to the last bit.
        series_from: The sigma from which on the series is used.
        narrow: Called with flat arrays of the same length, 0 < sigma < series_from.
        series: Called with arrays that are only to be broadcast, so that a table costs little.

    Returns:
        The values clipped to [0, 1], as rounding may leave -1e-17 or 1 + 1e-16.

    Raises:
        ParameterError: theta is not finite, or sigma is negative or not a number.
    """
    angle, width = checked(theta, sigma)
    shape = np.broadcast_shapes(angle.shape, width.shape)
    result = np.array(np.broadcast_to(np.maximum(np.cos(angle), 0.0), shape))
    wide = width >= series_from
    if wide.any():
        np.copyto(result, series(angle, np.maximum(width, series_from)), where=wide)
    thin = np.broadcast_to((width > 0.0) & (width < series_from), shape)
    if thin.any():
        angle, width = np.broadcast_arrays(angle, width)
        result[thin] = narrow(angle[thin], width[thin])
    return np.clip(result, 0.0, 1.0, out=result)
