# SPDX-License-Identifier: GPL-3.0-or-later
"""The measured model and the fits of sigma0: docs/results/measured.md.

    ./dev bench measured                everything, about ten minutes on two cores
    ./dev bench measured --only fits    one part, or several
    ./dev bench measured --only         the page from the JSON
    ./dev bench measured --fine         also the time of the fine quality

Measurements are kept in the folder given by --cache and used again; only those
rendered in this run are timed, and the earlier ones stay in the JSON.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdrf_addon.core.measured.fitting import MODELS, ModelFitter
from cdrf_addon.core.measured.material_fit import fit_material
from cdrf_addon.core.measured.measurement import SphereMeasurement, equator_weights
from cdrf_addon.core.measured.model import MeasuredModel
from cdrf_addon.measuring.cache import cached
from cdrf_addon.measuring.process import measure
from cdrf_addon.measuring.request import QUALITIES, Request

from .common.files import read_results, rounded, write_page, write_results
from .common.machine import machine
from .common.markdown import facts, generated, table

Array = NDArray[np.float64]
Albedo = tuple[float, float, float]

SETS: tuple[Albedo, ...] = ((0.5, 0.8, 0.9), (0.95, 0.97, 0.99), (0.1, 0.2, 0.3), (0.4, 0.6, 0.7))
TABLE_ALBEDOS = (0.5, 0.8, 0.9, 0.95, 0.99)
# Scales of the page, rows of the measured tables: 0.02 to 3.
TABLE_SCALES = (0.022097, 0.044194, 0.088388, 0.176777, 0.5, 1.0, 2.828427)
FRESH_SEED = 77
TIMED_SEED = 1
OFF_ROWS = (0.03, 0.07, 0.15, 0.33, 0.9, 1.8)
SKIN: Albedo = (0.8, 0.5, 0.4)
RATIO = (1.0, 0.35, 0.2)
ELEVATIONS = (0.0, 45.0, 89.0)
VIEW_SCALES = (0.01, 0.1, 1.0)


class Study:
    """Measures through the cache, and notes the time of what was rendered."""

    def __init__(self, cache: Path) -> None:
        self.cache = cache
        self.seconds: dict[str, dict[str, float]] = {}

    def get(self, request: Request) -> SphereMeasurement:
        """Measure, or take from the cache."""
        request = request.complete()
        if (found := cached(request, self.cache)) is not None:
            return found
        start, before = time.perf_counter(), os.times()
        found = measure(request, self.cache)
        after = os.times()
        cpu = after.children_user + after.children_system
        cpu -= before.children_user + before.children_system
        if request.radius == (1.0, 1.0, 1.0) and len(request.scales) > 20:
            wall = time.perf_counter() - start
            self.seconds[request.quality] = {"wall": wall, "cpu": cpu}
        print(request.albedo, request.quality, f"{time.perf_counter() - start:.0f} s", flush=True)
        return found


def rms_without_noise(difference: Array, errors: Array, weights: Array) -> float:
    """Return the RMS without the part that the reference's Monte-Carlo error has in it."""
    return float(np.sqrt(max(((difference**2 - errors**2) * weights).sum(), 0.0)))


