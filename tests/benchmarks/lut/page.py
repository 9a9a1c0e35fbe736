# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders docs/results/lut.md from the results."""

from __future__ import annotations

from functools import partial
from itertools import product
from typing import Any

from tolerances import SHADER

from cdrf_addon.core.reflectance.model import SPHERE

from ..common.markdown import facts, generated, table
from .render import PIXELS, arguments
from .variants import (
    COLUMNS,
    FILTER_SIZES,
    MAPPING_SIZES,
    MODELS,
    ROOT_COSINE,
    ROOT_SIGMA,
    ROWS,
    SIZES,
    Variant,
)

GOAL_MS = 50.0


def pick(rows: list[dict[str, Any]], /, **wanted: Any) -> list[dict[str, Any]]:
    """Rows with these settings and the default's for what is not named."""
    settings = {**Variant().__dict__, **wanted}
    free = [name for name, value in settings.items() if value is None]
    fixed = {name: value for name, value in settings.items() if name not in free}
    return [row for row in rows if all(row[name] == value for name, value in fixed.items())]


def both(results: dict[str, Any], what: str = "worst", /, **wanted: Any) -> float:
    """The larger of the two models' numbers for one variant."""
    return max(float(pick(results[kind], **wanted)[0][what]) for kind in MODELS)


def sized(results: dict[str, Any]) -> list[tuple[float, float, float, Variant]]:
    """KiB, worst and RMS error of either model, and the variant, for every size and storage."""
    found = []
    for row in pick(results[SPHERE], width=None, height=None, storage=None):
        variant = Variant(row["width"], row["height"], row["storage"])
        errors = [both(results, what, **variant.__dict__) for what in ("worst", "RMS")]
        found.append((variant.kib, errors[0], errors[1], variant))
    return sorted(found, key=lambda entry: entry[:3])


def knee(results: dict[str, Any]) -> list[str]:
    """Return sentences on which variant is the knee of the tables, from the numbers."""
    tables = sized(results)
    good = [entry for entry in tables if entry[1] <= SHADER.worst and entry[2] <= SHADER.rms]
    default = next(entry for entry in tables if entry[3] == Variant())
    smaller = min((entry for entry in tables if entry[0] < good[0][0]), key=lambda entry: entry[2])
    larger = max(tables)
    size: dict[str, Any] = {"width": Variant().width, "height": Variant().height}
    worst = partial(both, results, **size)
    maps = sorted(
        (worst(columns=columns, rows=rows), columns, rows)
        for columns, rows in product(COLUMNS, ROWS)
        if (columns, rows) != (ROOT_COSINE, ROOT_SIGMA)
    )

    def named(entry: tuple[float, float, float, Variant]) -> str:
        variant = entry[3]
        return f"{variant.width} × {variant.height} {variant.storage} ({entry[0]:.0f} KiB)"

    first = "the default" if good[0] == default else f"not the default, {named(default)}"
    return [
        "The smallest table that keeps both models within what the shader may be off, a worst",
        f"pixel of {SHADER.worst:.0e} and an RMS of {SHADER.rms:.0e}, is **{named(good[0])}**,",
        f"{first}: {good[0][1]:.1e} and {good[0][2]:.1e}.",
        f"The best of the smaller ones, {named(smaller)},",
        f"has {smaller[1]:.1e} and {smaller[2]:.1e}; {named(larger)} takes",
        f"{larger[0] / default[0]:.1f} times the space for {larger[1]:.1e} and {larger[2]:.1e}.",
        "",
        f"At the default's size, half floats are {worst(storage='half'):.1e} off. Of the other",
        f"mappings the best (columns {maps[0][1]}, rows {maps[0][2]}) is {maps[0][0]:.1e} off, the",
        f"plainest (c and σ) {worst(columns='c', rows='σ'):.1e}. Flat projection makes",
        f"{worst(projection='FLAT'):.1e} of the same texels, as it reads coarser mip levels; Cubic",
        f"makes {worst(filter='Cubic'):.1e}, as it rounds the kink of Lambert off; Closest",
        f"{worst(filter='Closest'):.1e}.",
    ]


