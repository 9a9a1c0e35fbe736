# SPDX-License-Identifier: GPL-3.0-or-later
"""Thousands of random broken meshes: no crash, nothing infinite, no error that is not a sentence.

Of the first thousand of them, 252 kill a process that hands them to libigl as they are. The
environment variables CDRF_FUZZ_SEED and CDRF_FUZZ_COUNT choose others; the complete run is
`CDRF_FUZZ_SEED=777 CDRF_FUZZ_COUNT=20000 ./dev test tests/core/test_fuzz.py`, a minute and a half.
Run as a script with seed and count, this file is the process that may crash.
"""

import json
import math
import os
import subprocess
import sys
import time
import traceback
from pathlib import Path

import numpy as np

from cdrf_addon.core.curvature.clean import CleanMesh
from cdrf_addon.core.curvature.creases import NO_CREASE
from cdrf_addon.core.curvature.estimators import METHODS
from cdrf_addon.core.curvature.field import CleanCurvature, Options, curvature_steps
from cdrf_addon.core.curvature.scale_space import LEVELS, level_steps
from cdrf_addon.core.curvature.summary import summarise
from cdrf_addon.core.curvature.topology import shared_edges
from cdrf_addon.core.curvature.tri_mesh import TriMesh
from cdrf_addon.core.errors import CdrfError
from cdrf_addon.core.progress import run_steps

ROOT = Path(__file__).resolve().parents[2]
SEED = int(os.environ.get("CDRF_FUZZ_SEED", "20260722"))
COUNT = int(os.environ.get("CDRF_FUZZ_COUNT", "2000"))
# No mesh of sixty vertices may take longer; most take 5 ms.
SECONDS_EACH = 5.0
# Of the whole run: thirty times what a mesh takes, and half a minute to start.
SECONDS = 30.0 + 0.15 * COUNT

KINDS = [
    "normal",
    "rounded",
    "holes in space",
    "far away",
    "any scale",
    "planar",
    "doubled",
    "slivers",
    "float32 with an offset",
    "all over the scales",
]


