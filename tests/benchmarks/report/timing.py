# SPDX-License-Identifier: GPL-3.0-or-later
"""What a frame costs. Run it when the machine is quiet: `--timing`.

Everything is interleaved: in each round every contender has its turn, so that a drift of the
machine meets all alike, and what is told is the ratio within a round. Each round is kept as it is
done; a run that was broken off goes on where it stopped.
"""

from __future__ import annotations

import itertools
import math
import os
import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import bpy
import numpy as np
from machine import machine
from run import mesh_of, peak_megabytes, reset_peak
from surfaces import ALL_SURFACES

from node_groups import drawer

from .contenders import (
    CONTENDERS,
    CYCLES,
    DEFAULT,
    EEVEE,
    LAMBERT,
    NODE,
    NUMPY,
    PATHS,
    PRINCIPLED,
    SHADOWS,
    TEXTURE,
    Contender,
    cdrf,
)
from .scenes import Cell, Stage
from .settings import SEED, Settings

CELL = Cell("head", "skin", "sun")
UNSHADOWED = "Lambert, no shadows"
RAYS = "CDRF sphere, coloured shadow edges"
TIMED = (LAMBERT, UNSHADOWED, "CDRF ring", DEFAULT, "CDRF profile", "CDRF measured", SHADOWS, RAYS,
         NODE, PRINCIPLED, TEXTURE, PATHS)  # fmt: skip
TIMED_QUICK = (UNSHADOWED, DEFAULT)
WITH_SHADOWS = {LAMBERT, SHADOWS, RAYS, NODE, PRINCIPLED, PATHS, TEXTURE}
"""These are compared with Lambert under shadows, the others with Lambert without."""
SCALED = (UNSHADOWED, DEFAULT, NODE)
PIXELS = (128, 256, 512, 1024)
LIGHTS = (1, 2, 4, 8)
VERTICES = (2_000, 20_000, 200_000)
QUICK_SIZES = {"pixels": (64, 128), "lights": (1,), "vertices": (2_000,)}
SIZES = {"pixels": PIXELS, "lights": LIGHTS, "vertices": VERTICES}
DRAWN = 256

Spent = dict[str, float]


def base_of(name: str) -> str:
    """What a contender's time is compared with."""
    return LAMBERT if name in WITH_SHADOWS else UNSHADOWED


def timed(call: Callable[[], Any]) -> Spent:
    """Seconds on the clock, seconds of all cores, and megabytes more at the peak."""
    before, start = os.times(), time.perf_counter()
    memory = reset_peak()
    call()
    after = os.times()
    cpu = after.user + after.system - before.user - before.system
    return {"wall": time.perf_counter() - start, "cpu": cpu,
            "megabytes": peak_megabytes() - memory}  # fmt: skip


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
            PARTS[name](settings, known)
            known["rounds"] += 1
            settings.write("timing", results)


def forget(settings: Settings, parts: Sequence[str]) -> None:
    """Throw away the rounds of earlier runs."""
    results = settings.read("timing")
    settings.write("timing", {name: part for name, part in results.items() if name not in parts})


def _keep(known: dict[str, Any], name: str, point: object, spent: Spent) -> None:
    """Add a round's measurement. A round that was broken off was never written."""
    known["rows"].setdefault(name, {}).setdefault(str(point), []).append(spent)


def frames(settings: Settings, known: dict[str, Any]) -> None:
    """Final renders at several numbers of samples, after one that is thrown away."""
    cell = Cell("sphere", "skin", "sun") if settings.sample else CELL
    stage = Stage(cell, settings)
    known["cell"], known["size"] = cell.name, settings.size
    for contender in by_name(TIMED_QUICK if settings.sample else TIMED):
        few, many = settings.timed
        counts = {EEVEE: few, CYCLES: many, NUMPY: (1,)}[contender.engine]
        with contender.ready(stage) as render:
            first = timed(lambda render=render: render(1))  # type: ignore[misc]
            _keep(known, contender.name, "first", first)
            for count in counts:
                spent = timed(lambda render=render, count=count: render(count))  # type: ignore[misc]
                _keep(known, contender.name, count, spent)


def draws(settings: Settings, known: dict[str, Any]) -> None:
    """Viewport draws of one sample: steadier than renders, and what an artist works in."""
    stage = Stage(Cell("sphere", "skin", "sun") if settings.sample else CELL, settings)
    known["cell"], known["size"] = stage.cell.name, 64 if settings.sample else DRAWN
    draw = drawer(stage.rig, known["size"])
    wanted = by_name(TIMED_QUICK if settings.sample else TIMED)
    for contender in wanted:
        if contender.engine != EEVEE:
            continue
        with contender.ready(stage):
            _draw_twice(known, contender.name, "draw", draw)


def _draw_twice(known: dict[str, Any], name: str, point: object, draw: Callable[[], float]) -> None:
    _keep(known, name, f"first {point}", timed(draw))
    spent = [timed(draw) for _ in range(3)]
    _keep(known, name, point, min(spent, key=lambda one: one["wall"]))


