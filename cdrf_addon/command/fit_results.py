# SPDX-License-Identifier: GPL-3.0-or-later
"""What the fit found: as JSON, and as lines for the terminal."""

from __future__ import annotations

import math
from typing import Any

from ..core.measured.fitting import MODELS
from ..core.measured.material_fit import CHANNELS, WEIGHTINGS, MaterialFit
from ..core.measured.model import MeasuredModel
from .fit_options import FitOptions

FORMAT = 1


def as_json(
    options: FitOptions, model: MeasuredModel, fit: MaterialFit, seconds: float
) -> dict[str, Any]:
    """Return everything that was found; numbers that are not finite become null.

    Args:
        options: The command line.
        model: The measured model.
        fit: Fits to the same measurement.
        seconds: Time of measuring and fitting.
    """
    measurement = model.measurement
    return {
        "format": FORMAT,
        "blender": measurement.blender,
        "method": measurement.method,
        "samples": measurement.samples,
        "seed": measurement.seed,
        "weighting": fit.weighting,
        "seconds": round(seconds, 2),
        "sigma_per_scale": model.sigma_per_scale,
        "sentences": fit.sentences(),
        "channels": {
            name: _channel(model, fit, number, float(radius))
            for number, (name, radius) in enumerate(
                zip(CHANNELS, options.radius_metres, strict=True)
            )
        },
    }


def _channel(model: MeasuredModel, fit: MaterialFit, number: int, radius: float) -> dict[str, Any]:
    """Return what was found for one channel; the radius is in metres."""
    channel = fit.channels[number]
    return {
        "albedo": channel.albedo,
        "radius_metres": radius,
        "sigma0_per_radius": channel.sigma0,
        "sigma0_metres": {key: value * radius for key, value in channel.sigma0.items()},
        "proportional_to_scale": {
            key: end if math.isfinite(end) else None for key, end in channel.proportional_to.items()
        },
        "spheres": [
            {
                "scale": float(scale),
                "lambert_rms": channel.lambert[row],
                "noise_rms": channel.noise[row],
                "measured_chi_squared": model.curves[row][number].chi_squared,
                **{
                    name: {
                        "gain_fixed": vars(channel.fixed[name][row]),
                        "gain_free": vars(channel.free[name][row]),
                    }
                    for name in MODELS
                },
            }
            for row, scale in enumerate(fit.scales)
        ],
    }


def error_table(model: MeasuredModel, fit: MaterialFit) -> list[str]:
    """Return lines with the RMS of Lambert and every model, gain 1, on spheres of some sizes."""
    theta = model.measurement.theta
    weights = WEIGHTINGS[fit.weighting](theta)
    lines = [f"{'RMS, gain 1':>24}" + "".join(f"{n:>10}" for n in ("Lambert", *MODELS, "measured"))]
    for number, (name, channel) in enumerate(zip(CHANNELS, fit.channels, strict=True)):
        for row in range(2, len(fit.scales), 4):
            residual = model.curves[row][number](theta) - model.measurement.values[row, number]
            errors = [channel.lambert[row], *(channel.fixed[m][row].rms for m in MODELS)]
            errors.append(math.sqrt(float((residual**2) @ weights)))
            size = f"{name}, r = {1.0 / fit.scales[row]:.3g} radii"
            lines.append(f"{size:>24}" + "".join(f"{error:10.4f}" for error in errors))
    return lines


def sigma0_lines(options: FitOptions, fit: MaterialFit) -> list[str]:
    """Return a line for each model with sigma0 of each channel, millimetres."""
    millimetres = options.radius_metres * 1e3
    lines = []
    for name in MODELS:
        values = [
            channel.sigma0[name] * radius
            for channel, radius in zip(fit.channels, millimetres, strict=True)
        ]
        lines.append(f"σ0 for {name}: " + ", ".join(f"{value:.4g}" for value in values) + " mm")
    return lines
