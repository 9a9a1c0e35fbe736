# SPDX-License-Identifier: GPL-3.0-or-later
"""Plots: error against time of a frame and of preparation, cost against size."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from ...common.timing import spread
from ..contenders import (
    CONTENDERS,
    EEVEE,
    SPHERE,
    TEXTURE,
    contender_of,
)
from ..matrix import measured_cells
from ..settings import Settings
from ..timing import frame_seconds
from .drawing import COLOURS, figure


@dataclass(frozen=True)
class Point:
    """A contender at some samples in the plot of error against time."""

    name: str
    engine: str
    family: str
    samples: int
    seconds: float
    error: float


def points(cell: Mapping[str, Any], timing: dict[str, Any], mask: str) -> Iterator[Point]:
    """What was both measured in a cell and timed."""
    for name, row in cell["contenders"].items():
        one = contender_of(name)
        if "missing" in row or one is None:
            continue
        seconds = frame_seconds(timing, one.name, row["samples"])
        if math.isfinite(seconds):
            yield Point(name, one.engine, one.family, row["samples"], seconds, row["rmse"][mask])


def at_equal_samples(found: Sequence[Point]) -> list[Point]:
    """EEVEE's frames with its usual samples: only its own node was rendered with others too."""
    usual = Settings.film
    own = [one for one in found if one.engine == EEVEE]
    return [one for one in own if one.samples == usual] or own


def front(found: Sequence[Point]) -> list[Point]:
    """Those that none is both quicker and closer than, by rising time."""
    best, kept = math.inf, []
    for one in sorted(found, key=lambda one: (one.seconds, one.error)):
        if one.error < best:
            best = one.error
            kept.append(one)
    return kept


def plotted(settings: Settings, most: int = 6) -> dict[str, list[Point]]:
    """Points of the cells that are in the plot of error against time: those of the timed lights."""
    timing = settings.read("timing")
    lights = str(timing.get("frames", {}).get("cell", "")).rpartition(", ")[2]
    cells = {
        name: list(points(cell, timing, "all"))
        for name, cell in measured_cells(settings).items()
        if name.endswith(f", {lights}")
    }
    return dict([(name, found) for name, found in cells.items() if found][:most])


def pareto(settings: Settings) -> None:
    """Error against time of a frame, log-log."""
    cells = plotted(settings)
    names = list(cells)
    if not names:
        return
    floors = measured_cells(settings)
    columns = min(3, len(names))
    rows = math.ceil(len(names) / columns)
    with figure(settings.pictures / "pareto.svg", 4.2 * columns, 3.4 * rows) as sheet:
        grid = np.atleast_1d(sheet.subplots(rows, columns, squeeze=False)).ravel()
        seen: dict[str, Any] = {}
        for axes, name in zip(grid, names, strict=False):
            _pareto_panel(axes, name, cells[name], floors[name]["floor"]["all"], seen)
        for axes in grid[len(names) :]:
            axes.set_axis_off()
        sheet.legend(seen.values(), seen.keys(), loc="outside lower center", ncols=5, fontsize=8)


def _pareto_panel(
    axes: Axes, name: str, found: Sequence[Point], floor: float, seen: dict[str, Any]
) -> None:
    for one in found:
        marker = "s" if one.family == "Texture blurring" else "o"
        dots = axes.scatter(
            one.seconds, one.error, s=22, color=COLOURS[one.family], marker=marker, zorder=3
        )
        seen.setdefault(one.family, dots)
    for label, some, style in (
        ("Pareto front", found, "-"),
        ("of EEVEE's frames", at_equal_samples(found), "--"),
    ):
        best = [(one.seconds, one.error) for one in front(some)]
        if not best:
            continue
        (line,) = axes.plot(
            *zip(*best, strict=True), style, color="#c03030", lw=1.0, drawstyle="steps-post"
        )
        seen.setdefault(label, line)
    line = axes.axhline(floor, color="#1a1a1e", lw=0.8, ls=":")
    seen.setdefault("noise of the reference", line)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_title(name, fontsize=9)
    axes.set_xlabel("seconds a frame")
    axes.set_ylabel("RMSE, all pixels")