def _sizes(settings: Settings, name: str) -> tuple[int, ...]:
    return (QUICK_SIZES if settings.sample else SIZES)[name]


def _scaled(settings: Settings) -> list[Contender]:
    return by_name(TIMED_QUICK if settings.sample else SCALED)


def pixels(settings: Settings, known: dict[str, Any]) -> None:
    """Draws of growing pictures."""
    stage = Stage(Cell("sphere", "skin", "sun"), settings)
    for contender in _scaled(settings):
        with contender.ready(stage):
            for size in _sizes(settings, "pixels"):
                _draw_twice(known, contender.name, size, drawer(stage.rig, size))


def lights(settings: Settings, known: dict[str, Any]) -> None:
    """Draws under more and more suns that cast no shadows."""
    stage = Stage(Cell("torus", "skin", "sun"), settings)
    draw = drawer(stage.rig, DRAWN)
    for light in stage.lights:
        light.data.use_shadow = False
    for count in _sizes(settings, "lights"):
        for number in range(len(stage.lights), count):
            turn = (0.5 + 0.3 * number, 0.0, 1.7 * number)
            energy = math.pi / count
            sun = stage.rig.light("SUN", name=f"Sun {number}", energy=energy, rotation=turn)
            sun.data.angle = 0.0
        for contender in _scaled(settings):
            with contender.ready(stage):
                for light in stage.lights:
                    light.data.use_shadow = False
                _draw_twice(known, contender.name, count, draw)


def vertices(settings: Settings, known: dict[str, Any]) -> None:
    """Draws of, and preparation for, finer and finer meshes."""
    for size in _sizes(settings, "vertices"):
        stage = Stage(Cell("torus", "skin", "sun"), settings)
        draw = drawer(stage.rig, DRAWN)
        stage.item.data = mesh_of(ALL_SURFACES["jittered torus"](size))
        stage.item.data.shade_smooth()
        stage.wear(stage.wax)
        spent = timed(bpy.ops.cdrf.setup)
        _keep(known, "Make Translucent", size, spent)
        for contender in _scaled(settings):
            with contender.ready(stage):
                _draw_twice(known, contender.name, size, draw)


def preparation(settings: Settings, known: dict[str, Any]) -> None:
    """What comes before the first frame of an untouched object."""
    stage = Stage(Cell("sphere", "skin", "sun") if settings.sample else CELL, settings)
    known["cell"], known["vertices"] = stage.cell.name, len(stage.item.data.vertices)
    _keep(known, DEFAULT, "setup", timed(bpy.ops.cdrf.setup))
    for model in ("RING", "PROFILE"):

        def choose(model: str = model) -> None:
            with cdrf(stage, model):
                pass

        _keep(known, f"CDRF {model.lower()}", "model", timed(choose))
    if not settings.sample:
        # Another seed each time: what was measured once is kept and costs nothing.
        seed = SEED + 1 + known["rounds"]
        quality = settings.quality
        _keep(known, "CDRF measured", "measure",
              timed(lambda: bpy.ops.cdrf.measure(quality=quality, seed=seed)))  # fmt: skip


PARTS: dict[str, Callable[[Settings, dict[str, Any]], None]] = {
    "draws": draws,
    "frames": frames,
    "preparation": preparation,
    "pixels": pixels,
    "lights": lights,
    "vertices": vertices,
}


# --- what is made of it --------------------------------------------------------------------------


def spread(values: Iterable[float]) -> tuple[float, float, float]:
    """Median, 10 % and 90 %."""
    low, middle, high = np.percentile(list(values), (10, 50, 90))
    return float(middle), float(low), float(high)


def split(rows: dict[str, list[Spent]], clock: str = "wall") -> list[tuple[float, float]]:
    """Fixed cost and cost of a sample in each round, by a straight line through its renders."""
    counts = sorted(int(count) for count in rows if count.isdigit())
    seconds = np.array([[one[clock] for one in rows[str(count)]] for count in counts])
    if len(counts) < 2:
        return [(float(value), 0.0) for value in seconds[0]]
    slope, fixed = np.polyfit(counts, seconds, 1)
    return [(float(a), float(b)) for a, b in zip(fixed, slope, strict=True)]


def frame_seconds(timing: dict[str, Any], name: str, samples: int) -> float:
    """Median time of a frame of so many samples; NaN if it was not timed."""
    rows = timing.get("frames", {}).get("rows", {}).get(name)
    if rows is None:
        return math.nan
    return spread(max(fixed + slope * samples, 1e-3) for fixed, slope in split(rows))[0]


def ratios(one: Sequence[Spent], base: Sequence[Spent], clock: str = "wall") -> list[float]:
    """Times of one contender over those of another, round by round."""
    return [a[clock] / b[clock] for a, b in zip(one, base, strict=False)]


def power(points: Sequence[tuple[float, float]]) -> float:
    """Exponent with which a cost grows between its last two sizes."""
    (x0, y0), (x1, y1) = itertools.islice(points, len(points) - 2, None)
    return math.log(y1 / y0) / math.log(x1 / x0)
