# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders docs/results/estimators.md from the rows."""

from __future__ import annotations

import math
import statistics
from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np
from surfaces import ALL_SURFACES

from cdrf_addon.core.curvature.estimators import DEFAULT_METHOD, DEFAULT_RADIUS

from ..common.markdown import facts, generated, table
from .cases import CLICK, FAMILIES, LARGE, SCALING_SURFACE, Config, Family, name_of
from .figures import figure_name
from .formats import count_of, noise_of, series, short
from .results import Results
from .summary import Summary, exponent, pareto, scaling_series

Table = tuple[list[str], list[list[str]]]


def family_table(summary: Summary, family: Family) -> Table:
    """Errors of a family in per cent, a number for each size."""
    loudest = summary.noises[-1]
    columns: list[tuple[str, str, float]] = [
        ("κ", "rms", 0.0),
        ("κ", "worst", 0.0),
        ("H", "rms", 0.0),
        ("k₁, k₂", "rms", 0.0),
        *(("κ", "rms", noise) for noise in summary.noises if noise),
        ("κ", "worst", loudest),
    ]
    columns = list(dict.fromkeys(columns))
    quantities = {"κ": ("kappa",), "H": ("mean",), "k₁, k₂": ("k1", "k2")}
    rows = []
    for config in summary.configs:
        cells = [name_of(config)]
        for symbol, kind, noise in columns:
            # Of k1 and k2, the worse one.
            errors = [
                [
                    summary.error(family, size, noise, config, quantity, kind)
                    for quantity in quantities[symbol]
                ]
                for size in summary.sizes
            ]
            cells.append(series(100.0 * float(np.max(both)) for both in errors))
        rows.append([*cells, short(summary.order(family, config))])
    kinds = {"rms": "RMS", "worst": "worst"}
    head = [f"{symbol} {kinds[kind]}, {noise_of(noise)}" for symbol, kind, noise in columns]
    return ["estimator, rings", *head, "order, κ RMS, clean"], rows


def cost_table(summary: Summary) -> Table:
    """Seconds and memory of every estimator."""
    largest = summary.sizes[-1]
    rows = []
    for config in summary.configs:
        seconds = [summary.cost(config, size, "seconds") for size in summary.sizes]
        memory = [summary.cost(config, size, "megabytes") for size in summary.sizes]
        wall = [summary.cost(config, size, "wall") for size in summary.sizes]
        each = 1e6 * seconds[-1] / largest
        cells = [name_of(config), series(seconds), short(each), series(wall), series(memory)]
        rows.append([*cells, series(summary.filled(config, size) for size in summary.sizes)])
    head = ["CPU s", f"µs a vertex at {count_of(largest)}", "s by the clock"]
    return ["estimator, rings", *head, "peak MB above the mesh", "filled at the most, %"], rows


def conclusions(summary: Summary) -> list[str]:
    """Return what is on the front and what is best on irregular meshes, case by case and in all."""
    family = FAMILIES["irregular"]
    rows: list[list[str]] = []
    often: Counter[Config] = Counter()
    best: Counter[Config] = Counter()
    behind: list[float] = []
    usual = next(
        (
            c
            for c in summary.configs
            if c in ((DEFAULT_METHOD, DEFAULT_RADIUS), (DEFAULT_METHOD, None))
        ),
        None,
    )
    for noise in summary.noises:
        for size in summary.sizes:
            points = summary.points(family, size, noise)
            if not points:
                continue
            front = pareto(points)
            often.update(point.config for point in front)
            winner = min(points, key=lambda point: point.product)
            best[winner.config] += 1
            behind += [p.product / winner.product for p in points if p.config == usual]
            names = "; ".join(f"{name_of(p.config)}: {short(100.0 * p.error)} %" for p in front)
            row = [noise_of(noise), count_of(size), names, name_of(winner.config)]
            rows.append([*row, short(100.0 * winner.error), short(winner.seconds)])
    if not rows:
        return ["Nothing measured on irregular meshes yet.", ""]
    never = [name_of(config) for config in summary.configs if config not in often]
    phrases = [
        f"Of the {len(rows)} cases of noise and size on irregular meshes (RMS error of κ against "
        "CPU seconds):",
        "",
        "- on the Pareto front most often: " + _ranking(often, len(rows)) + ";",
        "- never on it: " + ("; ".join(never) or "none") + ";",
        "- least error × time: " + _ranking(best, len(rows)) + ".",
    ]
    if behind:
        phrases.append(
            f"- The default, {name_of(usual)}: on the front in {often[usual]} of {len(rows)}; its "
            f"error × time is {short(statistics.median(behind))} times the least in the median, "
            f"{short(max(behind))} times at the worst."
            if usual
            else ""
        )
    head = ["noise", "vertices", "Pareto front, quick to accurate", "least error × time"]
    return [*phrases, "", *table([*head, "its κ RMS, %", "its CPU s"], rows)]


