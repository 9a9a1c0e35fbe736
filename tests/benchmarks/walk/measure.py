# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors of the model as it ships, and what fewer numbers would miss."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterable
from typing import Any

import numpy as np

from cdrf_addon.core.walk import view
from cdrf_addon.core.walk.flat import flat_fit, flat_gain
from cdrf_addon.core.walk.medium import medium
from cdrf_addon.core.walk.sphere_walk import ACROSS, ALONG, HOLLOW

from ..common.files import MESHES
from .tables import (
    COLOURS,
    CURVED,
    ENTRIES,
    HOLLOWED,
    Coefficients,
    Form,
    Walked,
    error_of,
    fit_shape,
    noise_of,
    walk_all,
)

# Cycles 5.2 planes at roughness 1 and index 1.4, rendered without a denoiser; their noise is 0.002.
PLANE_MU = (0.275, 0.425, 0.575, 0.725)
PLANES = {
    0.34: (1.169, 1.089, 1.021, 0.956),
    0.43: (1.142, 1.077, 1.019, 0.964),
    0.62: (1.090, 1.051, 1.014, 0.978),
}
CYLINDERS = np.array([0.02, 0.05, 0.1, 0.2])
# Curvedness of a cylinder is sqrt(1/2) of a sphere's, its mean curvature half.
FORMS = {
    ACROSS: Form(0.5, math.sqrt(0.5), 1.0),
    ALONG: Form(0.5, math.sqrt(0.5), 0.0),
}
H_ALONE = Form(0.5, math.sqrt(0.5), 0.5)


def independent() -> dict[str, Any]:
    """Walks of another program and seed, without an end (tests/data/walk_spheres.json)."""
    found: dict[str, Any] = json.loads((MESHES / "walk_spheres.json").read_text(encoding="utf-8"))
    return found


def spheres(data: dict[str, Any]) -> list[dict[str, float]]:
    """RMS over A against the independent walks, the noise taken off; Lambert's beside it."""
    normals, lights = np.array(data["normals"]), np.array(data["lights"])
    lambert = np.maximum(normals @ lights.T, 0.0)
    model = view.walk_model("RANDOM_WALK", 1.0, 1.4, bounces=math.inf)
    rows = []
    for case in data["spheres"]:
        a, size = case["colour"], np.array([case["curved"]])
        own = model.radiance(
            np.array([a]), normals[:, None], np.array([0.0, -1.0, 0.0]), lights, size, size
        )[..., 0]
        row = {"colour": a, "curved": case["curved"], "noise": case["noise"] / a}
        for name, shown in (("error", own), ("lambert", a * lambert)):
            square = ((shown - np.array(case["shown"])) ** 2).mean() - case["noise"] ** 2
            row[name] = math.sqrt(max(square, 0.0)) / a
        rows.append(row)
    return rows


def rms(rows: Iterable[dict[str, float]], curved: Iterable[float]) -> float:
    """Root mean square of the errors of some curvatures."""
    chosen = [row["error"] ** 2 for row in rows if row["curved"] in set(curved)]
    return math.sqrt(sum(chosen) / len(chosen))


def planes() -> dict[str, Any]:
    """G by quadrature and as the shader has it, against rendered planes."""
    found = {}
    model = view.walk_model("RANDOM_WALK", 1.0, 1.4)
    for a, rendered in PLANES.items():
        exact = flat_gain(PLANE_MU, medium("RANDOM_WALK", [a], 1.0))[:, 0]
        found[str(a)] = {
            "rendered": list(rendered),
            "exact": exact.tolist(),
            "fit": model.gain(a, np.array(PLANE_MU)).tolist(),
        }
    return found


