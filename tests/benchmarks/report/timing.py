# SPDX-License-Identifier: GPL-3.0-or-later
"""What a frame costs. Run it when the machine is quiet: `--timing`.

Everything is interleaved: in each round every contender has its turn, so that a drift of the
machine meets all alike, and reported is the ratio within a round. Each measurement is kept as it is
done; an interrupted run goes on where it stopped.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import bpy
import numpy as np
from surfaces import ALL_SURFACES

from cdrf_addon.measuring.process import measure as measure_spheres
from cdrf_addon.measuring.request import Request

from ..common.draws import drawer
from ..common.machine import machine
from ..common.shapes import mesh_of
from ..common.timing import Spent, spread, timed
from .cells import Cell
from .contenders import (
    CONTENDERS,
    CYCLES,
    DEFAULT,
    EEVEE,
    LAMBERT,
    LOOK,
    NODE,
    NUMPY,
    PATHS,
    PRINCIPLED,
    SHADOWS,
    SPHERE,
    TEXTURE,
    Contender,
)
from .settings import SEED, Settings
from .stage import Stage

CELL = Cell("head", "skin", "sun")
UNSHADOWED = "Lambert, no shadows"
RAYS = "CDRF sphere, coloured shadow edges"
TIMED = (LAMBERT, UNSHADOWED, "CDRF ring", SPHERE, LOOK, "CDRF profile", "CDRF measured", SHADOWS,
         DEFAULT, RAYS, NODE, PRINCIPLED, TEXTURE, PATHS)  # fmt: skip
TIMED_QUICK = (UNSHADOWED, SPHERE)
WITH_SHADOWS = {LAMBERT, SHADOWS, DEFAULT, RAYS, NODE, PRINCIPLED, PATHS, TEXTURE}
"""These are compared with Lambert under shadows, the others with Lambert without."""
SCALED = (UNSHADOWED, SPHERE, NODE)
PIXELS = (128, 256, 512, 1024)
LIGHTS = (1, 2, 4, 8)
VERTICES = (2_000, 20_000, 200_000)
QUICK_SIZES = {"pixels": (64, 128), "lights": (1,), "vertices": (2_000,)}
SIZES = {"pixels": PIXELS, "lights": LIGHTS, "vertices": VERTICES}
DRAWN = 512


def base_of(name: str) -> str:
    """What a contender's time is compared with."""
    return LAMBERT if name in WITH_SHADOWS else UNSHADOWED


def by_name(names: Iterable[str]) -> list[Contender]:
    """Contenders in the order of their names."""
    table = {one.name: one for one in CONTENDERS}
    return [table[name] for name in names]


def run(settings: Settings, rounds: int, parts: Sequence[str], deadline: float) -> None:
    """Time everything, so many rounds in all.

    Args:
        settings: Sizes and places.
        rounds: Of each part, those of earlier runs included.
        parts: Of PARTS.
        deadline: By `time.monotonic`, when to begin no other round.
    """
    results = settings.read("timing")
    results["machine"] = machine()
    for name in parts:
        known = results.setdefault(name, {"rounds": 0, "rows": {}})
        while known["rounds"] < rounds and time.monotonic() < deadline:
            print(f"{name}: round {known['rounds'] + 1} of {rounds}", flush=True)
            for _ in PARTS[name](settings, known):
                settings.write("timing", results)
            known["rounds"] += 1
            settings.write("timing", results)


def discard(settings: Settings, parts: Sequence[str]) -> None:
    """Throw away the rounds of earlier runs."""
    results = settings.read("timing")
    settings.write("timing", {name: part for name, part in results.items() if name not in parts})


def _keep(known: dict[str, Any], name: str, spent: dict[str, Spent]) -> None:
    """Add a contender's measurements of this round, all at once."""
    for point, one in spent.items():
        known["rows"].setdefault(name, {}).setdefault(point, []).append(one)


def _due(known: dict[str, Any], name: str, point: object) -> bool:
    """Return whether a measurement of this round is still to be done."""
    return len(known["rows"].get(name, {}).get(str(point), [])) <= known["rounds"]


def frames(settings: Settings, known: dict[str, Any]) -> Iterator[None]:
    """Final renders at several numbers of samples, after one that is thrown away."""
    cell = Cell("sphere", "skin", "sun") if settings.sample else CELL
    stage = Stage(cell, settings)
    known["cell"], known["size"] = cell.name, settings.size
    for contender in by_name(TIMED_QUICK if settings.sample else TIMED):
        if not _due(known, contender.name, "first"):
            continue
        few, many = settings.timed
        counts = {EEVEE: few, CYCLES: many, NUMPY: (1,)}[contender.engine]
        with contender.ready(stage) as render:
            spent = {"first": timed(partial(render, 1))}
            spent |= {str(count): timed(partial(render, count)) for count in counts}
        _keep(known, contender.name, spent)
        yield


def draws(settings: Settings, known: dict[str, Any]) -> Iterator[None]:
    """Viewport draws of one sample: steadier than renders, and what an artist works in."""
    stage = Stage(Cell("sphere", "skin", "sun") if settings.sample else CELL, settings)
    known["cell"], known["size"] = stage.cell.name, 64 if settings.sample else DRAWN
    draw = drawer(stage.rig, known["size"])
    for contender in by_name(TIMED_QUICK if settings.sample else TIMED):
        if contender.engine == EEVEE and _due(known, contender.name, "draw"):
            with contender.ready(stage):
                _keep(known, contender.name, _drawn("draw", draw))
            yield


