# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's Fig. 2 (b, c) for a fit: path-traced data, fitted models, residuals, sigma."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..core.measured.fitting import MODELS, Fit
from ..core.measured.material_fit import CHANNELS, ChannelFit, MaterialFit
from ..core.measured.measurement import equator_weights
from ..core.measured.model import MeasuredModel
from .plot import INK, Axes, Picture
from .raster import Colour

Array = NDArray[np.float64]

WIDTH, HEIGHT = 1680, 1120
COLOURS: dict[str, Colour] = {
    "ring": (0.84, 0.37, 0.0),
    "sphere": (0.0, 0.55, 0.35),
    "measured": (0.0, 0.38, 0.78),
    "Lambert": (0.55, 0.55, 0.58),
}
DATA: Colour = INK
DASH, FINE_DASH = (9.0, 6.0), (3.0, 4.0)
SIZE, TITLE = 15.0, 22.0
# Left, right, between columns; bottom and top of curves, residuals and sigma.
MARGIN, END, GAP = 84.0, 30.0, 84.0
CURVES, RESIDUALS, SIGMAS = (545.0, 980.0), (360.0, 490.0), (84.0, 262.0)
SIGMA_RANGE = (0.004, 2.0)
LEGEND = 0.35
"""Where the legend starts, as a part of the width: right of the curves."""
THETA = np.linspace(0.0, math.pi, 361)
DEGREES = [(value, f"{value:g}°") for value in (0.0, 45.0, 90.0, 135.0, 180.0)]


@dataclass(frozen=True)
class Column:
    """One channel on one sphere, and where it is drawn.

    Attributes:
        name: The channel's.
        row: Of the sphere in the measurement.
        channel: 0, 1 or 2.
        fit: Fits to the channel.
        left: Left end of its axes, pixels.
        right: Right end.
    """

    name: str
    row: int
    channel: int
    fit: ChannelFit
    left: float
    right: float


@dataclass(frozen=True)
class Curve:
    """A model's radiance over the angle between normal and light.

    Attributes:
        label: In the legend.
        colour: Display values.
        values: At THETA.
        at_data: At the measurement's angles.
        dashed: Whether its gain is free.
        is_model: Whether it is more than Lambert, so that its residual should be seen whole.
    """

    label: str
    colour: Colour
    values: Array
    at_data: Array
    dashed: bool = False
    is_model: bool = True

    @property
    def dash(self) -> tuple[float, ...]:
        """Lengths drawn and left out, pixels."""
        return DASH if self.dashed else ()


def steps(low: float, high: float, count: int = 5) -> list[tuple[float, str]]:
    """Return about `count` round marks between two values, each with its text."""
    raw = (high - low) / count
    power = 10.0 ** math.floor(math.log10(raw))
    step = power * min((s for s in (1.0, 2.0, 5.0, 10.0) if s * power >= raw), default=10.0)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [(number * step, f"{number * step:.6g}") for number in range(first, last + 1)]


def decades(low: float, high: float) -> list[tuple[float, str]]:
    """Return the powers of ten between two values, each with its text."""
    first, last = math.ceil(math.log10(low) - 1e-9), math.floor(math.log10(high) + 1e-9)
    return [(10.0**power, f"{10.0**power:g}") for power in range(first, last + 1)]


def draw_fit(model: MeasuredModel, fit: MaterialFit, path: Path, scale: float = 0.25) -> None:
    """Draw the fits of one sphere, a column per channel, and sigma of all spheres; write a PNG.

    Args:
        model: The measured model.
        fit: Fits to the same measurement.
        path: The PNG.
        scale: Scatter radius of the channel that scatters farthest, in radii of the sphere; the
            nearest measured sphere is shown.

    Raises:
        OSError: The file cannot be written.
    """
    picture = Picture(WIDTH, HEIGHT)
    measurement = model.measurement
    title = "Path-traced spheres and the models fitted to them (Kubo et al. 2011, Fig. 2 b, c)"
    picture.write(MARGIN - 40.0, HEIGHT - 44.0, title, TITLE)
    facts = (
        f"Cycles {measurement.blender}, {measurement.method.replace('_', ' ').title()}, "
        f"{measurement.samples} paths a pixel, light across the view. Points: mean of the pixels "
        "of equal N·L, ±1 standard error. Solid: gain 1. Dashed: gain free."
    )
    picture.write(MARGIN - 40.0, HEIGHT - 72.0, facts, SIZE)
    wide = (WIDTH - MARGIN - END - 2.0 * GAP) / 3.0
    for channel, name in enumerate(CHANNELS):
        wanted = scale * max(float(model.ratio[channel]), 1e-9)
        row = int(np.abs(np.log(measurement.scales / wanted)).argmin())
        left = MARGIN + channel * (wide + GAP)
        column = Column(name, row, channel, fit.channels[channel], left, left + wide)
        _draw_curves(picture, model, column)
        _draw_sigmas(picture, fit, column)
    picture.save(path)


