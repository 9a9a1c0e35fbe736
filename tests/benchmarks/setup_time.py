# SPDX-License-Identifier: GPL-3.0-or-later
"""Run time and memory of Make Translucent: docs/results/benchmarks.md.

    ./dev bench setup_time           two minutes on two cores
    ./dev bench setup_time --page    the page from the JSON

Timings are seconds on the clock. What a draw costs is in node_groups, the table in lut.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import bpy
import igl
from rig import Rig
from surfaces import ALL_SURFACES

from cdrf_addon import register, unregister

from .common.files import read_results, write_page, write_results
from .common.machine import machine
from .common.markdown import facts, generated, table
from .common.memory import peak_megabytes, reset_peak
from .common.shapes import mesh_of

HEAD = [
    "vertices",
    "first time, s",
    "us a vertex",
    "peak MB more",
    "again, nothing changed, s",
    "libigl's fit alone, s",
    "ratio",
]


def measure() -> list[list[str]]:
    """Time the whole of Make Translucent, and of pressing it again with nothing changed.

    libigl's own quadric fit, without cleaning or diffusion, is timed on the same mesh as a
    yardstick of the machine.
    """
    rows = []
    for wanted in (10_000, 100_000, 1_000_000):
        rig = Rig()
        rig.light("SUN")
        surface = ALL_SURFACES["jittered torus"](wanted)
        start = time.perf_counter()
        igl.principal_curvature(surface.vertices, surface.triangles, 2)
        yardstick = time.perf_counter() - start
        obj = rig.link(mesh_of(surface.vertices, surface.triangles))
        obj.select_set(True)
        bpy.context.view_layer.update()
        before = reset_peak()
        start = time.perf_counter()
        bpy.ops.cdrf.setup()
        first = time.perf_counter() - start
        memory = peak_megabytes() - before
        start = time.perf_counter()
        bpy.ops.cdrf.setup()
        again = time.perf_counter() - start
        count = len(obj.data.vertices)
        row = [f"{count:,}", f"{first:.2f}", f"{1e6 * first / count:.1f}", f"{memory:.0f}"]
        rows.append([*row, f"{again:.3f}", f"{yardstick:.2f}", f"{first / yardstick:.2f}"])
    return rows


def to_markdown(results: dict[str, Any]) -> str:
    """Render the table as a page."""
    lines = ["# Benchmarks", "", generated("setup_time"), ""]
    lines += ["Elsewhere: [what a draw costs](node_groups.md), [the table](lut.md),"]
    lines += [
        "[the estimators of curvature](estimators.md).",
        "",
        f"Measured on: {facts(results['machine'])}.",
        "",
    ]
    lines += ["## Make Translucent: from click to finish", "", *table(HEAD, results["setup"])]
    return "\n".join(lines)


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--page", action="store_true", help="measure nothing")
    if not parser.parse_args().page:
        register()
        try:
            write_results("benchmarks", {"machine": machine(), "setup": measure()})
        finally:
            unregister()
    write_page("benchmarks", to_markdown(read_results("benchmarks")))


if __name__ == "__main__":
    main()
