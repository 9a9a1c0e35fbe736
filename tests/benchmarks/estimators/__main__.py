# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line of the benchmark of the estimators."""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from surfaces import ALL_SURFACES

from cdrf_addon.core.curvature.estimators import DEFAULT_RADIUS, METHODS

from ..common.files import RESULTS, ROOT
from ..common.machine import machine_without_blender
from . import __doc__ as description
from .cases import FAMILIES, NOISES, RADII, SCALING_SIZES, SIZES, configurations
from .figures import draw_family, draw_scaling, figure_name
from .measure import (
    PATIENCE,
    QUICK_PATIENCE,
    SCALING_PATIENCE,
    measure_errors,
    measure_scaling,
    warm_up,
)
from .page import to_markdown
from .results import Results, Row, fingerprint
from .summary import Summary


def write_page(results: Results, folder: Path) -> None:
    """Draw the figures and write the page around them."""
    summary = Summary(results)
    figures = [
        key
        for key, family in FAMILIES.items()
        if draw_family(summary, family, folder / figure_name(key))
    ]
    if draw_scaling(results, folder / figure_name("scaling")):
        figures.append("scaling")
    (folder / "estimators.md").write_text(to_markdown(results, figures))


def main() -> None:
    """Measure what is asked for; results of the rest stay as they are in the JSON file."""
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--quick", action="store_true", help="small meshes, one radius, < 2 minutes"
    )
    parser.add_argument("--missing", action="store_true", help="keep what was measured before")
    parser.add_argument("--page", action="store_true", help="measure nothing")
    parser.add_argument(
        "--sizes", nargs="+", type=int, help="vertices, in place of the usual sizes"
    )
    parser.add_argument("--noises", nargs="+", type=float, help="in mean edges")
    parser.add_argument("--radii", nargs="+", type=int, help="rings, where a method takes them")
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=list(METHODS))
    parser.add_argument("--surfaces", nargs="+", choices=ALL_SURFACES, default=list(ALL_SURFACES))
    parser.add_argument("--no-scaling", action="store_true", help="leave out time against vertices")
    parser.add_argument("--out", type=Path, help="folder to write to")
    asked = parser.parse_args()
    quick = asked.quick
    folder = asked.out or (ROOT / "output" / "estimators" if quick else RESULTS)
    for part in ("data", "images"):
        (folder / part).mkdir(parents=True, exist_ok=True)
    data = folder / "data" / "estimators.json"
    results = Results.load(data)
    if not asked.page:
        start = time.perf_counter()
        results.machine = machine_without_blender()
        sizes = asked.sizes or (SIZES[:2] if quick else SIZES)
        noises = asked.noises or ((NOISES[0], NOISES[-1]) if quick else NOISES)
        radii = asked.radii or ((DEFAULT_RADIUS,) if quick else RADII)
        code = fingerprint()
        configs = [config for config in configurations(radii) if config[0] in asked.methods]
        warm_up(configs)
        rows = [
            Row(surface, size, noise, *config, code=code)
            for size in sizes
            for surface in asked.surfaces
            for noise in noises
            for config in configs
        ]

        def save() -> None:
            results.save(data)

        patience = QUICK_PATIENCE if quick else PATIENCE
        measure_errors(results, rows, patience, asked.missing, save)
        if not asked.no_scaling:
            usual = [c for c in configs if c[1] in (None, DEFAULT_RADIUS)]
            more = SCALING_SIZES[:3] if quick else SCALING_SIZES
            patience = PATIENCE if quick else SCALING_PATIENCE
            measure_scaling(results, more, usual, code, patience, asked.missing, save)
        print(f"measured in {time.perf_counter() - start:.0f} s", flush=True)
    write_page(results, folder)
