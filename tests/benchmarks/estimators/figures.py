# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws error against time, and time against vertices, as SVG."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from cdrf_addon.core.curvature.estimators import METHODS

from .cases import Config, Family, name_of
from .formats import count_of, noise_of
from .results import Results
from .summary import Point, Summary, exponent, pareto, scaling_series

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8B5A2B")
MARKERS = {None: "D", 2: "o", 3: "^", 5: "s"}
STYLE: Any = {
    # Text as text, and the same names in every run: small files and small differences.
    "svg.fonttype": "none",
    "svg.hashsalt": "cdrf",
    "font.size": 9,
    "axes.grid": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.5,
    "xtick.minor.size": 0,
    "ytick.minor.size": 0,
}


def figure_name(key: str) -> str:
    """File of a figure."""
    return f"images/estimators-{key}.svg"


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure without a date, so that equal numbers make equal files."""
    with mpl.rc_context(STYLE):
        figure.savefig(path, format="svg", metadata={"Date": None})


def colour_of(method: str) -> str:
    """One colour for a method in all figures."""
    return COLOURS[[*METHODS, method].index(method) % len(COLOURS)]


def draw_family(summary: Summary, family: Family, path: Path) -> bool:
    """Error against time, a panel for each noise, a line through the sizes of each estimator."""
    with mpl.rc_context(STYLE):
        panels = len(summary.noises)
        figure = Figure(figsize=(3.2 * panels + 2.2, 3.6), layout="constrained")
        axes = figure.subplots(1, panels, sharey=True, squeeze=False)[0]
        drawn: dict[Config, Any] = {}
        for axis, noise in zip(axes, summary.noises, strict=True):
            lines: dict[Config, list[Point]] = {}
            for size in summary.sizes:
                points = summary.points(family, size, noise)
                for point in points:
                    lines.setdefault(point.config, []).append(point)
                front = pareto(points)
                axis.plot(
                    [p.seconds for p in front],
                    [100.0 * p.error for p in front],
                    color="#999999",
                    linewidth=3.0,
                    zorder=1,
                )
            for config, points in lines.items():
                (drawn[config],) = axis.plot(
                    [p.seconds for p in points],
                    [100.0 * p.error for p in points],
                    color=colour_of(config[0]),
                    marker=MARKERS.get(config[1], "x"),
                    markersize=4,
                    linewidth=0.8,
                )
            axis.set(xscale="log", yscale="log", title=noise_of(noise), xlabel="CPU seconds")
        if not drawn:
            return False
        axes[0].set_ylabel("RMS error of κ, %")
        sizes = ", ".join(count_of(size) for size in summary.sizes)
        figure.legend(
            drawn.values(),
            [name_of(config) for config in drawn],
            loc="outside right center",
            title=f"{sizes} vertices;\ngrey: Pareto fronts",
            fontsize=8,
            title_fontsize=8,
        )
    save_figure(figure, path)
    return True


def draw_scaling(results: Results, path: Path) -> bool:
    """Seconds against vertices on logarithmic axes, with n log n through the last point."""
    named = scaling_series(results)
    if not named:
        return False
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 4.2), layout="constrained")
        axis = figure.subplots()
        for name, runs in named.items():
            sizes = np.array([run.vertices for run in runs], dtype=np.float64)
            seconds = [run.seconds for run in runs]
            colour = colour_of(runs[0].method)
            label = f"{name}: n^{exponent(sizes, seconds)[0]:.2f}" if len(runs) > 1 else name
            axis.plot(sizes, seconds, "o-", color=colour, markersize=3, linewidth=1, label=label)
            guide = sizes * np.log(sizes)
            axis.plot(sizes, seconds[-1] * guide / guide[-1], ":", color=colour, linewidth=0.8)
        axis.plot([], [], ":", color="black", linewidth=0.8, label="n log n")
        axis.set(xscale="log", yscale="log", xlabel="vertices", ylabel="CPU seconds")
        figure.legend(loc="outside right center", fontsize=8)
    save_figure(figure, path)
    return True
