# SPDX-License-Identifier: GPL-3.0-or-later
"""The reflectance as it was measured on path-traced spheres: the paper's Fig. 2 made the table.

Neighbouring rows differ little, so each curve is smoothed once more across them, as far as its
Monte-Carlo error allows; that takes a third off its noise. Cubics in the logarithm of the scale
make eight rows an octave of them; each is made to fall with theta, as light does, and between them
the table is linear.
Below the first row the curve stays, and only from a 16th of it down it turns into Lambert, which is
exact at 0: Cycles itself has that step (a vanishing scatter radius scatters still, and Blender's
albedo then is up to 7 % off; at radius 0 it is Lambert). Beyond the last row nothing changes.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ..arguments import checked
from ..errors import MeasurementError
from ..reflectance.energy import conserving
from ..reflectance.model import MEASURED, Model, table_key
from .material_fit import sigma_per_scale as fitted_sigma_per_scale
from .measurement import SphereMeasurement, equator_weights
from .smoothing import Curve, Smoother, smooth_rows

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

# Angles of the table, closer together at the terminator; linear in between, below 2e-5 off.
NODES = 401
CROWDING = 1.5
# Part of the first row's scale below which the curve turns into Lambert.
LAMBERT_BELOW = 1.0 / 16.0
# Rows made of each measured one.
ROWS_BETWEEN = 4
# Part of the points' variance that is left in a curve smoothed along theta, about.
NOISE_LEFT = 0.25


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
        lambert = np.maximum(np.cos(self._theta), 0.0)
        curves = np.array([[curve(self._theta) for curve in row] for row in self.curves])
        place = np.log(measurement.scales)
        noise = np.sqrt((measurement.errors**2 @ equator_weights(theta)) * NOISE_LEFT)
        rows = lambert + smooth_rows(place, curves - lambert, noise)  # (S, 3, NODES)
        self._place, self._rows = _between(place, rows)

    def energy(self) -> Array:
        """Mean over the sphere relative to Lambert's, of the measured rows, (S, 3)."""
        # numpy 1.26, which Blender 4.5 has, knows no trapezoid.
        heights = self._rows[::ROWS_BETWEEN] * np.sin(self._theta)
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
        first, last = self.measurement.scales[[0, -1]]
        log = np.log(np.clip(scale, first, last))
        row = np.clip(np.searchsorted(self._place, log, side="right"), 1, len(self._place) - 1)
        up = (log - self._place[row - 1]) / (self._place[row] - self._place[row - 1])
        right = np.clip(np.searchsorted(self._theta, theta), 1, NODES - 1)
        along = (theta - self._theta[right - 1]) / (self._theta[right] - self._theta[right - 1])

        def at(rows: NDArray[np.int64]) -> Array:
            table = self._rows[:, channel]
            return np.asarray(table[rows, right - 1] * (1.0 - along) + table[rows, right] * along)

        value = at(row - 1) * (1.0 - up) + at(row) * up
        share = np.minimum(scale / (LAMBERT_BELOW * first), 1.0)
        return np.asarray(np.maximum(np.cos(theta), 0.0) * (1.0 - share) + value * share)


def measured_model(
    spheres: SphereMeasurement, radius: tuple[float, float, float], *, keep_energy: bool
) -> tuple[Model, float]:
    """Return the model of what was measured, for channels of these scatter radii.

    Args:
        spheres: The measurement.
        radius: Scatter radii of red, green and blue, in any unit of length.
        keep_energy: Divide by what a sphere gains over Lambert (reflectance/energy.py): closer on
            bodies that are not spheres, and no longer exact on those that are.

    Returns:
        The model, and the sigma0 that belongs to it, in the unit of the radii.

    Raises:
        MeasurementError: The radii are not zero or positive numbers, or the measurement has too few
            spheres that scatter little.
    """
    slopes = [fitted_sigma_per_scale(spheres, channel) for channel in range(3)]
    widths = [own * slope for own, slope in zip(radius, slopes, strict=True)]
    sigma0 = max(widths)
    # Rows are counted by the widest blur, scales by the largest radius.
    table = MeasuredModel(spheres, radius, sigma0 / max(radius) if sigma0 > 0.0 else None)
    red, green, blue = (float(width / sigma0) ** 2 for width in widths)
    facts = [spheres.blender, spheres.method, spheres.seed, spheres.samples]
    facts += [spheres.all_views, keep_energy]
    numbers = [float(number) for number in (*spheres.albedo, *table.ratio)]
    key = table_key(MEASURED, str(facts), str(numbers))
    evaluate = conserving(table.evaluate) if keep_energy else table.evaluate
    return Model(MEASURED, key, evaluate, True, (red, green, blue)), sigma0


def _between(place: Array, rows: Array) -> tuple[Array, Array]:
    """Put rows between the rows by cubics in the scale's logarithm; make all fall with theta.

    Args:
        place: (S,) logarithms of the scales.
        rows: (S, 3, N) curves at ascending angles.

    Returns:
        (D,) and (D, 3, N), none below 0.
    """
    slopes = np.gradient(rows, place, axis=0)
    parts = [rows[:1]]
    for step, low in zip(np.diff(place), range(len(place) - 1), strict=True):
        for t in np.arange(1, ROWS_BETWEEN + 1) / ROWS_BETWEEN:
            value = rows[low] + (rows[low + 1] - rows[low]) * t**2 * (3.0 - 2.0 * t)
            slope = slopes[low] * t * (1.0 - t) ** 2 + slopes[low + 1] * t**2 * (t - 1.0)
            parts.append((value + step * slope)[None])
    dense = np.maximum(np.concatenate(parts), 0.0)
    # The nearest falling curve lies between these two, which noise alone keeps apart.
    over = np.maximum.accumulate(dense[..., ::-1], axis=-1)[..., ::-1]
    under = np.minimum.accumulate(dense, axis=-1)
    where = np.interp(np.arange((len(place) - 1) * ROWS_BETWEEN + 1) / ROWS_BETWEEN,
                      np.arange(len(place)), place)  # fmt: skip
    return where, (over + under) / 2.0
