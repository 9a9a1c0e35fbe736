# SPDX-License-Identifier: GPL-3.0-or-later
"""The parts of the study: fits, resolution, interpolation and bounces."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import Array
from ..common.rays import Hits, cast_camera
from ..common.shapes import Shape, subdivided
from .cases import Case, make_cases
from .curvature import KINDS, Diffusion
from .fits import (
    RULES,
    Levels,
    Rule,
    difference,
    fit,
    least,
    levels_of,
    pixel_fields,
    rmse_at,
    rule_name,
)
from .kernels import KERNELS
from .settings import (
    BOUNCES,
    LADDER,
    LEVEL,
    MANY_BOUNCES,
    NOISES,
    OTHER_LEVELS,
    QUOTIENTS,
    RATIO,
    RECOMMENDED,
    SCALES,
    SLIDER_STEPS,
    STORED,
)

Candidates = list[tuple[Case, dict[str, Levels]]]


@dataclass(frozen=True)
class Study:
    """Where things are, and how finely to look."""

    shapes: dict[str, Path]
    cache: Path
    size: int
    samples: int

    def shape(self, name: str) -> Shape:
        """Make a shape at the level of the renders."""
        return subdivided(name, self.shapes[name], LEVEL)

    def cases(self, shape: Shape, bounces: int = BOUNCES) -> list[Case]:
        """Make the cases of a shape, ready for both kernels."""
        cases = make_cases(shape, self.cache, self.size, self.samples, bounces)
        for name, make in KERNELS.items():
            table = make()
            for case in cases:
                case.prepare(name, table)
        return cases

    def candidates(self, shape: Shape, cases: list[Case]) -> Candidates:
        """Every kind of curvature at every length, of a shape that may differ from the render's."""
        hits, rows = self.hits(shape)
        fields = pixel_fields(shape, hits, Diffusion(shape), LADDER)
        return [(case, levels_of(case, fields[:, rows[case.hits.pixel]])) for case in cases]

    def hits(self, shape: Shape) -> tuple[Hits, NDArray[np.int64]]:
        """Cast the camera's rays; also the row in the hits of every pixel, or -1."""
        hits = cast_camera(shape, self.size)
        rows = np.full(self.size**2, -1)
        rows[hits.pixel] = np.arange(len(hits.pixel))
        return hits, rows


def measure_fits(study: Study, results: dict[str, Any]) -> None:
    """Fit every candidate to every case, then disturb it."""
    for key in ("cases", "fits", "noise"):
        results[key] = {}
    everything: Candidates = []
    for name in study.shapes:
        shape = study.shape(name)
        cases = study.cases(shape)
        clean = study.candidates(shape, cases)
        for case, levels in clean:
            results["cases"][case.name] = describe(case, shape)
            results["fits"][case.name] = fit_case(case, levels)
            print(f"  {case.name} fitted", flush=True)
        # The rays see the smooth shape; only the curvature is that of the noisy one.
        hits, rows = study.hits(shape)
        for noise in NOISES:
            noisy = shape.noisy(noise)
            rough = pixel_fields(noisy, hits, Diffusion(noisy), LADDER)
            place = results["noise"].setdefault(f"{noise:g}", {})
            for case in cases:
                levels = levels_of(case, rough[:, rows[case.hits.pixel]])
                place[case.name] = errors_of(case, levels, results["fits"][case.name])
        everything += clean
    results["joint"] = joint_fits(everything)


def describe(case: Case, shape: Shape) -> dict[str, Any]:
    """Facts of a case, with the losers that need no curvature."""
    facts: dict[str, Any] = {
        "vertices": len(shape.vertices),
        "edge": shape.edge,
        "area": shape.area,
        "pixels": case.masks,
        "lambert": case.lambert(),
    }
    same = Levels(np.ones((2, len(case.theta))), (1.0, 2.0))
    facts["constant"] = {kernel: vars(fit(case, same, ("raw", 0.0), kernel)) for kernel in KERNELS}
    return facts


def fit_case(case: Case, levels: dict[str, Levels]) -> dict[str, Any]:
    """Fit every candidate."""
    fits: dict[str, Any] = {}
    for kernel, kind, rule in itertools.product(KERNELS, KINDS, RULES):
        place = fits.setdefault(kernel, {}).setdefault(kind, {})
        place[rule_name(rule)] = vars(fit(case, levels[kind], rule, kernel))
    return fits


def errors_of(case: Case, levels: dict[str, Levels], fits: dict[str, Any]) -> dict[str, Any]:
    """RMSE of every candidate with other curvature, the slider left where it was fitted."""
    errors: dict[str, Any] = {}
    for kernel, kind, rule in itertools.product(KERNELS, KINDS, RULES):
        sigma0 = fits[kernel][kind][rule_name(rule)]["sigma0"]
        place = errors.setdefault(kernel, {}).setdefault(kind, {})
        place[rule_name(rule)] = {"rmse": rmse_at(case, levels[kind], rule, kernel, sigma0)}
    return errors


def joint_fits(everything: Candidates) -> dict[str, Any]:
    """Fit one number sigma0 / scale for all cases: does the slider mean the same everywhere?"""
    lambert = [case.lambert() for case, _ in everything]
    result: dict[str, Any] = {}
    for kernel, kind, rule in itertools.product(KERNELS, KINDS, RULES):

        def relative(
            value: float, kernel: str = kernel, kind: str = kind, rule: Rule = rule
        ) -> float:
            errors = [
                rmse_at(case, levels[kind], rule, kernel, value * case.scale / SCALES[-1])
                for case, levels in everything
            ]
            return float(np.mean([e / base for e, base in zip(errors, lambert, strict=True)]))

        at, error = least(relative)
        entry = {"sigma0_over_scale": at / SCALES[-1], "relative_rmse": error}
        result.setdefault(kernel, {}).setdefault(kind, {})[rule_name(rule)] = entry
    return result


