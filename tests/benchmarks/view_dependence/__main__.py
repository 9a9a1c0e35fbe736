# SPDX-License-Identifier: GPL-3.0-or-later
"""The path-traced look over all of the report's scenes with lamps: docs/results/view_dependence.md.

    ./dev bench view_dependence             an hour, most of it Cycles
    ./dev bench view_dependence --missing   scenes that are not measured yet
    ./dev bench view_dependence --page      page and pictures from what is there

Scenes, contenders and measures are the report's, at a smaller size. Every scene is kept as soon as
it is measured, so the command may be stopped at any time and called again with --missing.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy  # noqa: F401  (must come before anything that needs it)
import numpy as np

from cdrf_addon import register, unregister
from cdrf_addon.core.scattering.node_radius import RANDOM_WALK

from ..common.arrays import Array, Mask
from ..common.files import RESULTS, ROOT, rounded, write_page, write_results
from ..common.machine import machine
from ..report.cells import Cell
from ..report.contenders import CONTENDERS, SHADOWS
from ..report.lights import directions
from ..report.matrix import describe, keep_pictures, run
from ..report.metrics import rmse
from ..report.reference import reference
from ..report.settings import Settings
from ..report.stage import Stage
from .page import page
from .pictures import draw, pictures_file
from .study import COMPARED, FILM, METHODS, NAME, SAMPLES, SHOWN, SIZE, jobs, read

WELL_LIT = 0.35
"""Cosine to the first light from which a pixel counts as well lit."""


def measure(settings: Settings, patterns: Sequence[str], *, missing: bool, deadline: float) -> None:
    """Measure scenes, and keep each as soon as it is done.

    Args:
        settings: Sizes and places.
        patterns: Of scenes' names.
        missing: Leave alone what is there.
        deadline: By `time.monotonic`, when to begin nothing new.
    """
    results = read()
    results["machine"] = machine()
    results["settings"] = {"size": SIZE, "samples": SAMPLES, "film": FILM, "level": settings.level}
    for cell, method in jobs(patterns):
        known = results.setdefault("references", {}).setdefault(method, {})
        if (missing and cell.name in known) or time.monotonic() > deadline:
            continue
        start = time.perf_counter()
        known[cell.name] = _measure(settings, cell, method)
        took = time.perf_counter() - start
        print(f"{cell.name}, {METHODS[method]}: {took:.0f} s", flush=True)
        write_results(NAME, rounded(results, 5))


def _measure(settings: Settings, cell: Cell, method: str) -> dict[str, Any]:
    """Render the reference and every contender, and return how far they are apart."""
    stage = Stage(cell, settings)
    usual = reference(stage, samples=SAMPLES) if method != RANDOM_WALK else None
    stage.use_method(method)
    truth = reference(stage, samples=SAMPLES, method=method)
    masks = stage.masks(truth.pictures)
    found: dict[str, Any] = {"contenders": {}}
    describe(found, stage, truth, masks)
    if usual is not None:
        found["apart"] = {name: rmse(usual.picture, truth.picture, mask)
                          for name, mask in masks.items()}  # fmt: skip
    pictures = {"reference": truth.picture}
    known = {one.name: one for one in CONTENDERS}
    for name in COMPARED:
        if name == SHADOWS:
            # What is judged was made for the walk, whatever the reference.
            stage.use_method(RANDOM_WALK)
        row, picture = run(stage, known[name], (FILM,), truth.picture, masks)[FILM]
        found["contenders"][name] = {
            "rmse": row["rmse"],
            "ssim": row["ssim"],
            "gain": best_gain(picture, truth.picture, masks["all"]),
            "shares": shares_of_error(stage, picture, truth.picture, masks),
        }
        pictures[name] = picture
        print(f"  {name}: {row['rmse']['all']:.4f} {row['rmse']['lit']:.4f}", flush=True)
    if cell in SHOWN and method == RANDOM_WALK:
        keep_pictures(pictures_file(settings, cell), pictures)
    return found


def best_gain(picture: Array, truth: Array, mask: Mask) -> dict[str, Any]:
    """Return the factors of red, green and blue that bring a picture closest, and its RMSE then."""
    ours, theirs = picture[..., :3], truth[..., :3]
    factor = (ours * theirs)[mask].sum(axis=0) / np.maximum((ours**2)[mask].sum(axis=0), 1e-12)
    return {"factor": factor.tolist(), "rmse": rmse(ours * factor, theirs, mask)}


def shares_of_error(
    stage: Stage, picture: Array, truth: Array, masks: dict[str, Mask]
) -> dict[str, list[float]]:
    """Return where the squared error is: each part's share of it, and of the pixels.

    Parts are what faces the first light well, the terminator and beyond, and what is in a cast
    shadow or at an open rim.
    """
    hits, normal = stage.geometry.hits, stage.geometry.normal
    cosine = np.full(stage.size**2, -1.0)
    cosine[hits.pixel] = (normal * directions(stage.lights[0], hits.position)).sum(axis=1)
    faces = cosine.reshape(masks["all"].shape) > WELL_LIT
    squared = ((picture - truth)[..., :3] ** 2).sum(axis=-1)
    parts = {
        "light": masks["lit"] & faces,
        "terminator": masks["lit"] & ~faces,
        "shadow": masks["all"] & ~masks["lit"],
    }
    total = max(float(squared[masks["all"]].sum()), 1e-12)
    count = max(int(masks["all"].sum()), 1)
    return {name: [float(squared[mask].sum()) / total, int(mask.sum()) / count]
            for name, mask in parts.items()}  # fmt: skip


def parse() -> argparse.Namespace:
    """Read the command line."""
    plain = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=plain)
    add = parser.add_argument
    add("--missing", action="store_true", help="leave alone what is there")
    add("--page", action="store_true", help="page and pictures from what is there")
    add("--cells", nargs="+", default=["*"], help="patterns of scenes, such as 'head, *'")
    add("--minutes", type=float, default=float("inf"), help="begin nothing new after so long")
    add("--cache", type=Path, default=ROOT / "output" / NAME, help="folder of references")
    return parser.parse_args()


def main() -> None:
    """Measure what is asked for, and write the page."""
    chosen = parse()
    settings = Settings(RESULTS, chosen.cache.resolve(), size=SIZE, samples=SAMPLES, film=FILM)
    deadline = time.monotonic() + 60.0 * chosen.minutes
    if not chosen.page:
        register()
        try:
            measure(settings, chosen.cells, missing=chosen.missing, deadline=deadline)
        finally:
            unregister()
    draw(settings)
    write_page(NAME, page(read()))


if __name__ == "__main__":
    main()