def _drawn(point: object, draw: Callable[[], float]) -> dict[str, Spent]:
    """The first draw, and the quickest of the next three."""
    first = timed(draw)
    spent = [timed(draw) for _ in range(3)]
    return {f"first {point}": first, str(point): min(spent, key=lambda one: one["wall"])}


def _sizes(settings: Settings, name: str) -> tuple[int, ...]:
    return (QUICK_SIZES if settings.sample else SIZES)[name]


def _scaled(settings: Settings) -> list[Contender]:
    return by_name(TIMED_QUICK if settings.sample else SCALED)


def pixels(settings: Settings, known: dict[str, Any]) -> Iterator[None]:
    """Draws of growing pictures, without shadows."""
    stage = Stage(Cell("sphere", "skin", "sun"), settings)
    for contender in _scaled(settings):
        with contender.ready(stage), stage.without_shadows():
            for size in _sizes(settings, "pixels"):
                if _due(known, contender.name, size):
                    _keep(known, contender.name, _drawn(size, drawer(stage.rig, size)))
                    yield


def lights(settings: Settings, known: dict[str, Any]) -> Iterator[None]:
    """Draws under more and more suns, without shadows."""
    stage = Stage(Cell("torus", "skin", "sun"), settings)
    draw = drawer(stage.rig, DRAWN)
    for count in _sizes(settings, "lights"):
        for number in range(len(stage.lights), count):
            turn = (0.5 + 0.3 * number, 0.0, 1.7 * number)
            energy = math.pi / count
            sun = stage.rig.light("SUN", name=f"Sun {number}", energy=energy, rotation=turn)
            sun.data.angle = 0.0
        for contender in _scaled(settings):
            if _due(known, contender.name, count):
                with contender.ready(stage), stage.without_shadows():
                    _keep(known, contender.name, _drawn(count, draw))
                yield


def vertices(settings: Settings, known: dict[str, Any]) -> Iterator[None]:
    """Draws of, and preparation for, finer and finer meshes; without shadows."""
    for size in _sizes(settings, "vertices"):
        stage = Stage(Cell("torus", "skin", "sun"), settings)
        draw = drawer(stage.rig, DRAWN)
        surface = ALL_SURFACES["jittered torus"](size)
        stage.obj.data = mesh_of(surface.vertices, surface.triangles)
        stage.obj.data.shade_smooth()
        stage.assign(stage.scattering)
        spent = timed(bpy.ops.cdrf.setup)
        if _due(known, "Make Translucent", size):
            _keep(known, "Make Translucent", {str(size): spent})
        for contender in _scaled(settings):
            if _due(known, contender.name, size):
                with contender.ready(stage), stage.without_shadows():
                    _keep(known, contender.name, _drawn(size, draw))
                yield


def preparation(settings: Settings, known: dict[str, Any]) -> Iterator[None]:
    """What comes before the first frame of an untouched object."""
    stage = Stage(Cell("sphere", "skin", "sun") if settings.sample else CELL, settings)
    known["cell"], known["vertices"] = stage.cell.name, len(stage.obj.data.vertices)
    setup = timed(bpy.ops.cdrf.setup)
    if _due(known, SPHERE, "setup"):
        _keep(known, SPHERE, {"setup": setup})
        yield
    if not settings.sample and _due(known, "CDRF measured", "measure"):
        # In a folder of its own: what was measured once is kept and costs nothing.
        red, green, blue = stage.substance.albedo
        request = Request((red, green, blue), settings.quality, SEED)
        with TemporaryDirectory() as folder:
            measure = partial(measure_spheres, request, Path(folder))
            _keep(known, "CDRF measured", {"measure": timed(measure)})
        yield


PARTS: dict[str, Callable[[Settings, dict[str, Any]], Iterator[None]]] = {
    "draws": draws,
    "frames": frames,
    "preparation": preparation,
    "pixels": pixels,
    "lights": lights,
    "vertices": vertices,
}


# --- what is made of it --------------------------------------------------------------------------


def split(rows: dict[str, list[Spent]], clock: str = "wall") -> list[tuple[float, float]]:
    """Fixed cost and cost of a sample in each round, by a straight line through its renders."""
    counts = sorted(int(count) for count in rows if count.isdigit())
    seconds = np.array([[one[clock] for one in rows[str(count)]] for count in counts])
    if len(counts) < 2:
        return [(float(value), 0.0) for value in seconds[0]]
    slope, fixed = np.polyfit(counts, seconds, 1)
    return [(float(a), float(b)) for a, b in zip(fixed, slope, strict=True)]


def frame_seconds(timing: dict[str, Any], name: str, samples: int) -> float:
    """Median time of a frame: measured, else by its line; NaN if the contender was not timed."""
    rows = timing.get("frames", {}).get("rows", {}).get(name)
    if rows is None:
        return math.nan
    if str(samples) in rows:
        return spread(one["wall"] for one in rows[str(samples)])[0]
    return spread(max(fixed + slope * samples, 1e-3) for fixed, slope in split(rows))[0]


def ratios(one: Sequence[Spent], base: Sequence[Spent], clock: str = "wall") -> list[float]:
    """Times of one contender over those of another, round by round."""
    return [a[clock] / b[clock] for a, b in zip(one, base, strict=False)]


def power(points: Sequence[tuple[float, float]]) -> float:
    """Exponent with which a cost grows between its last two sizes."""
    (x0, y0), (x1, y1) = itertools.islice(points, len(points) - 2, None)
    return math.log(y1 / y0) / math.log(x1 / x0)
