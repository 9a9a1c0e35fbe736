# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes docs/results/walk.md from its raw results."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..common.markdown import facts, generated, table
from .figure import MODELS

RANGES = ("to 0.1", "0.2", "0.3")
# Columns of the wide tables: the others lie between these.
SHOWN_COLOURS = (0.1, 0.2, 0.34, 0.62, 0.9, 1.0)


def error(value: float) -> str:
    """Format an error; 0 is one that the noise hides."""
    return f"{value:.4f}" if value > 0.0 else "< noise"


def page(results: dict[str, Any]) -> str:
    """Write the page."""
    lines = [
        "# The view-dependent model against walks",
        "",
        generated("walk"),
        "",
        f"Measured with: {facts(results['machine'])}. NumPy alone, no Blender.",
        "",
        "What [the model](../theory/walk.md) misses. Errors are RMS of the radiance over A, a",
        "Lambert under a sun of irradiance π showing A · N·L; the squared Monte-Carlo error is",
        "taken off the squared error, and *< noise* stands where nothing is left. Method: Cycles'",
        "*Random Walk* of Blender 5.2 (`RANDOM_WALK`).",
        "",
        *_spheres(results),
        *_planes(results),
        *_figure(results),
        *_knee(results),
        *_refit(results),
        *_judged(results),
        *_bodies(results),
        *_costs(results),
    ]
    return "\n".join(lines)


def _spheres(results: dict[str, Any]) -> list[str]:
    rows = results["spheres"]
    colours = sorted({row["colour"] for row in rows})
    lines = [
        "## Spheres of another program",
        "",
        "16 points all over a ball's picture, a sun at 0° to 165° from the view, roughness 1,",
        "index 1.4. The walks are stored in `tests/data/walk_spheres.json`: another program",
        "(compiled by numba, Russian roulette, walks without an end), another seed, 2 × 10,000",
        "walks a point. The model's end of walks is switched off here. Lambert's error in",
        "brackets.",
        "",
    ]
    cells = []
    for x in sorted({row["curved"] for row in rows}):
        line = [f"{x:g}"]
        for a in colours:
            (one,) = (row for row in rows if (row["colour"], row["curved"]) == (a, x))
            line.append(f"{error(one['error'])} ({one['lambert']:.3f})")
        cells.append(line)
    return lines + table(["ℓκ", *(f"A = {a:g}" for a in colours)], cells)


def _planes(results: dict[str, Any]) -> list[str]:
    from .measure import PLANE_MU

    worst = {"exact": 0.0, "fit": 0.0}
    mean = dict(worst)
    cells, count = [], 0
    for a, found in results["planes"].items():
        line = [a]
        for i, rendered in enumerate(found["rendered"]):
            line.append(f"{rendered:.3f} / {found['exact'][i]:.3f} / {found['fit'][i]:.3f}")
            count += 1
            for name in worst:
                off = abs(found[name][i] - rendered)
                worst[name], mean[name] = max(worst[name], off), mean[name] + off
        cells.append(line)
    return [
        "## Planes rendered by Cycles",
        "",
        "G, what a plane shows over Lambert's. Rendered by Cycles 5.2 without a denoiser (noise",
        "about 0.002) / exact by quadrature / as the shader has it.",
        "",
        *table(["A", *(f"μ = {mu:g}" for mu in PLANE_MU)], cells),
        f"Off the rendered planes on average {mean['exact'] / count:.4f}, worst",
        f"{worst['exact']:.4f} (exact), {mean['fit'] / count:.4f} and {worst['fit']:.4f} (shader).",
        "",
    ]


def _figure(results: dict[str, Any]) -> list[str]:
    found = results["figure"]
    names = [*MODELS, "ring, best width", "sphere, best width"]
    cells = []
    for name in names:
        model = found["models"][name]
        shown = f"{name} (σ = {model['sigma']:g})" if "sigma" in model else name
        cells.append([shown, *(f"{value:.4f}" for value in model["rms"])])
    cells.append(["noise taken off", *(f"{value:.4f}" for value in found["noise"])])
    return [
        "## The paper's Fig. 2 from five directions",
        "",
        f"A sphere of A = {found['colour']:g}, ℓκ = {found['curved']:g}, roughness 1, index 1.4; N",
        "runs along the circle through the view and the light, each 5° to 85° to both sides of the",
        f"view. {found['walks']:,} walks a point, seeded (`core/walk/sphere_walk.py`), none of",
        f"them used in a fit. Ring and sphere at σ = {found['sigma']:.3g}, as this material's",
        "radius gives it; below them at the σ that fits best over all five.",
        "",
        "![What each model misses, a panel for each angle from the view to the light]"
        "(images/walk-figure2.svg)",
        "",
        *table(["RMS / A", *(f"{between}°" for between in found["between"])], cells),
    ]


