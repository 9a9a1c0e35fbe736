# SPDX-License-Identifier: GPL-3.0-or-later
"""The reflectance as it was measured on path-traced spheres: the paper's Fig. 2 made the table.

Between the rows the smoothed curves are interpolated by cubics in the logarithm of the scale.
Below the first row the curve stays, and only from a 16th of it down it turns into Lambert, which is
exact at 0: Cycles itself has that step (a vanishing scatter radius scatters still, and Blender's
albedo then is up to 7 % off; at radius 0 it is Lambert). Beyond the last row nothing changes.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from .arguments import checked
from .errors import MeasurementError
from .material_fit import sigma_per_scale as fitted_sigma_per_scale
from .measurement import SphereMeasurement, equator_weights
from .smoothing import Curve, Smoother

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

# Angles of the table, closer together at the terminator; linear in between, below 2e-5 off.
NODES = 401
CROWDING = 1.5
# Part of the first row's scale below which the curve turns into Lambert.
LAMBERT_BELOW = 1.0 / 16.0


def _angles() -> Array:
    place = np.linspace(-1.0, 1.0, NODES)
    return np.asarray(math.pi / 2.0 * (1.0 + np.sign(place) * np.abs(place) ** CROWDING))


class MeasuredModel:
    """f(theta, sigma) per channel, from one measurement and the channels' scatter radii.

    Args:
        measurement: Spheres whose rows serve every channel.
        radius: (3,) scatter radii of red, green and blue, any unit; only their ratio counts. A
            channel of radius 0 is Lambert.
        sigma_per_scale: c in sigma = c * scale, where scale belongs to the channel of the largest
            radius; None takes the sphere model's, so that sigma0 means the same in every model.

    Attributes:
        ratio: (3,) radii, the largest 1.
        sigma_per_scale: As above.
        curves: curves[row][channel], smoothed.

    Raises:
        MeasurementError: The radii are not zero or positive numbers, or all zero.
    """

    def __init__(
        self,
        measurement: SphereMeasurement,
        radius: ArrayLike = (1.0, 1.0, 1.0),
        sigma_per_scale: float | None = None,
    ) -> None:
        radii = np.asarray(radius, dtype=np.float64)
        if radii.shape != (3,) or not np.isfinite(radii).all() or (radii < 0.0).any():
            raise MeasurementError("The scatter radii must be three numbers, zero or positive.")
        if radii.max() <= 0.0:
            raise MeasurementError("All scatter radii are 0: nothing scatters; use Lambert.")
        self.measurement = measurement
        self.ratio = radii / radii.max()
        if sigma_per_scale is None:
            sigma_per_scale = fitted_sigma_per_scale(measurement, int(radii.argmax()))
        if not 0.0 < sigma_per_scale < math.inf:
            raise MeasurementError("The sigma per scale must be a positive number.")
        self.sigma_per_scale = float(sigma_per_scale)
        theta = measurement.theta
        smoother = Smoother(theta, equator_weights(theta))
        self.curves: list[list[Curve]] = [
            [smoother.smooth(*pair) for pair in zip(values, errors, strict=True)]
            for values, errors in zip(measurement.values, measurement.errors, strict=True)
        ]
        self._theta = _angles()
        self._lambert = np.maximum(np.cos(self._theta), 0.0)
        rows = [[curve(self._theta) for curve in row] for row in self.curves]
        self._rows = np.array(rows) - self._lambert  # (S, 3, NODES)
        self._log_scale = np.log(measurement.scales)
        self._slopes = np.gradient(self._rows, self._log_scale, axis=0)

    def energy(self) -> Array:
        """Mean over the sphere relative to Lambert's, of the smoothed rows, (S, 3)."""
        rows = self._rows + self._lambert
        # numpy 1.26, which Blender 4.5 has, knows no trapezoid.
        heights = rows * np.sin(self._theta)
        return np.asarray((heights[..., 1:] + heights[..., :-1]) @ np.diff(self._theta))

    def chi_squared(self) -> Array:
        """Per degree of freedom, of each smoothed curve, (S, 3)."""
        return np.array([[curve.chi_squared for curve in row] for row in self.curves])

    def evaluate(self, theta: ArrayLike, sigma: ArrayLike) -> Array:
        """Evaluate the table.

        Args:
            theta: Angle between normal and light, radians, any shape; any finite value.
            sigma: Width sigma0 * kappa of the channel of the largest radius, in [0, inf],
                broadcast against theta. 0 gives Lambert exactly.

        Returns:
            Radiance / (albedo * irradiance / pi), zero or positive, of the broadcast shape and a
            last axis of 3 channels; above 1 where a small body collects light from all sides.

        Raises:
            ParameterError: theta is not finite, or sigma is negative or not a number.
        """
        angle, width = np.broadcast_arrays(*checked(theta, sigma))
        shape, angle, width = angle.shape, angle.ravel(), width.ravel()
        result = np.empty((len(angle), 3))
        for channel in range(3):
            factor = self.ratio[channel] / self.sigma_per_scale
            # Infinity times a radius of 0 is no number.
            scale = width * factor if factor > 0.0 else np.zeros_like(width)
            result[:, channel] = self._channel(angle, scale, channel)
        return result.reshape(*shape, 3)

    def _channel(self, theta: Array, scale: Array, channel: int) -> Array:
        scales = self.measurement.scales
        log = np.log(np.clip(scale, scales[0], scales[-1]))
        row = np.clip(np.searchsorted(self._log_scale, log, side="right") - 1, 0, len(scales) - 2)
        step = self._log_scale[row + 1] - self._log_scale[row]
        t = (log - self._log_scale[row]) / step
        hermite = (
            (self._rows, row, (1.0 + 2.0 * t) * (1.0 - t) ** 2),
            (self._rows, row + 1, t**2 * (3.0 - 2.0 * t)),
            (self._slopes, row, step * t * (1.0 - t) ** 2),
            (self._slopes, row + 1, step * t**2 * (t - 1.0)),
        )
        right = np.clip(np.searchsorted(self._theta, theta), 1, NODES - 1)
        along = (theta - self._theta[right - 1]) / (self._theta[right] - self._theta[right - 1])
        beyond_lambert = np.zeros_like(theta)
        for table, place, weight in hermite:
            left = table[place, channel, right - 1] * (1.0 - along)
            beyond_lambert += weight * (left + table[place, channel, right] * along)
        beyond_lambert *= np.minimum(scale / (LAMBERT_BELOW * scales[0]), 1.0)
        return np.maximum(np.maximum(np.cos(theta), 0.0) + beyond_lambert, 0.0)
