# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures and plots of the report, from what the stages kept."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from cdrf_addon.core.reflectance.models import ring, sphere

from .contenders import (
    CONTENDERS,
    DEFAULT,
    EEVEE,
    LAMBERT,
    NODE,
    PATHS,
    PRINCIPLED,
    SHADOWS,
    TEXTURE,
    contender_of,
)
from .matrix import load_pictures, measured_cells, pictures_path, wanted_cells
from .metrics import displayed
from .paper import stored
from .scenes import FIRST
from .settings import Settings
from .timing import frame_seconds, spread

Array = NDArray[np.float64]

STYLE: dict[Any, Any] = {
    "svg.hashsalt": "cdrf",
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e4e4e8",
    "figure.dpi": 100,
}
COLOURS = {
    "Lambert": "#8c8c94",
    "CDRF ring": "#d65f00",
    "CDRF sphere": "#008c5a",
    "CDRF profile": "#c8408c",
    "CDRF measured": "#0061c7",
    "EEVEE scattering": "#7a4fbf",
    "Texture blurring": "#b08800",
    "Cycles": "#1a1a1e",
}
DIFFERENCE = 8.0
SHOWN = (
    LAMBERT,
    DEFAULT,
    SHADOWS,
    "CDRF measured",
    f"{NODE}, 16",
    PRINCIPLED,
    TEXTURE,
    f"{PATHS}, 16",
)
"""In the rows of pictures; those that were not measured are left out."""
NOSE, CHEEK = (0.42, 0.58, 0.38, 0.54), (0.54, 0.70, 0.36, 0.52)
"""Left, right, bottom and top of the close-ups, parts of the picture."""
COLOURS_IN_FILE = 256


@contextmanager
def figure(path: Path, width: float, height: float) -> Iterator[Figure]:
    """Draw on a figure, which is written without a date; PNGs with a palette."""
    with mpl.rc_context(STYLE):
        sheet = Figure(figsize=(width, height), layout="constrained")
        yield sheet
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix == ".svg":
            sheet.savefig(path, format="svg", metadata={"Date": None})
            return
        buffer = io.BytesIO()
        sheet.savefig(buffer, format="png", metadata={"Software": None})
        small = Image.open(buffer).convert("RGB").quantize(COLOURS_IN_FILE)
        small.save(path, optimize=True)


def picture(axes: Axes, values: NDArray[Any], title: str = "") -> None:
    """Show linear radiance as a screen does."""
    axes.imshow(displayed(values.astype(np.float64)), origin="lower", interpolation="nearest")
    plain(axes, title)


def plain(axes: Axes, title: str = "") -> None:
    """Take everything but the title off."""
    axes.set_axis_off()
    if title:
        axes.set_title(title, fontsize=8)


def brighter(pictures: Mapping[str, NDArray[Any]], key: str) -> float:
    """Factor that brings the brightest thousandth of a picture near white."""
    bright = float(np.percentile(pictures[key][..., :3].astype(np.float64).max(axis=-1), 99.9))
    return 0.9 / max(bright, 1e-6)


# --- the paper -----------------------------------------------------------------------------------


def paper_figures(settings: Settings) -> list[str]:
    """Fig. 1 to 4; names of the files."""
    drawn = []
    heads = stored(settings, "figure3")
    if heads:
        _workflow(settings, heads)
        _heads(settings, heads)
        drawn += ["figure1.png", "figure3.png"]
    spheres = stored(settings, "figure2")
    if spheres:
        _spheres(settings, spheres)
        drawn.append("figure2.png")
    statue = stored(settings, "figure4")
    if statue:
        factor = brighter(statue, "Path tracing")
        with figure(settings.data / "figure4.png", 2.6 * len(statue), 2.8) as sheet:
            for axes, (name, values) in zip(
                sheet.subplots(1, len(statue)), statue.items(), strict=True
            ):
                picture(axes, values[..., :3] * factor, name)
        drawn.append("figure4.png")
    return drawn


def _workflow(settings: Settings, heads: Mapping[str, NDArray[Any]]) -> None:
    with figure(settings.data / "figure1.png", 11.0, 2.9) as sheet:
        mesh, curvature, table, render = sheet.subplots(1, 4)
        picture(mesh, heads["mesh"][..., :3], "1. mesh")
        picture(curvature, heads["curvature"][..., :3], "2. curvature κ, once")
        theta, sigma = np.linspace(0.0, math.pi, 200), np.linspace(0.0, 1.5, 120)
        values = sphere().evaluate(theta[None, :], sigma[:, None])
        table.imshow(
            values,
            origin="lower",
            aspect="auto",
            cmap="gray",
            vmin=0.0,
            vmax=1.0,
            extent=(0.0, 180.0, 0.0, 1.5),
        )
        table.set_title("3. look-up table f(θ, σ)", fontsize=8)
        table.set_xlabel("θ, degrees")
        table.set_ylabel("σ = σ₀ κ")
        table.grid(visible=False)
        picture(
            render, heads["CDRF, shadows"][..., :3] * brighter(heads, "Path tracing"), "4. render"
        )