RESOLUTION_MOST = 0.6
RESOLUTION_RULES: tuple[Rule, ...] = (
    ("raw", 0.0),
    ("fixed", 0.16),
    ("factor", 2.0),
    ("factor", 4.0),
)


def measure_resolution(study: Study, results: dict[str, Any]) -> None:
    """Take the curvature from a coarser and a finer mesh, the slider from the fit at LEVEL.

    Normals stay those of the render, so that only the curvature shows. Every third step of the
    ladder serves, up to RESOLUTION_MOST for all levels alike: half a million triangles take long.
    """
    head = study.shape("head")
    everything = study.candidates(head, study.cases(head))
    fits = results["fits"]
    steps = [0, *range(1, len(LADDER), 3)]
    steps = [i for i in steps if LADDER[i] < RESOLUTION_MOST]
    ladder = [LADDER[i] for i in steps]
    result = results["resolution"] = {}
    for level in OTHER_LEVELS:
        shape = subdivided("head", study.shapes["head"], level)
        print(f"  head at level {level}: {len(shape.vertices)} vertices", flush=True)
        hits, lookup = study.hits(shape)
        fields = pixel_fields(shape, hits, Diffusion(shape), ladder)
        for case, levels in everything:
            rows = lookup[case.hits.pixel]
            seen = np.flatnonzero(rows >= 0)
            part = case.take(seen)
            for kind, make in KINDS.items():
                new = Levels(make(fields[:, rows[seen]], part.tangent.astype(np.float32)), ladder)
                own = Levels(levels[kind].kappa[steps][:, seen], ladder)
                for kernel, rule in itertools.product(KERNELS, RESOLUTION_RULES):
                    sigma0 = fits[case.name][kernel][kind][rule_name(rule)]["sigma0"]
                    place = result.setdefault(str(level), {}).setdefault(case.name, {})
                    place.setdefault(kernel, {}).setdefault(kind, {})[rule_name(rule)] = {
                        "rmse": rmse_at(part, new, rule, kernel, sigma0),
                        "rmse_own": rmse_at(part, own, rule, kernel, sigma0),
                        "drift": difference(part, new, own, rule, kernel, sigma0),
                    }


def measure_interpolation(study: Study, results: dict[str, Any]) -> None:
    """Interpolate the curvature from a few stored lengths instead of diffusing it exactly."""
    shape = study.shape("head")
    fits = results["fits"]
    kind, factor = RECOMMENDED
    rule: Rule = ("factor", factor)
    diffusion = Diffusion(shape)
    result = results["interpolation"] = {}
    stored = {}
    for quotient in QUOTIENTS:
        lengths = sorted(math.sqrt(shape.area) / quotient**i for i in range(1, STORED + 1))
        stored[quotient] = (lengths, [diffusion.at(length) for length in lengths])
    for case in study.cases(shape):

        def kappa_of(values: Array, case: Case = case) -> Array:
            fields = case.hits.interpolate(shape, values)
            return KINDS[kind](fields, case.tangent)

        ladders = {
            quotient: Levels(np.stack([kappa_of(v) for v in values]).astype(np.float32), lengths)
            for quotient, (lengths, values) in stored.items()
        }
        for kernel in KERNELS:
            best = fits[case.name][kernel][kind][rule_name(rule)]["sigma0"]
            # The slider at its fit and at other places: the loss depends on where between levels.
            for step in SLIDER_STEPS:
                sigma0 = best * step
                exact = [
                    case.image(kernel, sigma0 * r * kappa_of(diffusion.at(factor * sigma0 * r)))
                    for r in RATIO
                ]
                off = np.stack(exact, axis=1) - case.reference
                truth = float(np.sqrt((off**2).mean(axis=0)).mean())
                entry: dict[str, Any] = {"sigma0": sigma0, "exact": truth}
                for quotient, levels in ladders.items():
                    images = [
                        case.image(kernel, sigma0 * r * levels.at(factor * sigma0 * r))
                        for r in RATIO
                    ]
                    own = rmse_at(case, levels, rule, kernel, sigma0)
                    apart = [
                        float(np.sqrt(((a - b) ** 2).mean()))
                        for a, b in zip(images, exact, strict=True)
                    ]
                    entry[str(quotient)] = {
                        "rmse": own,
                        "lost": own - truth,
                        "difference": sum(apart) / 3.0,
                    }
                place = result.setdefault(case.name, {}).setdefault(kernel, {})
                place[f"{step:g}"] = entry


def measure_bounces(study: Study, results: dict[str, Any]) -> None:
    """Repeat the fits of the head against renders with light from surface to surface."""
    head = study.shape("head")
    result = results["bounces"] = {}
    for case, levels in study.candidates(head, study.cases(head, bounces=MANY_BOUNCES)):
        found = result.setdefault(case.name, {"lambert": case.lambert()})
        for kernel, kind, rule in itertools.product(KERNELS, KINDS, RULES):
            sigma0, rmse = least(partial(rmse_at, case, levels[kind], rule, kernel))
            place = found.setdefault(kernel, {}).setdefault(kind, {})
            place[rule_name(rule)] = {"sigma0": sigma0, "rmse": rmse}


PARTS = {
    "fits": measure_fits,
    "interpolation": measure_interpolation,
    "bounces": measure_bounces,
    "resolution": measure_resolution,
}
