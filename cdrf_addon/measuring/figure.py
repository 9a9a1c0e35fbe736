# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's Fig. 2 (b, c) drawn again: path-traced data, fitted models, residuals, sigma."""

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
LEGEND = 0.35
"""Where the legend starts, as a part of the width: to the right of the curves."""
DEGREES = [(value, f"{value:g}°") for value in (0.0, 45.0, 90.0, 135.0, 180.0)]


@dataclass(frozen=True)
class Column:
    """One channel on one sphere."""

    name: str
    row: int
    channel: int
    fit: ChannelFit


def steps(low: float, high: float, count: int = 5) -> list[tuple[float, str]]:
    """Round marks between two values, about so many."""
    raw = (high - low) / count
    power = 10.0 ** math.floor(math.log10(raw))
    step = power * min((s for s in (1.0, 2.0, 5.0, 10.0) if s * power >= raw), default=10.0)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [(number * step, f"{number * step:.6g}") for number in range(first, last + 1)]


def decades(low: float, high: float) -> list[tuple[float, str]]:
    """Powers of ten between two values."""
    first, last = math.ceil(math.log10(low) - 1e-9), math.floor(math.log10(high) + 1e-9)
    return [(10.0**power, f"{10.0**power:g}") for power in range(first, last + 1)]


def draw_fit(model: MeasuredModel, fit: MaterialFit, path: Path, scale: float = 0.25) -> None:
    """Draw the fits of one sphere, a column per channel, and sigma of all spheres; write a PNG.

    Args:
        model: The measured model.
        fit: Fits to the same measurement.
        path: Where to.
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
        column = Column(name, row, channel, fit.channels[channel])
        _curves(picture, model, column, left, left + wide)
        _sigmas(picture, fit, column, left, left + wide)
    picture.save(path)


def _curves(
    picture: Picture, model: MeasuredModel, column: Column, left: float, right: float
) -> None:
    measurement = model.measurement
    values = measurement.values[column.row, column.channel]
    errors = measurement.errors[column.row, column.channel]
    theta = np.linspace(0.0, math.pi, 361)
    smooth = model.curves[column.row][column.channel]
    shown: list[tuple[str, Colour, str, Array, Array]] = []
    for name in MODELS:
        fixed, free = column.fit.fixed[name][column.row], column.fit.free[name][column.row]
        for one, dash in ((fixed, False), (free, True)):
            curve, there = (
                one.gain * MODELS[name](at, one.sigma) for at in (theta, measurement.theta)
            )
            shown.append((_label(name, one, free=dash), COLOURS[name], "-"[dash:], curve, there))
    weights = equator_weights(measurement.theta)
    rms = math.sqrt(float(((smooth(measurement.theta) - values) ** 2) @ weights))
    shown.append(
        (f"{rms:.4f}  measured table", COLOURS["measured"], "-", smooth(theta),
         smooth(measurement.theta))
    )  # fmt: skip
    lambert = f"{column.fit.lambert[column.row]:.4f}  Lambert"
    shown.insert(
        0,
        (lambert, COLOURS["Lambert"], "-", np.maximum(np.cos(theta), 0.0),
         np.maximum(measurement.cosine, 0.0)),
    )  # fmt: skip

    degrees, there = np.degrees(theta), np.degrees(measurement.theta)
    highest = max(float(curve.max()) for *_, curve, _ in shown)
    top = 1.25 * max(highest, 1.0)
    axes = Axes(picture, (left, CURVES[0], right, CURVES[1]), (0.0, 180.0), (-0.03, top), SIZE)
    axes.grid(DEGREES, steps(0.0, top), "", "radiance / (albedo · irradiance / π)")
    rest = max(float(np.abs(values - at).max()) for name, *_, at in shown if "Lambert" not in name)
    reach = max(1.15 * rest, 4.0 * float(errors.max()))
    below = Axes(
        picture, (left, RESIDUALS[0], right, RESIDUALS[1]), (0.0, 180.0), (-reach, reach), SIZE
    )
    below.grid(DEGREES, steps(-reach, reach, 6), "angle between normal and light, θ",
               "model - data")  # fmt: skip
    for _, colour, kind, curve, at in shown:
        axes.curve(degrees, curve, colour, 2.2, () if kind else DASH)
        below.curve(there, at - values, colour, 1.6, () if kind else DASH)
    axes.points(there, values, errors, DATA)
    below.points(there, np.zeros_like(there), errors, DATA, 1.6)
    scale = measurement.scales[column.row]
    head = f"{column.name.capitalize()}, albedo {column.fit.albedo:.3g}"
    picture.write(left - 2.6 * SIZE, CURVES[1] + 2.1 * SIZE,
                  f"{head}, sphere of {1.0 / scale:.3g} scatter radii", 1.1 * SIZE)  # fmt: skip
    start = left + LEGEND * (right - left)
    y = CURVES[1] - 1.6 * SIZE
    box = (start - 6.0, y - (1.45 * len(shown) + 0.6) * SIZE, right - 2.0, CURVES[1] - 2.0)
    picture.raster.rectangle(box, (1.0, 1.0, 1.0))
    picture.write(start + 42.0, y, "RMS", SIZE)
    y -= 1.45 * SIZE
    for text, colour, kind, _, _ in shown:
        picture.raster.line([(start, y + 5.0), (start + 34.0, y + 5.0)], colour, 2.4,
                            dash=() if kind else DASH)  # fmt: skip
        picture.write(start + 42.0, y, text, SIZE)
        y -= 1.45 * SIZE


def _label(name: str, fit: Fit, *, free: bool) -> str:
    gain = f", gain {fit.gain:.2f}" if free else ""
    return f"{fit.rms:.4f}  {name} σ {fit.sigma:.3f}{gain}"


def _sigmas(picture: Picture, fit: MaterialFit, column: Column, left: float, right: float) -> None:
    x = (float(fit.scales[0]) / 1.3, float(fit.scales[-1]) * 1.3)
    axes = Axes(
        picture, (left, SIGMAS[0], right, SIGMAS[1]), x, (0.004, 2.0), SIZE, logarithmic=True
    )
    axes.grid(decades(*x), decades(0.004, 2.0), "scatter radius · κ", "fitted σ, gain free")
    for name in MODELS:
        sigma = np.array([one.sigma for one in column.fit.free[name]])
        slope = column.fit.sigma0[name]
        axes.points(fit.scales, np.maximum(sigma, 1e-6), None, COLOURS[name], 3.2)
        axes.curve(np.array(x), slope * np.array(x), COLOURS[name], 1.6, FINE_DASH)
        y = SIGMAS[0] + (2.0 if name == "ring" else 0.7) * SIZE
        words = f"{name}: σ = {slope:.3g} · radius · κ"
        picture.write(right - 0.6 * SIZE, y, words, SIZE, 1.0, COLOURS[name])
