# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's Section 4 for a whole measurement: sigma0 per channel, and the error of each model.

Every sphere is fitted with the gain fixed at 1 and with the gain free. On a curved body, scattering
makes the lit side brighter as well as blurred, and a fit with the gain fixed results in sigma = 0
on large spheres; so sigma0, the slope of sigma against kappa, is taken from the fits with a free
gain. It is in units of the scatter radius (radius * scale of Blender's node).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..errors import MeasurementError
from .fitting import MODELS, Fit, ModelFitter
from .measurement import SphereMeasurement, equator_weights, solid_angle_weights

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

EQUATOR, SOLID_ANGLE = "equator", "solid angle"
WEIGHTINGS = {EQUATOR: equator_weights, SOLID_ANGLE: solid_angle_weights}
CHANNELS = ("red", "green", "blue")
# Widths, radians, of the spheres whose slope is sigma0: above the noise, below saturation.
PROPORTIONAL_FROM, PROPORTIONAL_TO = 0.03, 0.2
# sigma counts as proportional while it is within this part of sigma0 * kappa.
PROPORTIONAL_WITHIN = 0.1


@dataclass(frozen=True)
class ChannelFit:
    """All fits of one channel; lists run over the spheres.

    Attributes:
        albedo: Albedo of the channel.
        fixed: Fits with gain 1, by model.
        free: Fits with a free gain, by model.
        lambert: RMS error of Lambert.
        noise: RMS of the Monte-Carlo error.
        sigma0: By model, in units of the scatter radius.
        proportional_to: By model, the scale beyond which sigma is more than a tenth off sigma0 *
            kappa; infinity if it nowhere is.
    """

    albedo: float
    fixed: dict[str, list[Fit]]
    free: dict[str, list[Fit]]
    lambert: list[float]
    noise: list[float]
    sigma0: dict[str, float]
    proportional_to: dict[str, float]


@dataclass(frozen=True)
class MaterialFit:
    """The fits of a measurement's three channels."""

    scales: Array
    """(S,) scatter radius * kappa of each sphere, ascending."""
    weighting: str
    """EQUATOR or SOLID_ANGLE."""
    channels: tuple[ChannelFit, ChannelFit, ChannelFit]

    def sentences(self) -> list[str]:
        """Describe the results, a sentence for each channel and model."""
        lines = []
        for name, channel in zip(CHANNELS, self.channels, strict=True):
            for model in MODELS:
                end = channel.proportional_to[model]
                where = (
                    "at every size that was measured"
                    if np.isinf(end)
                    else f"on spheres of more than {1.0 / end:.3g} scatter radii"
                )
                lines.append(
                    f"{name.capitalize()} (albedo {channel.albedo:.3g}), {model}: σ0 is "
                    f"{channel.sigma0[model]:.3g} × the scatter radius; σ = σ0 κ holds to "
                    f"{PROPORTIONAL_WITHIN:.0%} {where}."
                )
        return lines


def sigma0_at(
    fit: MaterialFit, model: str, radius: Sequence[float], kappa: float
) -> tuple[float, float, float]:
    """Return sigma0 of each channel for which sigma0 * kappa is the fitted sigma at one curvature.

    On strongly curved forms sigma stops growing, so the right value there is below the slope.

    Args:
        fit: The fits.
        model: A key of MODELS.
        radius: Scatter radius of each channel, any unit of length.
        kappa: Curvature for which sigma is to be right, 1/unit; 0 takes the slope.

    Returns:
        sigma0 of red, green and blue, in the unit of the radii.
    """
    found = []
    for channel, own in zip(fit.channels, radius, strict=True):
        slope, scale = channel.sigma0[model] * own, own * kappa
        if scale > fit.scales[0]:
            sigmas = [one.sigma for one in channel.free[model]]
            at = float(np.interp(math.log(scale), np.log(fit.scales), sigmas))
            slope = min(slope, at / kappa)
        found.append(slope)
    red, green, blue = found
    return red, green, blue


def proportional(scales: Array, sigma: Array) -> tuple[float, float]:
    """Find the slope of sigma against scale where it is small, and the scale at which that ends.

    Args:
        scales: (S,) scatter radius * kappa of the spheres, ascending.
        sigma: (S,) fitted widths, radians.

    Raises:
        MeasurementError: Fewer than two spheres are in the range.
    """
    used = (sigma >= PROPORTIONAL_FROM) & (sigma <= PROPORTIONAL_TO)
    if used.sum() < 2:
        raise MeasurementError(
            "Too few spheres scatter as little as the fit needs: too much of the measurement is "
            "noise. Measure again at a finer quality."
        )
    # The median, which one noisy sphere does not move.
    slope = float(np.median(sigma[used] / scales[used]))
    # The last that is still proportional: before it, noise may put one off; beyond, all saturate.
    held = np.flatnonzero(np.abs(sigma / (slope * scales) - 1.0) <= PROPORTIONAL_WITHIN)
    last = int(held[-1]) if len(held) else int(np.flatnonzero(used)[0])
    return slope, np.inf if last == len(scales) - 1 else float(scales[last])


def sigma_per_scale(measurement: SphereMeasurement, channel: int) -> float:
    """Find the slope of the sphere model's sigma against the scale, for one channel, 0 to 2.

    Raises:
        MeasurementError: The measurement has too few spheres that scatter little.
    """
    fitter = ModelFitter("sphere", measurement.theta, equator_weights(measurement.theta))
    sigma = [fitter.fit(values, None).sigma for values in measurement.values[:, channel]]
    return proportional(measurement.scales, np.array(sigma))[0]


def fit_material(measurement: SphereMeasurement, weighting: str = EQUATOR) -> MaterialFit:
    """Fit the ring and the sphere model to every sphere and channel.

    Args:
        measurement: The spheres.
        weighting: EQUATOR, uniform in theta as in the paper, or SOLID_ANGLE.

    Raises:
        MeasurementError: The measurement has too few spheres that scatter little.
    """
    theta = measurement.theta
    weights = WEIGHTINGS[weighting](theta)
    fitters = {name: ModelFitter(name, theta, weights) for name in MODELS}
    lambert = np.maximum(measurement.cosine, 0.0)

    def fit_channel(channel: int) -> ChannelFit:
        values, errors = measurement.values[:, channel], measurement.errors[:, channel]
        fixed = {name: [fitter.fit(row) for row in values] for name, fitter in fitters.items()}
        free = {name: [fitter.fit(row, None) for row in values] for name, fitter in fitters.items()}
        slopes = {
            name: proportional(measurement.scales, np.array([fit.sigma for fit in fits]))
            for name, fits in free.items()
        }
        return ChannelFit(
            float(measurement.albedo[channel]),
            fixed,
            free,
            np.sqrt(((values - lambert) ** 2 * weights).sum(axis=-1)).tolist(),
            np.sqrt((errors**2 * weights).sum(axis=-1)).tolist(),
            {name: slope for name, (slope, _) in slopes.items()},
            {name: end for name, (_, end) in slopes.items()},
        )

    red, green, blue = (fit_channel(channel) for channel in range(3))
    return MaterialFit(measurement.scales, weighting, (red, green, blue))