def positions(rng: np.random.Generator, kind: str, count: int) -> np.ndarray:
    """Draw vertex positions of a kind of trouble."""
    points = rng.normal(size=(count, 3))
    if kind == "rounded":
        points = np.round(points * rng.choice((0.5, 1.0, 3.0)))
    elif kind == "holes in space":
        odd = rng.choice((np.nan, np.inf, -np.inf, 1e300, -1e300, 1e38, 0.0), points.shape)
        points = np.where(rng.random(points.shape) < rng.choice((0.02, 0.2, 0.9)), odd, points)
    elif kind == "far away":
        points += 10.0 ** rng.uniform(0.0, 16.0)
    elif kind == "any scale":
        points *= 10.0 ** rng.uniform(-200.0, 200.0)
    elif kind == "planar":
        points[:, rng.integers(3)] = rng.choice((0.0, 1.0, 1e-9))
    elif kind == "doubled":
        points = points[rng.integers(0, max(1, count // 3), count)] if count else points
    elif kind == "slivers":
        points *= 10.0 ** rng.uniform(-12.0, 0.0, 3)
    elif kind == "float32 with an offset":
        points = (points + 1e6).astype(np.float32).astype(np.float64)
    elif kind == "all over the scales":
        points *= 10.0 ** rng.uniform(-160.0, 160.0, (count, 1))
    return points


def faces(rng: np.random.Generator, count: int) -> np.ndarray:
    """Draw triangles: at random, a strip, a fan or a grid, some turned round, some left out."""
    style = rng.integers(4)
    if count < 3 or style == 0:
        wanted = rng.integers(0, 4 * count + 1) if count else 0
        drawn = rng.integers(0, max(count, 1), (wanted, 3))
    elif style == 1:
        drawn = np.arange(count - 2)[:, None] + np.arange(3)
        drawn[1::2] = drawn[1::2, ::-1]
    elif style == 2:
        rim = np.arange(1, count)
        drawn = np.stack((np.zeros_like(rim), rim, np.roll(rim, -1)), 1)
    else:
        columns = int(rng.integers(2, 9))
        at = np.arange(count - columns - 1)
        lower = np.stack((at, at + columns, at + columns + 1), 1)
        drawn = np.concatenate((lower, np.stack((at, at + columns + 1, at + 1), 1)))
        drawn = drawn[drawn.max(axis=1, initial=0) < count]
    drawn = np.where(rng.random((len(drawn), 1)) < rng.choice((0.0, 0.5)), drawn[:, ::-1], drawn)
    if rng.random() < 0.3:
        drawn = np.concatenate((drawn, drawn[rng.random(len(drawn)) < 0.5, ::-1]))
    return drawn[rng.random(len(drawn)) < rng.choice((0.5, 1.0))].reshape(-1, 3)


def draw(seed: int, number: int) -> tuple[str, np.ndarray, np.ndarray]:
    """Draw mesh `number`, which depends on no other, so that it can be drawn again alone."""
    rng = np.random.default_rng((seed, number))
    kind = KINDS[number % len(KINDS)]
    count = int(rng.integers(0, 61))
    return kind, positions(rng, kind, count), faces(rng, count)


def options_of(number: int) -> Options:
    """Vary how a mesh is measured, so that every kind of mesh meets every method."""
    turn = number // len(KINDS)
    method = list(METHODS)[turn % len(METHODS)]
    crease = NO_CREASE if turn % 3 else math.radians(1.0 + turn % 170)
    return Options(method, 2 + turn % 4, crease)


def judge(seed: int, number: int) -> str:
    """Compute the curvature of a mesh; return "fine", "refused" or what went wrong."""
    _, vertices, triangles = draw(seed, number)
    start = time.perf_counter()
    try:
        mesh = TriMesh.from_arrays(vertices, triangles)
        cleaned = run_steps(curvature_steps(mesh, options_of(number)))
        levels = run_steps(level_steps(cleaned)).kappa
        field = cleaned.on_source()
        summary = summarise(mesh, field)
    except CdrfError as refusal:
        text = str(refusal)
        return "refused" if text.endswith(".") and text[0].isupper() else f"no sentence: {text}"
    except Exception:  # noqa: BLE001  (whatever it is, it is the finding)
        return traceback.format_exc()
    seconds = time.perf_counter() - start
    values = np.stack((field.k1, field.k2, field.kappa, field.mean))
    if values.shape != (4, len(vertices)) or not np.isfinite(values).all():
        return "not finite"
    if not np.isfinite((summary.low, summary.median, summary.high, *summary.mean_values)).all():
        return "the summary is not finite"
    if not (values[0] >= values[1]).all():
        return "k1 is not the larger"
    if levels.values.shape != (len(vertices), LEVELS) or not np.isfinite(levels.values).all():
        return "a level is not finite"
    if not 0.0 <= levels.values.min(initial=0.0) <= levels.values.max(initial=0.0) <= top(cleaned):
        return "a level lies outside the curvature it comes from"
    if not field.kappa.any() and not field.sentences() and bends(cleaned.mesh):
        return "a silent zero"
    return "fine" if seconds < SECONDS_EACH else f"{seconds:.1f} s"


def top(cleaned: CleanCurvature) -> float:
    """Largest kappa of any part of the mesh, with room for the solver's residual."""
    kappa = np.hypot(cleaned.k1, cleaned.k2).max() / math.sqrt(2.0)
    return float(kappa) / cleaned.mesh.edge * (1.0 + 1e-2)


def bends(mesh: CleanMesh) -> bool:
    """Return whether two neighbouring faces, wound alike, meet at more than 5 degrees."""
    normals = mesh.face_normals
    unit = normals.scaled / normals.doubled_area
    edges = shared_edges(mesh.triangles, len(mesh.vertices))
    cosine = (unit[:, edges.face] * unit[:, edges.other]).sum(axis=0)
    # Folded flat on itself, a surface has no meaningful curvature either.
    return bool(((cosine < math.cos(math.radians(5.0))) & (cosine > -0.9)).any())


def work(seed: int, count: int) -> None:
    """Judge meshes, and print each one's number before it is tried, as the last words."""
    tally: dict[str, int] = {}
    for number in range(count):
        print(number, flush=True)
        outcome = judge(seed, number)
        tally[outcome] = tally.get(outcome, 0) + 1
        if outcome not in ("fine", "refused"):
            print(f"# {number} ({KINDS[number % len(KINDS)]}): {outcome}", file=sys.stderr)
    print(json.dumps(tally))


def test_random_meshes(record_property) -> None:
    done = subprocess.run(
        [sys.executable, "-X", "faulthandler", __file__, str(SEED), str(COUNT)],
        capture_output=True,
        text=True,
        check=False,
        timeout=SECONDS,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    last = done.stdout.rstrip().rpartition("\n")[2]
    assert done.returncode == 0, f"mesh {last} of seed {SEED}: {done.stderr}"
    tally = json.loads(last)
    record_property("tally", ", ".join(f"{count} {what}" for what, count in tally.items()))
    assert set(tally) == {"fine", "refused"}, done.stderr
    assert sum(tally.values()) == COUNT
    # A fuzzer that is only ever refused finds nothing.
    assert tally["fine"] >= COUNT // 2


if __name__ == "__main__":
    work(int(sys.argv[1]), int(sys.argv[2]))