def _ranking(counted: Counter[Config], of: int) -> str:
    return "; ".join(
        f"{name_of(config)} ({count} of {of})" for config, count in counted.most_common()
    )


def scaling_table(results: Results) -> Table:
    """Fitted exponents beside that of n log n."""
    rows = []
    for name, runs in scaling_series(results).items():
        cells = [name]
        for least in (0, LARGE):
            chosen = [run for run in runs if run.vertices >= 0.9 * least]
            if len(chosen) < 3:
                cells += ["–"] * 3
                continue
            sizes = [run.vertices for run in chosen]
            slope, doubt = exponent(sizes, [run.seconds for run in chosen])
            demanded, _ = exponent(sizes, [size * math.log(size) for size in sizes])
            beyond = slope - demanded
            verdict = "yes" if beyond <= 0.0 else "unclear" if beyond <= 2.0 * doubt else "**no**"
            cells += [f"{slope:.2f} ± {doubt:.2f}", f"{demanded:.2f}", verdict]
        each = [1e6 * run.seconds / run.vertices for run in (runs[0], runs[-1])]
        rows.append([*cells, f"{short(each[0])} → {short(each[1])}"])
    return [
        "pipeline",
        "exponent",
        "of n log n",
        "met",
        f"from {count_of(LARGE)}",
        "of n log n",
        "met",
        "µs a vertex, first → last size",
    ], rows


def mesh_table(results: Results, sizes: Sequence[int]) -> Table:
    """What the meshes are like."""
    rows = []
    for name in ALL_SURFACES:
        facts = [results.meshes.get(name, {}).get(str(size)) for size in sizes]
        cells = [
            " / ".join(f"{fact[what]:,}" if fact else "–" for fact in facts)
            for what in ("vertices", "border", "inverted")
        ]
        rows.append([name, *cells])
    return ["surface", "vertices", "next to the boundary", "triangles turned over"], rows


def to_markdown(results: Results, figures: Iterable[str]) -> str:
    """Render the page."""
    summary = Summary(results)
    sizes = " / ".join(count_of(size) for size in summary.sizes)
    everything = [*results.rows.values(), *results.scaling.values()]
    codes = sorted({row.code for row in everything})
    lines = [
        "# Curvature estimators: error against run time",
        "",
        f"{generated('estimators')} Every measurement is in "
        "[estimators.json](data/estimators.json).",
        "",
        f"Measured on: {facts(results.machine)}.",
        "",
        "Errors are in % of the surface's RMS curvedness κ; H is the mean curvature. A cell holds "
        f"{sizes} vertices, a dash where nothing was measured. Over a family the RMS column is the "
        "RMS of its surfaces, the worst the worst vertex of them all. The order is the power of "
        "the edge length with which the error falls. Noise moves every vertex along the normal, "
        "normally distributed, by that part of the mean edge. Times are CPU seconds of all threads "
        "and include cleaning, guarding and filling; memory is the peak of a fresh process above "
        "what it held with the mesh loaded.",
        "",
    ]
    if len(codes) > 1:
        lines += [f"**The rows come from {len(codes)} versions of the sources**; run it all.", ""]
    lines += ["## Conclusions", "", *conclusions(summary)]
    for key, family in FAMILIES.items():
        lines += [f"## {family.title}", "", "Of: " + ", ".join(family.surfaces) + ".", ""]
        if key in figures:
            lines += [f"![Error against time]({figure_name(key)})", ""]
        lines += table(*family_table(summary, family))
    lines += [
        "## Time and memory",
        "",
        "Medians over the surfaces and the noise. A vertex is filled from its neighbours where an "
        "estimator has no value.",
        "",
        *table(*cost_table(summary)),
    ]
    lines += [
        "## Time against the number of vertices",
        "",
        f"The whole pipeline on a {SCALING_SURFACE}, from the arrays of the mesh to the curvature "
        f"at its vertices, at the default radius; *{CLICK}* is the operator in Blender. Demanded "
        "is n log n: the fitted exponent may not exceed that of n log n over the same sizes; an "
        "excess of less than two standard errors is unclear.",
        "",
    ]
    if "scaling" in figures:
        lines += [f"![Seconds against vertices]({figure_name('scaling')})", ""]
    lines += table(*scaling_table(results))
    lines += ["## The meshes", "", *table(*mesh_table(results, summary.sizes))]
    lines += [
        "Triangles are turned over where jitter moved a vertex across an edge.",
        "",
    ]
    failed = [row for row in everything if row.failure]
    if failed:
        head = ["surface", "vertices", "noise", "estimator", "failure"]
        rows = [
            [
                row.surface,
                count_of(row.size),
                noise_of(row.noise),
                name_of((row.method, row.rings)),
                row.failure,
            ]
            for row in failed
        ]
        lines += ["## Failures", "", *table(head, rows)]
    return "\n".join(lines)