def page(results: dict[str, Any]) -> str:
    """Write the page."""
    cosine, sigma = arguments()
    lines = [
        "# The look-up table in rendered pixels",
        "",
        generated("lut"),
        "",
        f"Measured on: {facts(results['machine'])}; EEVEE on a software rasteriser. "
        "CPU milliseconds, least of five.",
        "",
        f"Each number is of {PIXELS} × {PIXELS} pixels whose shader looked up cos θ from -1 to 1",
        f"and σ from {sigma[0]:.0e} to {sigma[-1]:.2g}, both swept as a cube: half of the pixels",
        f"have \\|cos θ\\| < {abs(cosine[PIXELS // 4]):.2f}, half σ < {sigma[PIXELS // 2]:.2f}.",
        "They are compared with the model in float64 at the same arguments. The RMS is that of a",
        "sphere lit from the camera, at the worst σ of all.",
        "The pixels are read to 1e-6, past the half-float film; the arguments,",
        f"rendered the same way, were within {results['arguments']:.0e}.",
        "",
        "## The knee",
        "",
        *knee(results),
        "",
        "On a rendered sphere, through the whole of the shader, the value stays within",
        f"{SHADER.worst:.0e} (RMS {SHADER.rms:.0e}) at σ from 0 to 30, with either model, and with",
        "the skin profile at σ up to 1: `tests/render/test_sphere.py`.",
        "",
        *_rendered(results),
        *_computed(results),
    ]
    return "\n".join(lines)


def _rendered(results: dict[str, Any]) -> list[str]:
    lines = [
        "## Size and storage",
        "",
        f"Columns {ROOT_COSINE}, rows {ROOT_SIGMA}, tube projection, linear filter.",
        "",
    ]
    head = ["texels", "storage", "KiB", *_heads("worst"), *_heads("RMS"), *_heads("ms")]
    lines += table(head, _rows(results, ("storage",), width=None, height=None, storage=None))
    lines += [
        "## Mapping of the axes",
        "",
        "Float, tube projection, linear filter.",
        "",
    ]
    head = ["texels", "columns", "rows", *_heads("worst"), *_heads("RMS")]
    free = dict.fromkeys(("width", "height", "columns", "rows"))
    lines += table(head, _rows(results, ("columns", "rows"), MAPPING_SIZES, **free))
    lines += [
        "## Filter and projection",
        "",
        f"Float, columns {ROOT_COSINE}, rows {ROOT_SIGMA}.",
        "",
    ]
    head = ["texels", "filter", "projection", *_heads("worst"), *_heads("RMS")]
    free = dict.fromkeys(("width", "height", "filter", "projection"))
    rows = _rows(results, ("filter", "projection"), FILTER_SIZES, **free)
    lines += table(head, rows)
    lines += [
        "Left out, as the tables above leave no doubt: other mappings with half floats, with other",
        "filters or in flat projection; mappings and filters at the sizes that are not in their",
        "table; and 1024 × 512, which is only sampled in numpy below.",
        "",
    ]
    return lines


def _computed(results: dict[str, Any]) -> list[str]:
    lines = [
        "## The same table sampled by an ideal bilinear filter",
        "",
    ]
    head = ["texels", *_heads("worst"), *_heads("RMS"), *_heads("ms")]
    pairs = zip(*(results["ideal"][kind] for kind in MODELS), strict=True)
    rows = [
        [f"{p[0]['width']} x {p[0]['height']}", *_numbers(p, ("worst", "RMS", "ms"))] for p in pairs
    ]
    lines += table(head, rows)
    lines += [
        "## Generation",
        "",
        f"The default table, {Variant().width} x {Variant().height}.",
        "",
    ]
    made = [[name, f"{spent:.0f}"] for name, spent in results["generation"].items()]
    lines += table(["model", "CPU ms"], made)
    slow = [name for name, spent in results["generation"].items() if spent > GOAL_MS]
    verdict = f"All but these are within the goal of {GOAL_MS:.0f} ms: {', '.join(slow)}."
    lines += [verdict if slow else f"All are within the goal of {GOAL_MS:.0f} ms.", ""]
    return lines


def _heads(what: str) -> list[str]:
    return [f"{what}, {kind.lower()}" for kind in MODELS]


def _numbers(pair: tuple[dict[str, Any], ...], names: tuple[str, ...]) -> list[str]:
    return [
        f"{row[name]:.0f}" if name == "ms" else f"{row[name]:.1e}" for name in names for row in pair
    ]


def _rows(
    results: dict[str, Any],
    shown: tuple[str, ...],
    sizes: tuple[tuple[int, int], ...] = SIZES,
    **free: Any,
) -> list[list[str]]:
    rows = []
    pairs = zip(*(pick(results[kind], **free) for kind in MODELS), strict=True)
    order = sorted(pairs, key=lambda pair: (pair[0]["width"], pair[0]["height"]))
    for pair in order:
        first = pair[0]
        if (first["width"], first["height"]) not in sizes:
            continue
        default = all(first[name] == value for name, value in Variant().__dict__.items())
        texels = f"{first['width']} x {first['height']}"
        row = [f"**{texels}**" if default else texels, *(str(first[name]) for name in shown)]
        if "storage" in shown:
            row += [f"{first['KiB']:.0f}", *_numbers(pair, ("worst", "RMS", "ms"))]
        else:
            row += _numbers(pair, ("worst", "RMS"))
        rows.append(row)
    return rows
