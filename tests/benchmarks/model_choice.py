# SPDX-License-Identifier: GPL-3.0-or-later
"""Which model of reflectance is closest to path tracing: docs/results/model_choice.md.

    ./dev bench model_choice           half an hour, most of it Cycles
    ./dev bench model_choice --page    the page from the JSON

Shapes, lights and path-traced references are those of kappa_choice (and its cache), curvature is
what the extension stores and the shader reads, the models are those an artist can choose. Each is
tried twice: with the slider that follows from the node's radius and albedo, as one click sets it,
and with the slider that fits best.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from cdrf_addon.core.curvature.field import Options, curvature_steps
from cdrf_addon.core.curvature.scale_space import LENGTH_PER_SIGMA0, KappaLevels, level_steps
from cdrf_addon.core.curvature.tri_mesh import TriMesh
from cdrf_addon.core.measured.model import measured_model
from cdrf_addon.core.progress import run_steps
from cdrf_addon.core.reflectance.model import Model, ring, sphere
from cdrf_addon.core.scattering.node_radius import sigma0_per_radius
from cdrf_addon.measuring.process import measure
from cdrf_addon.measuring.request import Request

from .common.arrays import Array
from .common.files import MESHES, read_results, write_page, write_results
from .common.machine import machine
from .common.markdown import facts, generated, table
from .common.shapes import Shape, subdivided
from .kappa_choice.cases import Case, SssMaterial, make_cases
from .kappa_choice.fits import least
from .kappa_choice.settings import ALBEDO, LEVEL, RATIO

SHAPES = {
    "head": MESHES / "human_head.obj",
    "bunny": MESHES / "stanford_bunny.obj",
}
SEED = 20111106
ALBEDOS = (0.2, 0.5, 0.75, 0.9, 0.99)
ALBEDO_SCALE, ALBEDO_SIZE, ALBEDO_SAMPLES = 0.06, 128, 192


@dataclass(frozen=True)
class Contender:
    """A model, its look-ups a light, and the slider that one click would set per unit of scale."""

    name: str
    model: Model
    ratio: tuple[float, ...]
    """Sigma0 of each channel over the slider; one for a table with colour."""
    slider_per_scale: float

    def radiance(self, theta: Array, kappa: Callable[[float], Array], slider: float) -> Array:
        """Shade pixels as the shader does, (n, 3)."""
        if self.model.colour:
            sigma = slider * kappa(LENGTH_PER_SIGMA0 * slider)
            return np.asarray(ALBEDO * self.model.evaluate(theta, sigma))
        channels = []
        for ratio in self.ratio:
            own = slider * ratio
            channels.append(self.model.evaluate(theta, own * kappa(LENGTH_PER_SIGMA0 * own)))
        return np.asarray(ALBEDO * np.stack(channels, axis=-1))


@dataclass(frozen=True)
class Pixels:
    """What is known of the pixels of a case."""

    case: Case
    shape: Shape
    levels: KappaLevels

    def kappa(self, length: float) -> Array:
        """Curvature at a diffusion length, interpolated to the pixels."""
        values = self.levels.at(length)[:, None]
        return np.maximum(self.case.hits.interpolate(self.shape, values)[:, 0], 0.0)

    def channel_error(self, channel: int, sigma0: float) -> float:
        """RMSE of one channel shaded by the sphere model."""
        sigma = sigma0 * self.kappa(LENGTH_PER_SIGMA0 * sigma0)
        value = self.case.albedo * sphere().evaluate(self.case.theta, sigma)
        return float(np.sqrt(((value - self.case.reference[:, channel]) ** 2).mean()))

    def error(self, contender: Contender, slider: float) -> float:
        """RMSE, mean over R, G, B."""
        off = contender.radiance(self.case.theta, self.kappa, slider) - self.case.reference
        return float(np.sqrt((off**2).mean(axis=0)).mean())


def levels_of(shape: Shape) -> KappaLevels:
    """Measure curvature as Make Translucent does."""
    mesh = TriMesh.from_arrays(shape.vertices, shape.triangles)
    return run_steps(level_steps(run_steps(curvature_steps(mesh, Options())))).kappa


def contenders(cache: Path) -> list[Contender]:
    """Every model that can stand for the material of the references."""
    slope = float(sigma0_per_radius(ALBEDO))
    found = [
        Contender("ring (the paper's), 3 look-ups", ring(), RATIO, slope),
        Contender("sphere, 3 look-ups", sphere(), RATIO, slope),
    ]
    for name, kept in (("as on spheres", False), ("energy kept", True)):
        request = Request(albedo=(ALBEDO,) * 3, seed=SEED, all_views=kept)
        spheres = measure(request, cache)
        model, sigma0 = measured_model(spheres, RATIO, keep_energy=kept)
        found.append(Contender(f"measured, {name}, 1 look-up", model, (), sigma0))
    return found


def albedo_study(cache: Path) -> list[dict[str, float]]:
    """Best sigma0 of the sphere model over the scatter radius, per albedo and radius."""
    shape = subdivided("head", SHAPES["head"], LEVEL)
    levels = levels_of(shape)
    materials = [SssMaterial(ALBEDO_SCALE, albedo) for albedo in ALBEDOS]
    rows = []
    for case in make_cases(shape, cache, ALBEDO_SIZE, ALBEDO_SAMPLES, materials=materials):
        pixels = Pixels(case, shape, levels)
        for channel, ratio in enumerate(RATIO):
            radius = case.scale * ratio
            best, error = least(partial(pixels.channel_error, channel))
            clicked = float(sigma0_per_radius(case.albedo)) * radius
            rows.append(
                {
                    "albedo": case.albedo,
                    "radius": radius,
                    "best": best / radius,
                    "error best": error,
                    "error clicked": pixels.channel_error(channel, clicked),
                    "error Lambert": pixels.channel_error(channel, 0.0),
                }
            )
            print(rows[-1], flush=True)
    return rows


def study(cache: Path, size: int, samples: int) -> dict[str, Any]:
    """Measure every contender on every case."""
    results: dict[str, Any] = {"machine": machine(), "cases": {}}
    results["albedos"] = albedo_study(cache)
    models = contenders(cache)
    for name, path in SHAPES.items():
        shape = subdivided(name, path, LEVEL)
        levels = levels_of(shape)
        for case in make_cases(shape, cache, size, samples):
            pixels = Pixels(case, shape, levels)
            rows = {}
            for contender in models:
                clicked = contender.slider_per_scale * case.scale
                best, least_error = least(partial(pixels.error, contender))
                rows[contender.name] = {
                    "clicked": clicked,
                    "error clicked": pixels.error(contender, clicked),
                    "best": best,
                    "error best": least_error,
                }
            results["cases"][case.name] = {"lambert": case.lambert(), "models": rows}
            print(case.name, json.dumps(results["cases"][case.name], indent=1), flush=True)
    return results


def to_markdown(results: dict[str, Any]) -> str:
    """Write the page."""
    cases = results["cases"]
    names = list(next(iter(cases.values()))["models"])
    lines = [
        "# Which model of reflectance",
        "",
        generated("model_choice"),
        "",
        f"Measured on: {facts(results['machine'])}.",
        "",
        "RMSE against Cycles (Random Walk, albedo 0.9, radius (1, 0.35, 0.2) · scale, one sun, no",
        "light between surfaces, pixels in cast shadow left out; method in kappa_choice.md), mean",
        "of R, G and B, in units of a white surface facing the sun. *One click*: the slider that",
        "follows from the node's radius and albedo. *Best*: the slider that fits this case best.",
        "",
    ]
    for key, title in (("error clicked", "One click"), ("error best", "Best slider")):
        rows = []
        for case, row in cases.items():
            errors = [row["models"][name][key] for name in names]
            shown = [f"**{e:.4f}**" if e == min(errors) else f"{e:.4f}" for e in errors]
            rows.append([case, f"{row['lambert']:.4f}", *shown])
        means = {
            name: float(np.mean([r["models"][name][key] / r["lambert"] for r in cases.values()]))
            for name in names
        }
        rows.append(["part of Lambert's, mean", "1", *(f"{means[n]:.3f}" for n in names)])
        lines += [f"## {title}", "", *table(["case", "Lambert", *names], rows)]
        winner = min(means, key=lambda name: means[name])
        lines += [f"Closest: {winner} ({means[winner]:.3f} of Lambert's error).", ""]
    lines += [
        "## σ₀ from the radius of Blender's node",
        "",
        "The head, sphere model: the σ₀ of the least error over the scatter radius, for each",
        "channel of materials of one albedo; `cdrf_addon/core/scattering/node_radius.py` runs",
        "through it.",
        "",
    ]
    rows = []
    for row in results["albedos"]:
        slope = float(sigma0_per_radius(row["albedo"]))
        rmse = [row[f"error {name}"] for name in ("Lambert", "best", "clicked")]
        numbers = [f"{row['albedo']:g}", f"{row['radius']:g}", f"{row['best']:.2f}", f"{slope:.2f}"]
        rows.append([*numbers, *(f"{error:.4f}" for error in rmse)])
    head = ["albedo", "radius", "best σ₀ / radius", "one click", "Lambert's RMSE", "best"]
    return "\n".join([*lines, *table([*head, "one click"], rows)])


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cache", type=Path, default=Path("kappa_choice_cache"))
    parser.add_argument("--size", type=int, default=160)
    parser.add_argument("--samples", type=int, default=512)
    parser.add_argument("--page", action="store_true", help="measure nothing")
    options = parser.parse_args()
    if not options.page:
        options.cache.mkdir(parents=True, exist_ok=True)
        write_results("model_choice", study(options.cache, options.size, options.samples))
    write_page("model_choice", to_markdown(read_results("model_choice")))


if __name__ == "__main__":
    main()