def bodies(walks: int, seed: int) -> dict[str, Any]:
    """Errors on cylinders and hollows, by (x, a), at roughness 1 and index 1.4."""
    result: dict[str, Any] = {"colours": COLOURS.tolist()}
    for body, form in FORMS.items():
        walked = walk_all(body, CYLINDERS, ENTRIES[0], walks, seed)
        result[body] = {
            "curved": CYLINDERS.tolist(),
            "error": error_of(walked, ENTRIES[0], CYLINDERS, form).tolist(),
            "mean curvature alone": error_of(walked, ENTRIES[0], CYLINDERS, H_ALONE).tolist(),
            "noise": noise_of(walked).tolist(),
        }
    walked = walk_all(HOLLOW, HOLLOWED, ENTRIES[0], max(walks // 4, 100), seed + 1)
    result[HOLLOW] = {
        "curved": (-HOLLOWED).tolist(),
        "error": error_of(walked, ENTRIES[0], HOLLOWED, Form(-1.0, 1.0, -1.0)).tolist(),
        "noise": noise_of(walked).tolist(),
    }
    return result


def judged(balls: list[Walked]) -> list[dict[str, Any]]:
    """Errors on balls, by roughness and index."""
    return [
        {
            "alpha": entry[0],
            "ior": entry[1],
            "colours": COLOURS.tolist(),
            "curved": CURVED.tolist(),
            "error": error_of(walked, entry, CURVED).tolist(),
            "noise": noise_of(walked).tolist(),
        }
        for walked, entry in zip(balls, ENTRIES, strict=True)
    ]


def knee(balls: list[Walked], data: dict[str, Any]) -> list[dict[str, Any]]:
    """Numbers against error: each step fitted to the first entry's balls, judged on other walks."""
    shipped = Coefficients.current()
    no_gain = (0.0,) * 7 + shipped.values["GAIN"][7:]
    no_haze = (0.0, 0.0, *shipped.values["HAZE"][2:])
    flat = shipped.changed(TILT=(0.0,) * 6, HAZE=no_haze, GAIN=no_gain, ENDED=(0.0,))
    energy = {name: shipped.values[name] for name in ("GAIN", "ENDED")}
    shape = {name: shipped.values[name] for name in ("TILT", "HAZE")}
    few = {"TILT": (0.9, *(0.0,) * 5), "HAZE": (0.1, 0.0, 0.0, shipped.values["HAZE"][3])}
    steps: list[tuple[str, Coefficients, list[int], int]] = [
        ("width", flat, [*range(8)], 8),
        ("width, energy", flat.changed(**energy), [*range(8)], 18),
        (
            "width, energy, tilt of one number",
            flat.changed(**energy, TILT=few["TILT"]),
            [*range(9)],
            19,
        ),
        ("width, energy, tilt", flat.changed(**energy, TILT=shape["TILT"]), [*range(14)], 24),
        (
            "width, energy, tilt, haze of two numbers",
            flat.changed(**energy, TILT=shape["TILT"], HAZE=few["HAZE"]),
            [*range(15), 17],
            26,
        ),
        ("all, fitted here", shipped, [*range(18)], 28),
    ]
    rows = []
    try:
        for name, start, free, count in steps:
            start.put()
            fit_shape(balls[:1], np.isin(np.arange(18), free), 12, 5)
            rows.append({"name": name, "numbers": count, **summary(spheres(data))})
    finally:
        shipped.put()
    rows.append({"name": "all, as it ships", "numbers": 28, **summary(spheres(data))})
    return rows


def summary(rows: list[dict[str, float]]) -> dict[str, float]:
    """Errors over all colours by range of curvature."""
    return {
        "to 0.1": rms(rows, (0.01, 0.02, 0.05, 0.1)),
        "0.2": rms(rows, (0.2,)),
        "0.3": rms(rows, (0.3,)),
    }


def flat_time() -> float:
    """Seconds of a fit of the flat limit, as a material of a new roughness needs one."""
    flat_fit.cache_clear()
    start = time.perf_counter()
    for alpha in (0.31, 0.52, 0.73):
        flat_fit(alpha=alpha)
    return (time.perf_counter() - start) / 3.0