def preparation_plot(settings: Settings) -> bool:
    """Error against what comes before the first frame; whether there was anything to draw."""
    cells = measured_cells(settings)
    spent = preparation_seconds(settings)
    name = next(iter(cells), None)
    if name is None or not spent:
        return False
    with figure(settings.pictures / "preparation.svg", 5.2, 3.6) as sheet:
        axes = sheet.subplots()
        for one in CONTENDERS:
            rows = cells[name]["contenders"]
            row = rows.get(one.name) or rows.get(f"{one.name}, {settings.film}")
            if row is None or "missing" in row or one.name not in spent:
                continue
            axes.scatter(
                max(spent[one.name], 1e-3), row["rmse"]["all"], s=26, color=COLOURS[one.family]
            )
            axes.annotate(
                one.name,
                (max(spent[one.name], 1e-3), row["rmse"]["all"]),
                fontsize=6,
                xytext=(4, 2),
                textcoords="offset points",
            )
        axes.set_xscale("log")
        axes.set_xlabel("seconds before the first frame (1 ms: nothing to do)")
        axes.set_ylabel("RMSE, all pixels")
        axes.set_title(name, fontsize=9)
    return True


def preparation_seconds(settings: Settings) -> dict[str, float]:
    """Median preparation time of each contender; empty if it was not timed."""
    rows = settings.read("timing").get("preparation", {}).get("rows", {})

    def middle(name: str, point: str) -> float:
        return spread([one["wall"] for one in rows.get(name, {}).get(point, [])] or [math.nan])[0]

    if SPHERE not in rows:
        return {}
    setup = middle(SPHERE, "setup")
    found = {one.name: 0.0 for one in CONTENDERS if not one.name.startswith("CDRF")}
    found.pop(TEXTURE, None)
    for one in CONTENDERS:
        if one.family == "CDRF measured":
            found[one.name] = setup + middle("CDRF measured", "measure")
        elif one.name.startswith("CDRF"):
            found[one.name] = setup
    return {name: value for name, value in found.items() if math.isfinite(value)}


def scaling_plot(settings: Settings) -> bool:
    """Draw time against pixels, lights and vertices; whether there was anything to draw."""
    timing = settings.read("timing")
    parts = [
        (name, label)
        for name, label in (
            ("pixels", "pixels"),
            ("lights", "suns"),
            ("vertices", "vertices"),
        )
        if timing.get(name, {}).get("rows")
    ]
    if not parts:
        return False
    family = {one.name: one.family for one in CONTENDERS}
    with figure(settings.pictures / "scaling.svg", 4.0 * len(parts), 3.3) as sheet:
        for axes, (part, label) in zip(
            sheet.subplots(1, len(parts), squeeze=False)[0], parts, strict=True
        ):
            for name, rows in timing[part]["rows"].items():
                sizes = sorted(int(size) for size in rows if size.isdigit())
                counts = [size**2 if part == "pixels" else size for size in sizes]
                middle = [spread(one["wall"] for one in rows[str(size)]) for size in sizes]
                values, low, high = np.array(middle).T
                colour = COLOURS.get(family.get(name, ""), "#c03030")
                axes.errorbar(
                    counts,
                    values,
                    (values - low, high - values),
                    color=colour,
                    lw=1.2,
                    marker="o",
                    ms=3.5,
                    capsize=2,
                    label=name,
                )
            axes.set_xscale("log", base=2 if part != "vertices" else 10)
            axes.set_yscale("log")
            axes.set_xlabel(label)
            axes.set_ylabel("seconds a draw, no shadows")
            axes.legend(fontsize=6)
    return True