def tables(study: Study) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Fits of all albedos: rows of the fit table, and sigma0 against albedo."""
    rows, slopes = [], []
    for albedo in SETS:
        measurement = study.get(Request(albedo))
        fit, model = fit_material(measurement), MeasuredModel(measurement)
        weights = equator_weights(measurement.theta)
        for number, channel in enumerate(fit.channels):
            slopes.append(
                {
                    "albedo": channel.albedo,
                    "sigma0_per_radius": channel.sigma0,
                    "proportional_to_scale": {
                        name: end if np.isfinite(end) else None
                        for name, end in channel.proportional_to.items()
                    },
                    "least_scale_gain": channel.free["sphere"][0].gain,
                }
            )
            if channel.albedo not in TABLE_ALBEDOS:
                continue
            for wanted in TABLE_SCALES:
                row = int(np.abs(np.log(fit.scales / wanted)).argmin())
                smooth = model.curves[row][number](measurement.theta)
                left = smooth - measurement.values[row, number]
                rows.append(
                    {
                        "albedo": channel.albedo,
                        "scale": float(fit.scales[row]),
                        "lambert": channel.lambert[row],
                        "noise": channel.noise[row],
                        "measured": float(np.sqrt((left**2 * weights).sum())),
                        "energy": float(measurement.energy()[row, number]),
                        **{
                            f"{name} {kind}": vars(fits[name][row])
                            for name in MODELS
                            for kind, fits in (("fixed", channel.fixed), ("free", channel.free))
                        },
                    }
                )
    rows.sort(key=lambda row: (row["albedo"], row["scale"]))
    return rows, sorted(slopes, key=lambda entry: entry["albedo"])


def off_rows(study: Study) -> list[dict[str, Any]]:
    """Error of the models on spheres that are in no table, with another seed."""
    found = []
    for albedo, radius in (((0.5, 0.8, 0.9), (1.0, 1.0, 1.0)), (SKIN, RATIO)):
        model = MeasuredModel(study.get(Request(albedo)), radius)
        fresh = study.get(Request(albedo, "fine", FRESH_SEED, OFF_ROWS, radius))
        weights = equator_weights(fresh.theta)
        fitters = {name: ModelFitter(name, fresh.theta, weights) for name in MODELS}
        for row, scale in enumerate(fresh.scales):
            width = np.full_like(fresh.theta, model.sigma_per_scale * scale)
            values = model.evaluate(fresh.theta, width)
            for channel in range(3):
                truth, errors = fresh.values[row, channel], fresh.errors[row, channel]
                lambert = np.maximum(fresh.cosine, 0.0) - truth
                found.append(
                    {
                        "albedo": albedo[channel],
                        "radius": radius[channel],
                        "scale": float(scale),
                        "measured": rms_without_noise(values[:, channel] - truth, errors, weights),
                        "noise": float(np.sqrt((errors**2 * weights).sum())),
                        "lambert": rms_without_noise(lambert, errors, weights),
                        **{name: one.fit(truth).rms for name, one in fitters.items()},
                    }
                )
    return found


def views(study: Study) -> list[dict[str, Any]]:
    """Radiance of equal N.L from other directions, against that with the light from the side."""
    albedo = SETS[0]
    measured = {
        elevation: study.get(
            Request(albedo, "default", 5, VIEW_SCALES, elevation=float(np.radians(elevation)))
        )
        for elevation in ELEVATIONS
    }
    side = measured[ELEVATIONS[0]]
    found = []
    for elevation in ELEVATIONS[1:]:
        other = measured[elevation]
        within = (other.cosine > side.cosine[0]) & (other.cosine < side.cosine[-1])
        within &= other.cosine > 0.3
        for row, scale in enumerate(VIEW_SCALES):
            for channel in range(3):
                there = np.interp(other.cosine, side.cosine, side.values[row, channel])
                ratio = other.values[row, channel][within] / there[within]
                found.append(
                    {
                        "elevation": elevation,
                        "albedo": albedo[channel],
                        "scale": scale,
                        "least": float(ratio.min()),
                        "mean": float(ratio.mean()),
                        "most": float(ratio.max()),
                    }
                )
    return found


def ratio_claim(study: Study) -> list[dict[str, Any]]:
    """A channel of a coloured radius against the same channel of equal radii, direct."""
    scale = 0.4
    together = study.get(Request(SKIN, "default", 31, (0.2, scale), RATIO))
    found = []
    for channel, radius in enumerate(RATIO):
        alone = study.get(Request(SKIN, "default", 32, tuple(radius * s for s in (0.2, scale))))
        for row in (0, 1):
            difference = together.values[row, channel] - alone.values[row, channel]
            errors = np.hypot(together.errors[row, channel], alone.errors[row, channel])
            within = errors > 1e-4
            found.append(
                {
                    "albedo": SKIN[channel],
                    "radius": radius,
                    "scale": float(together.scales[row]),
                    "rms": float(np.sqrt((difference[within] ** 2).mean())),
                    "noise": float(np.sqrt((errors[within] ** 2).mean())),
                    "chi_squared": float(((difference[within] / errors[within]) ** 2).mean()),
                }
            )
    return found


def fits_part(study: Study) -> dict[str, Any]:
    """The fit table, and sigma0 against albedo."""
    fits, sigma0 = tables(study)
    return {"fits": fits, "sigma0": sigma0}


def times(study: Study) -> dict[str, Any]:
    """Render whole tables, for their time."""
    for quality in ("preview", "default"):
        study.get(Request(SETS[0], quality, TIMED_SEED))
    return {}


PARTS: dict[str, Callable[[Study], dict[str, Any]]] = {
    "fits": fits_part,
    "off_rows": lambda study: {"off_rows": off_rows(study)},
    "ratio": lambda study: {"ratio": ratio_claim(study)},
    "views": lambda study: {"views": views(study)},
    "times": times,
}


def page(results: dict[str, Any]) -> str:
    """Everything, as Markdown."""
    lines = ["# Reflectance measured on path-traced spheres, and fits to it", ""]
    lines += [generated("measured"), ""]
    lines += [f"Measured on: {facts(results['machine'])}.", ""]
    lines += [
        "Cycles, Subsurface Scattering node, Random Walk, one sun without angle, light across the "
        "view, no light from surface to surface. Values are radiance / (albedo · irradiance / π); "
        "`scale` is radius · scale · κ. RMS is over θ from 16° to 164°, uniform in θ as the "
        "paper's equator. Beyond that a sphere lit from the side is seen so flatly that Cycles "
        "loses paths at its facets.",
        "",
        "## Fits: ring and sphere, gain 1 and gain free",
        "",
    ]
    head = ["albedo", "scale", "energy", "Lambert RMS", "ring σ", "RMS", "ring σ, gain free",
            "gain", "RMS", "sphere σ", "RMS", "sphere σ, gain free", "gain", "RMS",
            "measured RMS", "noise"]  # fmt: skip
    rows = []
    for row in results.get("fits", []):
        cells = [f"{row['albedo']:g}", f"{row['scale']:.3f}", f"{row['energy']:.3f}"]
        cells.append(f"{row['lambert']:.4f}")
        for name in MODELS:
            fixed, free = row[f"{name} fixed"], row[f"{name} free"]
            cells += [f"{fixed['sigma']:.3f}", f"{fixed['rms']:.4f}"]
            cells += [f"{free['sigma']:.3f}", f"{free['gain']:.3f}", f"{free['rms']:.4f}"]
        rows.append([*cells, f"{row['measured']:.4f}", f"{row['noise']:.4f}"])
    lines += table(head, rows)
    lines += ["## σ0 in units of the scatter radius, gain free", ""]
    lines += table(
        ["albedo", "ring", "sphere", "holds to scale (ring)", "(sphere)", "gain as scale → 0"],
        [
            [f"{s['albedo']:g}"]
            + [f"{s['sigma0_per_radius'][name]:.3f}" for name in MODELS]
            + [f"{s['proportional_to_scale'][name] or float('inf'):.3g}" for name in MODELS]
            + [f"{s['least_scale_gain']:.3f}"]
            for s in results.get("sigma0", [])
        ],
    )
    lines += ["## Spheres that are in no table, another seed (noise subtracted)", ""]
    lines += table(
        ["albedo", "radius", "scale", "measured", "ring, gain 1", "sphere, gain 1", "Lambert",
         "noise of the reference"],
        [
            [f"{r['albedo']:g}", f"{r['radius']:g}", f"{r['scale']:g}", f"{r['measured']:.4f}"]
            + [f"{r[name]:.4f}" for name in (*MODELS, "lambert", "noise")]
            for r in results.get("off_rows", [])
        ],
    )  # fmt: skip
    errors = np.array([r["measured"] for r in results.get("off_rows", [])])
    if len(errors):
        together = math.sqrt(float((errors**2).mean()))
        lines += [f"Worst {errors.max():.4f}, RMS of all {together:.4f}.", ""]
    lines += ["## A channel does not know of the others", ""]
    lines += table(
        ["albedo", "radius", "scale", "RMS of the difference", "expected from noise", "χ²"],
        [
            [f"{r['albedo']:g}", f"{r['radius']:g}", f"{r['scale']:g}", f"{r['rms']:.4f}",
             f"{r['noise']:.4f}", f"{r['chi_squared']:.2f}"]
            for r in results.get("ratio", [])
        ],
    )  # fmt: skip
    lines += [
        "## Radiance depends on the direction from which it is seen",
        "",
        "Cycles' Random Walk enters the surface along the view, refracted through a rough "
        "interface, so equal N·L does not look equal from everywhere. Ratio to the table's, for "
        "N·L > 0.3; elevation 89° is light from behind the camera.",
        "",
    ]
    lines += table(
        ["light's elevation", "albedo", "scale", "least", "mean", "most"],
        [
            [f"{r['elevation']:g}°", f"{r['albedo']:g}", f"{r['scale']:g}"]
            + [f"{r[name]:.3f}" for name in ("least", "mean", "most")]
            for r in results.get("views", [])
        ],
    )
    lines += ["## Time", ""]
    lines += table(
        ["quality", "pixels a sphere", "paths a pixel", "wall s", "CPU s of the child"],
        [
            [name, f"{quality.pixels[0]} × {quality.pixels[1]}",
             str(quality.samples * quality.passes),
             *(f"{results['seconds'][name][kind]:.0f}" if name in results.get("seconds", {}) else ""
               for kind in ("wall", "cpu"))]
            for name, quality in QUALITIES.items()
        ],
    )  # fmt: skip
    lines += ["Wall time depends on what else the machine does; half the CPU time is what two "
              "free cores take.", ""]  # fmt: skip
    return "\n".join(lines).rstrip() + "\n"


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cache", type=Path, default=Path(tempfile.gettempdir()) / "cdrf_measured")
    parser.add_argument("--fine", action="store_true", help="also the time of the fine quality")
    parser.add_argument("--only", nargs="*", choices=PARTS, default=list(PARTS))
    options = parser.parse_args()
    results = read_results("measured")
    study = Study(options.cache)
    for part in options.only:
        results |= {"machine": machine(), **PARTS[part](study)}
        if part == "times" and options.fine:
            study.get(Request(SETS[0], "fine", TIMED_SEED))
        results["seconds"] = results.get("seconds", {}) | study.seconds
        results = rounded(results, 5)
        write_results("measured", results)
    write_page("measured", page(results))
    sys.stdout.flush()
    os._exit(0)  # Blender 4.5 as a module now and then hangs in its libraries' destructors


if __name__ == "__main__":
    main()