def _knee(results: dict[str, Any]) -> list[str]:
    cells = [
        [row["name"], f"{row['numbers']}", *(f"{row[part]:.4f}" for part in RANGES)]
        for row in results["knee"]
    ]
    return [
        "## How many numbers",
        "",
        "Each step with its own fit of width, tilt and haze, to this command's walks at roughness",
        "1 and index 1.4; judged on the spheres of the other program, RMS over all A. Energy is as",
        "it ships. The flat limit G is computed and counts for nothing; the five numbers of",
        "hollows do not show on spheres (33 in all).",
        "",
        *table(["terms", "numbers", *_ranges()], cells),
        "Energy and a tilt take most of the error away, the haze a third of what is left. At this",
        "one roughness and index a tilt of one number does as well as one of six: the others are",
        "there for other colours, roughness and index. More numbers than these were not tried.",
        "",
    ]


def _ranges() -> list[str]:
    return [f"ℓκ {'' if part.startswith('to') else '= '}{part}" for part in RANGES]


def _refit(results: dict[str, Any]) -> list[str]:
    found = results["refit"]
    shipped = results["knee"][-1]
    errors = [
        ["as shipped", *(f"{shipped[part]:.4f}" for part in RANGES)],
        ["fitted by this command", *(f"{found['errors'][part]:.4f}" for part in RANGES)],
    ]

    def numbers(values: Sequence[float]) -> str:
        return ", ".join(f"{value:.4g}" for value in values)

    cells = [
        [f"`{name}`", numbers(each["shipped"]), numbers(each["here"])]
        for name, each in found["coefficients"].items()
    ]
    return [
        "## Where the numbers come from",
        "",
        "Those that ship (`core/walk/view.py`) were fitted by the same formulas and weights to",
        "100,000 to 200,000 walks a view, made by a compiled copy of the walk that is not part of",
        f"this repository. This command fits to 2 × {results['walks']:,} walks a view in NumPy. It",
        "does not give the digits that ship: the nine numbers of `GAIN` trade against each other.",
        "It gives a similar error on the other program's spheres, and `./dev bench walk --judge`",
        "gives the error of what ships on walks of this repository:",
        "",
        *table(["coefficients", *_ranges()], errors),
        *table(["", "shipped", "fitted here"], cells),
    ]


def _judged(results: dict[str, Any]) -> list[str]:
    lines = [
        "## Other roughness, index and colour",
        "",
        f"Own walks, 2 × {results['walks']:,} a view, of another seed than the fit's. All views,",
        "40 suns. The noise that is taken off is that of A = 0.34.",
        "",
    ]
    for found in results["judged"]:
        chosen = [found["colours"].index(a) for a in SHOWN_COLOURS]
        cells = [
            [
                f"{x:g}",
                *(error(row[i]) for i in chosen),
                f"{noise[found['colours'].index(0.34)]:.4f}",
            ]
            for x, row, noise in zip(found["curved"], found["error"], found["noise"], strict=True)
        ]
        lines += [f"GGX α = {found['alpha']:g}, index {found['ior']:g}:", ""]
        lines += table(["ℓκ", *(f"A = {a:g}" for a in SHOWN_COLOURS), "noise"], cells)
    return [
        *lines,
        "Dark colours are missed by the most of A, and of little light. Beyond ℓκ = 0.3 a body is",
        "seen through.",
        "",
    ]


def _bodies(results: dict[str, Any]) -> list[str]:
    found = results["bodies"]
    chosen = [found["colours"].index(a) for a in SHOWN_COLOURS[2:]]
    titles = {
        "ACROSS": "cylinder seen across its axis",
        "ALONG": "cylinder seen along its axis",
        "HOLLOW": "hollow",
    }
    cells = []
    for body, title in titles.items():
        rows = found[body]
        others = rows.get("mean curvature alone", rows["error"])
        for x, row, other, noise in zip(
            rows["curved"], rows["error"], others, rows["noise"], strict=True
        ):
            line = [title, f"{x:g}"]
            for i in chosen:
                beside = f" ({error(other[i])})" if other is not row else ""
                line.append(error(row[i]) + beside)
            cells.append([*line, f"{noise[found['colours'].index(0.34)]:.4f}"])
    head = ["body", "ℓ/R", *(f"A = {a:g}" for a in SHOWN_COLOURS[2:]), "noise"]
    return [
        "## Cylinders and hollows",
        "",
        "Nothing of tilt, width and haze was fitted to these. In brackets the same with the mean",
        "curvature in place of the shape operator.",
        "",
        *table(head, cells),
    ]


def _costs(results: dict[str, Any]) -> list[str]:
    found = results["refit"]
    return [
        "## Time and memory",
        "",
        f"The whole command took {results['seconds']:.0f} s and {results['megabytes']:.0f} MB on a "
        "machine that was doing",
        f"other work: {found['walk seconds']:.0f} s for the walks of the fit, "
        f"{found['fit seconds']:.0f} s for the fit. What ships is 33 numbers, 264",
        "bytes, and no table. A material of a roughness or index not met before needs its flat",
        f"limit once: {results['flat seconds']:.2f} s.",
        "",
    ]
