# SPDX-License-Identifier: GPL-3.0-or-later
"""Error of every contender on every cell of shapes, materials and lights, kept as it comes in."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import Array, Mask
from ..common.machine import machine
from ..common.memory import peak_megabytes, reset_peak
from .cells import CELLS, FIRST, Cell
from .contenders import (
    CONTENDERS,
    LAMBERT,
    PRINCIPLED,
    SPHERE,
    Contender,
    chosen,
    row_name,
)
from .metrics import rmse, ssim
from .reference import Reference, reference
from .settings import Settings
from .stage import Stage

SAMPLE_CELLS = [Cell("torus", "milk", "sun"), Cell("head", "skin", "sun")]
BOUNCES = 12


def wanted_cells(settings: Settings, patterns: Sequence[str] = ("*",)) -> list[Cell]:
    """Cells to measure, the most telling first."""
    cells = SAMPLE_CELLS if settings.sample else CELLS
    return [cell for cell in cells if any(fnmatch(cell.name, one) for one in patterns)]


def contenders_of(settings: Settings, cell: Cell) -> list[tuple[Contender, tuple[int, ...]]]:
    """What is measured in a cell, with the samples."""
    return chosen(sample=settings.sample, survey=cell not in FIRST)


def measured_cells(settings: Settings) -> dict[str, Any]:
    """Results of the cells that have any, the most telling first."""
    known = settings.read("errors").get("cells", {})
    names = [cell.name for cell in wanted_cells(settings)]
    return {name: known[name] for name in names if known.get(name, {}).get("contenders")}


def pictures_path(settings: Settings, cell: Cell) -> Path:
    """Where the contenders' pictures of a cell are kept until they are drawn."""
    name = cell.name.replace(", ", "_").replace(" ", "")
    sort = "sample" if settings.sample else "full"
    return settings.cache / "pictures" / sort / f"{name}.npz"


def measure(
    settings: Settings,
    patterns: Sequence[str] = ("*",),
    contenders: Sequence[str] = ("*",),
    *,
    missing: bool = False,
    deadline: float = float("inf"),
) -> None:
    """Measure cells, and keep each contender as soon as it is done.

    Args:
        settings: Sizes and places.
        patterns: Of cells' names.
        contenders: Patterns of contenders' names.
        missing: Leave alone what is there.
        deadline: By `time.monotonic`, when to begin nothing new.
    """
    results = settings.read("errors")
    results["machine"] = machine()
    results["settings"] = {name: getattr(settings, name) for name in
                           ("size", "samples", "film", "level", "atlas")}  # fmt: skip
    cells = results.setdefault("cells", {})
    for cell in wanted_cells(settings, patterns):
        known = cells.setdefault(cell.name, {"contenders": {}})
        todo = [one for one in contenders_of(settings, cell)
                if any(fnmatch(one[0].name, pattern) for pattern in contenders)
                and not (missing and _complete(known, *one))]  # fmt: skip
        if not todo or time.monotonic() > deadline:
            continue
        _measure_cell(settings, cell, known, todo, deadline, results)


def _complete(known: dict[str, Any], contender: Contender, samples: tuple[int, ...]) -> bool:
    rows = known["contenders"]
    return all(row_name(contender.name, samples, count) in rows for count in samples or (0,))


def _measure_cell(
    settings: Settings,
    cell: Cell,
    known: dict[str, Any],
    todo: Iterable[tuple[Contender, tuple[int, ...]]],
    deadline: float,
    results: dict[str, Any],
) -> None:
    start = time.perf_counter()
    stage = Stage(cell, settings)
    truth = reference(stage)
    masks = stage.masks(truth.pictures)
    describe(known, stage, truth, masks)
    print(f"{cell.name}: reference {time.perf_counter() - start:.0f} s", flush=True)
    pictures = {"reference": truth.picture}
    for contender, samples in todo:
        if time.monotonic() > deadline:
            break
        reason = contender.missing(stage)
        if reason:
            for count in samples or (0,):
                name = row_name(contender.name, samples, count)
                known["contenders"][name] = {"missing": reason}
            continue
        found = run(stage, contender, samples or (settings.film,), truth.picture, masks)
        for count, (row, picture) in found.items():
            name = row_name(contender.name, samples, count)
            known["contenders"][name] = row
            pictures[name] = picture
            shown = f"{row['rmse']['all']:.4f} {row['rmse']['lit']:.4f} {row['ssim']['all']:.4f}"
            print(f"  {name}: {shown} {row['seconds']:.1f} s", flush=True)
        settings.write("errors", results)
        keep_pictures(pictures_path(settings, cell), pictures)


