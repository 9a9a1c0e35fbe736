# SPDX-License-Identifier: GPL-3.0-or-later
"""The view-dependent model against walks: docs/results/walk.md, its figure, its raw data.

./dev bench walk [--walks 4000]     walk, fit, judge what ships, write all
./dev bench walk --judge            only judge what core/walk/view.py has now, and print it
./dev bench walk --page             only write the page again, from docs/results/data/walk.json
"""

from __future__ import annotations

import argparse
import platform
import time
from datetime import UTC, datetime
from typing import Any

import numpy as np

from cdrf_addon.core.walk.sphere_walk import BALL, HOLLOW

from ..common.files import IMAGES, read_results, rounded, write_page, write_results
from ..common.memory import whole_peak_megabytes
from . import figure, measure
from .page import page
from .tables import (
    CURVED,
    ENTRIES,
    HOLLOWED,
    Coefficients,
    Walked,
    fit_energy,
    fit_shape,
    walk_all,
)

# The walks that judge have another seed than those that are fitted to.
FIT_SEED, JUDGE_SEED = 5, 7


def walk_balls(walks: int, seed: int) -> list[Walked]:
    """Walk balls for every roughness and index."""
    return [walk_all(BALL, CURVED, entry, walks, seed + 100 * i) for i, entry in enumerate(ENTRIES)]


def refit(walks: int, data: dict[str, Any]) -> tuple[dict[str, Any], list[Walked]]:
    """Fit all coefficients to walks of this command; view.py is left as it was."""
    start = time.perf_counter()
    balls = walk_balls(walks, FIT_SEED)
    hollows = [
        walk_all(HOLLOW, HOLLOWED, entry, max(walks // 8, 100), FIT_SEED + 100 * i + 50)
        for i, entry in enumerate(ENTRIES[:2])
    ]
    walked = time.perf_counter()
    print(f"walks to fit to: {walked - start:.0f} s", flush=True)
    shipped = Coefficients.current()
    try:
        fit_energy(balls, hollows)
        fit_shape(balls)
        mine = Coefficients.current()
        errors = measure.summary(measure.spheres(data))
    finally:
        shipped.put()
    fitted = time.perf_counter()
    print(f"fits: {fitted - walked:.0f} s", flush=True)
    numbers = {
        name: {"shipped": shipped.values[name], "here": mine.values[name]} for name in mine.values
    }
    return {
        "walk seconds": walked - start,
        "fit seconds": fitted - walked,
        "errors": errors,
        "coefficients": numbers,
    }, balls


def main() -> None:
    """Walk, fit, judge, write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--walks", type=int, default=4_000, help="a view, curvature and half")
    parser.add_argument("--judge", action="store_true", help="print the errors of view.py as it is")
    parser.add_argument("--page", action="store_true", help="only write the page again")
    options = parser.parse_args()
    if options.page:
        write_page("walk", page(read_results("walk")))
        return
    if options.judge:
        for found in measure.judged(walk_balls(options.walks, JUDGE_SEED)):
            print(f"\nalpha {found['alpha']}, index {found['ior']}: RMS / A; noise at A 0.34 last")
            print("l / R  " + "".join(f"{a:8.2f}" for a in found["colours"]))
            for x, row, noise in zip(found["curved"], found["error"], found["noise"], strict=True):
                print(f"{x:6.2f} " + "".join(f"{e:8.4f}" for e in row) + f"   {noise[2]:.4f}")
        return
    start, data = time.perf_counter(), measure.independent()
    results: dict[str, Any] = {
        "machine": {
            "date": datetime.now(UTC).date().isoformat(),
            "architecture": platform.machine(),
            "python": platform.python_version(),
            "numpy": np.__version__,
        },
        "walks": options.walks,
        "spheres": measure.spheres(data),
        "planes": measure.planes(),
        "flat seconds": measure.flat_time(),
    }
    results["figure"] = figure.measure(20 * options.walks, JUDGE_SEED + 1000)
    figure.draw(results["figure"], IMAGES / "walk-figure2.svg")
    print(f"figure: {time.perf_counter() - start:.0f} s", flush=True)
    results["refit"], balls = refit(options.walks, data)
    results["knee"] = measure.knee(balls, data)
    print(f"knee: {time.perf_counter() - start:.0f} s", flush=True)
    results["judged"] = measure.judged(walk_balls(options.walks, JUDGE_SEED))
    results["bodies"] = measure.bodies(options.walks, JUDGE_SEED + 500)
    results["seconds"] = time.perf_counter() - start
    results["megabytes"] = whole_peak_megabytes()
    results = rounded(results, 4)
    write_results("walk", results)
    write_page("walk", page(results))
    print(f"all: {results['seconds']:.0f} s")


if __name__ == "__main__":
    main()