def _curves(model: MeasuredModel, column: Column) -> list[Curve]:
    """Return Lambert's curve, those fitted with gain 1 and with free gain, and the table's."""
    measurement = model.measurement
    at = measurement.theta
    curves = [
        Curve(
            f"{column.fit.lambert[column.row]:.4f}  Lambert",
            COLOURS["Lambert"],
            np.maximum(np.cos(THETA), 0.0),
            np.maximum(measurement.cosine, 0.0),
            is_model=False,
        )
    ]
    for name, reflectance in MODELS.items():
        fixed, free = column.fit.fixed[name][column.row], column.fit.free[name][column.row]
        for fit, is_free in ((fixed, False), (free, True)):
            values, at_data = (fit.gain * reflectance(theta, fit.sigma) for theta in (THETA, at))
            label = _label(name, fit, free=is_free)
            curves.append(Curve(label, COLOURS[name], values, at_data, dashed=is_free))
    smooth = model.curves[column.row][column.channel]
    residual = smooth(at) - measurement.values[column.row, column.channel]
    rms = math.sqrt(float((residual**2) @ equator_weights(at)))
    label = f"{rms:.4f}  measured table"
    curves.append(Curve(label, COLOURS["measured"], smooth(THETA), smooth(at)))
    return curves


def _draw_curves(picture: Picture, model: MeasuredModel, column: Column) -> None:
    """Draw the data and all curves, their residuals below, and the legend."""
    measurement = model.measurement
    data = measurement.values[column.row, column.channel]
    errors = measurement.errors[column.row, column.channel]
    curves = _curves(model, column)
    degrees, data_degrees = np.degrees(THETA), np.degrees(measurement.theta)

    top = 1.25 * max(*(float(curve.values.max()) for curve in curves), 1.0)
    box = (column.left, CURVES[0], column.right, CURVES[1])
    axes = Axes(picture, box, (0.0, 180.0), (-0.03, top), SIZE)
    axes.grid(DEGREES, steps(0.0, top), "", "radiance / (albedo · irradiance / π)")
    residuals = [float(np.abs(data - curve.at_data).max()) for curve in curves if curve.is_model]
    reach = max(1.15 * max(residuals), 4.0 * float(errors.max()))
    box = (column.left, RESIDUALS[0], column.right, RESIDUALS[1])
    below = Axes(picture, box, (0.0, 180.0), (-reach, reach), SIZE)
    marks = steps(-reach, reach, 6)
    below.grid(DEGREES, marks, "angle between normal and light, θ", "model - data")
    for curve in curves:
        axes.curve(degrees, curve.values, curve.colour, 2.2, curve.dash)
        below.curve(data_degrees, curve.at_data - data, curve.colour, 1.6, curve.dash)
    axes.points(data_degrees, data, errors, DATA)
    below.points(data_degrees, np.zeros_like(data), errors, DATA, 1.6)

    radii = 1.0 / measurement.scales[column.row]
    head = f"{column.name.capitalize()}, albedo {column.fit.albedo:.3g}"
    title = f"{head}, sphere of {radii:.3g} scatter radii"
    picture.write(column.left - 2.6 * SIZE, CURVES[1] + 2.1 * SIZE, title, 1.1 * SIZE)
    _draw_legend(picture, curves, column)


def _draw_legend(picture: Picture, curves: list[Curve], column: Column) -> None:
    start = column.left + LEGEND * (column.right - column.left)
    y = CURVES[1] - 1.6 * SIZE
    bottom = y - (1.45 * len(curves) + 0.6) * SIZE
    box = (start - 6.0, bottom, column.right - 2.0, CURVES[1] - 2.0)
    picture.raster.rectangle(box, (1.0, 1.0, 1.0))
    picture.write(start + 42.0, y, "RMS", SIZE)
    for curve in curves:
        y -= 1.45 * SIZE
        ends = [(start, y + 5.0), (start + 34.0, y + 5.0)]
        picture.raster.line(ends, curve.colour, 2.4, dash=curve.dash)
        picture.write(start + 42.0, y, curve.label, SIZE)


def _label(name: str, fit: Fit, *, free: bool) -> str:
    gain = f", gain {fit.gain:.2f}" if free else ""
    return f"{fit.rms:.4f}  {name} σ {fit.sigma:.3f}{gain}"


def _draw_sigmas(picture: Picture, fit: MaterialFit, column: Column) -> None:
    """Draw the fitted sigma of all spheres, and the line sigma = sigma0 * kappa."""
    x = (float(fit.scales[0]) / 1.3, float(fit.scales[-1]) * 1.3)
    box = (column.left, SIGMAS[0], column.right, SIGMAS[1])
    axes = Axes(picture, box, x, SIGMA_RANGE, SIZE, logarithmic=True)
    axes.grid(decades(*x), decades(*SIGMA_RANGE), "scatter radius · κ", "fitted σ, gain free")
    for name in MODELS:
        sigma = np.array([sphere.sigma for sphere in column.fit.free[name]])
        slope = column.fit.sigma0[name]
        axes.points(fit.scales, np.maximum(sigma, 1e-6), None, COLOURS[name], 3.2)
        axes.curve(np.array(x), slope * np.array(x), COLOURS[name], 1.6, FINE_DASH)
        y = SIGMAS[0] + (2.0 if name == "ring" else 0.7) * SIZE
        text = f"{name}: σ = {slope:.3g} · radius · κ"
        picture.write(column.right - 0.6 * SIZE, y, text, SIZE, 1.0, COLOURS[name])