def _heads(settings: Settings, heads: Mapping[str, NDArray[Any]]) -> None:
    names = ("curvature", "Lambert", "Texture blurring", "CDRF, shadows", "Path tracing")
    factor = brighter(heads, "Path tracing")
    size = len(heads["Lambert"])
    with figure(settings.data / "figure3.png", 11.5, 6.9) as sheet:
        rows = sheet.subplots(3, len(names))
        for column, name in enumerate(names):
            scale = 1.0 if name == "curvature" else factor
            whole = heads[name][..., :3] * scale
            picture(rows[0][column], whole, name)
            for row, (left, right, low, high) in enumerate((NOSE, CHEEK), start=1):
                x, y = (
                    slice(int(left * size), int(right * size)),
                    slice(int(low * size), int(high * size)),
                )
                title = ("nose", "cheek")[row - 1] if column == 0 else ""
                picture(rows[row][column], whole[y, x], title)


def _spheres(settings: Settings, spheres: Mapping[str, NDArray[Any]]) -> None:
    with figure(settings.data / "figure2.png", 2.2 * len(spheres), 2.5) as sheet:
        for axes, (name, values) in zip(
            sheet.subplots(1, len(spheres)), spheres.items(), strict=True
        ):
            picture(axes, values[..., :3], f"ratio {name}")


# --- the matrix ----------------------------------------------------------------------------------


def pictured(settings: Settings) -> list[tuple[str, str]]:
    """Rows of pictures that are there: cell and file."""
    cells = [cell for cell in wanted_cells(settings) if settings.sample or cell in FIRST]
    return [
        (cell.name, f"cell_{cell.name.replace(', ', '_').replace(' ', '')}.png")
        for cell in cells
        if pictures_path(settings, cell).exists()
    ]


def cell_pictures(settings: Settings) -> None:
    """Contenders, the reference, and eight times the difference."""
    files = dict(pictured(settings))
    for cell in wanted_cells(settings):
        if cell.name not in files:
            continue
        pictures = load_pictures(pictures_path(settings, cell))
        names = [name for name in SHOWN if name in pictures]
        truth = pictures["reference"][..., :3].astype(np.float64)
        factor = brighter(pictures, "reference")
        width = 1.35 * (len(names) + 1)
        with figure(settings.data / files[cell.name], width, 3.1) as sheet:
            rows = sheet.subplots(2, len(names) + 1)
            picture(rows[0][0], truth * factor, "reference")
            plain(rows[1][0])
            for column, name in enumerate(names, start=1):
                values = pictures[name][..., :3].astype(np.float64)
                title = name.replace("Subsurface Scattering", "scattering node")
                title = title.replace("EEVEE ", "EEVEE\n").replace("CDRF ", "CDRF\n")
                title = title.replace(" (the default)", "").replace(" (Diffuse BSDF)", "")
                picture(rows[0][column], values * factor, title.replace("Random Walk, ", "\n"))
                off = np.abs(values - truth) * factor * DIFFERENCE
                picture(rows[1][column], off, f"× {DIFFERENCE:g} difference")


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
    with figure(settings.data / "pareto.svg", 4.2 * columns, 3.4 * rows) as sheet:
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
    with figure(settings.data / "preparation.svg", 5.2, 3.6) as sheet:
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

    if DEFAULT not in rows:
        return {}
    setup = middle(DEFAULT, "setup")
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
    with figure(settings.data / "scaling.svg", 4.0 * len(parts), 3.3) as sheet:
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


def lobes(settings: Settings) -> None:
    """The two closed forms beside Lambert, for Fig. 1's table to be read."""
    theta = np.linspace(0.0, math.pi, 240)
    with figure(settings.data / "lobes.svg", 4.6, 3.0) as sheet:
        axes = sheet.subplots()
        axes.plot(
            np.degrees(theta),
            np.maximum(np.cos(theta), 0.0),
            color=COLOURS["Lambert"],
            label="Lambert",
        )
        for sigma, style in ((0.2, "-"), (0.6, "--")):
            for name, model in (("CDRF ring", ring()), ("CDRF sphere", sphere())):
                axes.plot(
                    np.degrees(theta),
                    model.evaluate(theta, np.full_like(theta, sigma)),
                    style,
                    color=COLOURS[name],
                    label=f"{name}, σ = {sigma:g}",
                )
        axes.set_xlabel("θ, degrees")
        axes.set_ylabel("f(θ, σ)")
        axes.legend(fontsize=7)


def draw_all(settings: Settings) -> None:
    """Draw everything of which there are results."""
    paper_figures(settings)
    lobes(settings)
    cell_pictures(settings)
    pareto(settings)
    preparation_plot(settings)
    scaling_plot(settings)