def describe(known: dict[str, Any], stage: Stage, truth: Reference, masks: dict[str, Mask]) -> None:
    """Facts of a cell."""
    known["vertices"] = len(stage.obj.data.vertices)
    known["pixels"] = {name: int(mask.sum()) for name, mask in masks.items()}
    known["floor"] = {name: truth.floor(mask) for name, mask in masks.items()}
    known["mean"] = float(truth.picture[masks["all"]][:, :3].mean())
    known["reference seconds"] = truth.seconds
    known["sigma0"] = stage.sigma0.tolist()
    known["millimetres"] = stage.millimetres


def run(
    stage: Stage,
    contender: Contender,
    samples: Sequence[int],
    truth: Array,
    masks: dict[str, Mask],
) -> dict[int, tuple[dict[str, Any], Array]]:
    """Prepare a contender and measure it at each number of samples."""
    found = {}
    start = time.perf_counter()
    with contender.ready(stage) as render:
        preparation = time.perf_counter() - start
        for count in samples:
            before = reset_peak()
            start = time.perf_counter()
            picture = render(count)
            row = {
                "date": time.strftime("%Y-%m-%d"),
                "samples": count,
                "seconds": time.perf_counter() - start,
                "preparation": preparation,
                "megabytes": peak_megabytes() - before,
                "rmse": {name: rmse(picture, truth, mask) for name, mask in masks.items()},
                "ssim": {name: ssim(picture, truth, mask) for name, mask in masks.items()},
            }
            found[count] = row, picture
    return found


def keep_pictures(path: Path, pictures: dict[str, Array]) -> None:
    """Add pictures to those that are kept of a cell."""
    kept = load_pictures(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    new = {name: picture[..., :4].astype(np.float16) for name, picture in pictures.items()}
    np.savez_compressed(path, allow_pickle=False, **{**kept, **new})


def load_pictures(path: Path) -> dict[str, NDArray[Any]]:
    """Pictures of a cell, by contender; none where none are kept."""
    if not path.exists():
        return {}
    with np.load(path) as file:
        return {name: file[name] for name in file.files}


def bounces(settings: Settings) -> None:
    """How much light from surface to surface would change, which no contender but Cycles has."""
    cell = SAMPLE_CELLS[-1]
    stage = Stage(cell, settings)
    without, with_them = reference(stage), reference(stage, BOUNCES)
    masks = stage.masks([*without.pictures, *with_them.pictures])
    results = settings.read("errors")
    results["bounces"] = {
        "cell": cell.name,
        "bounces": BOUNCES,
        "rmse": {name: rmse(without.picture, with_them.picture, mask)
                 for name, mask in masks.items()},
    }  # fmt: skip
    settings.write("errors", results)


def sun_taken_out(settings: Settings) -> None:
    """What Blender's default of taking a sun out of a world's picture does to EEVEE's frames."""
    cell = Cell("sphere" if settings.sample else "head", "skin", "HDRI")
    stage = Stage(cell, settings)
    truth = reference(stage)
    masks = stage.masks(truth.pictures)
    world = stage.scene.world
    found: dict[str, list[float]] = {}
    for threshold in (0.0, type(world).bl_rna.properties["sun_threshold"].default):
        world.sun_threshold = threshold
        for contender in (one for one in CONTENDERS if one.name in (LAMBERT, PRINCIPLED, SPHERE)):
            rows = run(stage, contender, (settings.film,), truth.picture, masks)
            found.setdefault(contender.name, []).append(rows[settings.film][0]["rmse"]["all"])
    results = settings.read("errors")
    results["sun taken out"] = {"cell": cell.name, "rmse": found}
    settings.write("errors", results)


EXTRAS: dict[str, Callable[[Settings], None]] = {
    "bounces": bounces,
    "sun taken out": sun_taken_out,
}
"""What is measured in one scene to put the others in their place."""
