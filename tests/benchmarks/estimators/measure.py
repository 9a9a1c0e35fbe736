# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures error, time and memory of estimators, and of the operator in Blender."""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from surfaces import ALL_SURFACES, noisy, torus

from cdrf_addon.core.curvature.tri_mesh import TriMesh

from .cases import CLICK, PARTS, QUANTITIES, SCALING_SURFACE, SEED, Config, estimate
from .processes import ChildFailedError, in_child, timed
from .results import Results, Row

# Runs go on, three at the most, until this many seconds are spent; the quickest counts.
PATIENCE = 0.3
SCALING_PATIENCE = 3.0
QUICK_PATIENCE = 0.1


def write_meshes(folder: Path, name: str, size: int, noises: Sequence[float]) -> dict[str, int]:
    """Make a surface and its noisy copies, as files that a measurement loads without waste."""
    surface = ALL_SURFACES[name](size)
    for noise in noises:
        # The seed follows from the noise, so that a run of some noises makes the same meshes.
        generator = np.random.default_rng((SEED, round(noise * 1e9)))
        moved = noisy(surface, noise, generator) if noise else surface
        np.save(folder / f"vertices {noise}.npy", moved.vertices)
    np.save(folder / "triangles.npy", surface.triangles)
    np.save(folder / "exact.npy", np.stack((surface.k1, surface.k2)))
    np.save(folder / "inner.npy", surface.inner)
    a, b, c = (surface.vertices[surface.triangles[:, corner]] for corner in range(3))
    upright = (np.cross(b - a, c - a) * surface.normals[surface.triangles[:, 0]]).sum(axis=1)
    return {
        "vertices": len(surface.vertices),
        "border": int((~surface.inner).sum()),
        "inverted": int((upright <= 0.0).sum()),
    }


def load_mesh(folder: Path, noise: float) -> TriMesh:
    """Load a mesh that `write_meshes` wrote."""
    return TriMesh.from_arrays(
        np.load(folder / f"vertices {noise}.npy"), np.load(folder / "triangles.npy")
    )


def measure(folder: Path, noise: float, config: Config, patience: float) -> dict[str, Any]:
    """Run one estimator on one mesh, and judge it; the exact values are loaded afterwards."""
    mesh = load_mesh(folder, noise)
    found, cost = timed(lambda: estimate(mesh, config), patience)
    k1, k2 = np.load(folder / "exact.npy")
    inner = np.load(folder / "inner.npy")
    kappa = np.sqrt((k1**2 + k2**2) / 2.0)
    exact = {"k1": k1, "k2": k2, "mean": (k1 + k2) / 2.0, "kappa": kappa}
    scale = math.sqrt(float((kappa**2).mean()))
    errors: dict[str, float] = {}
    for part, chosen in zip(PARTS, (inner, ~inner), strict=True):
        if chosen.any():
            for quantity in QUANTITIES:
                error = np.abs(getattr(found, quantity) - exact[quantity])[chosen] / scale
                errors[f"{part} {quantity} worst"] = float(error.max())
                errors[f"{part} {quantity} rms"] = math.sqrt(float((error**2).mean()))
    return {
        "vertices": len(mesh.vertices),
        "filled": int(found.filled.sum()),
        "errors": errors,
        **cost,
    }


def click(folder: Path) -> dict[str, Any]:
    """Measure the operator, from the click to the finished material, in Blender."""
    import bpy  # late: only this process may carry Blender
    from rig import Rig

    from cdrf_addon import register

    from ..common.shapes import mesh_of

    register()
    surface = load_mesh(folder, 0.0)
    rig = Rig()
    rig.light("SUN")
    rig.link(mesh_of(surface.vertices, surface.triangles)).select_set(True)
    bpy.context.view_layer.update()
    # Once only: the second time it would find nothing to do.
    outcome, cost = timed(bpy.ops.cdrf.setup, 0.0)
    if outcome != {"FINISHED"}:
        raise RuntimeError(f"the operator returned {outcome}")
    return {"vertices": len(surface.vertices), **cost}


def attempt(row: Row, call: Callable[..., dict[str, Any]], *arguments: Any) -> Row:
    """Measure in a child; a failure becomes part of the row."""
    try:
        return replace(row, **in_child(call, *arguments))
    except ChildFailedError as error:
        return replace(row, failure=str(error))


def is_there(row: Row, table: dict[tuple[Any, ...], Row]) -> bool:
    """Return whether a row was measured before, and did not fail."""
    return row.key in table and not table[row.key].failure


def measure_errors(
    results: Results,
    wanted: Iterable[Row],
    patience: float,
    missing: bool,
    save: Callable[[], None],
) -> None:
    """Measure rows, those of a mesh together; with `missing`, keep what was measured before."""
    jobs: dict[tuple[str, int], list[Row]] = {}
    for row in wanted:
        if not (missing and is_there(row, results.rows)):
            jobs.setdefault((row.surface, row.size), []).append(row)
    for (name, size), rows in jobs.items():
        start = time.perf_counter()
        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(temporary)
            noises = sorted({row.noise for row in rows})
            facts = in_child(write_meshes, folder, name, size, noises)
            results.meshes.setdefault(name, {})[str(size)] = facts
            for row in rows:
                arguments = folder, row.noise, (row.method, row.rings), patience
                results.rows[row.key] = attempt(row, measure, *arguments)
        save()
        spent = time.perf_counter() - start
        print(f"{name}, {size:,}: {len(rows)} measurements in {spent:.1f} s", flush=True)


def measure_scaling(
    results: Results,
    sizes: Sequence[int],
    configs: Sequence[Config],
    code: str,
    patience: float,
    missing: bool,
    save: Callable[[], None],
) -> None:
    """Measure the pipeline at more sizes, at the default radius, and the operator as a whole."""
    for size in sizes:
        start = time.perf_counter()
        chosen = [*configs, (CLICK, None)]
        rows = [Row(SCALING_SURFACE, size, 0.0, *config, code=code) for config in chosen]
        rows = [row for row in rows if not (missing and is_there(row, results.scaling))]
        if not rows:
            continue
        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(temporary)
            in_child(write_meshes, folder, SCALING_SURFACE, size, [0.0])
            for row in rows:
                if row.method == CLICK:
                    done = attempt(row, click, folder)
                else:
                    arguments = folder, 0.0, (row.method, row.rings), patience
                    done = attempt(row, measure, *arguments)
                results.scaling[row.key] = done
        save()
        print(f"scaling, {size:,}: {time.perf_counter() - start:.1f} s", flush=True)


def warm_up(configs: Iterable[Config]) -> None:
    """Load what the estimators load late, so that no fork pays for it."""
    small = torus(300)
    for config in configs:
        estimate(TriMesh.from_arrays(small.vertices, small.triangles), config)
