# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the coefficients of core/walk/view.py from walks of balls and hollows, and judges them.

    ./dev python tests/benchmarks/walk_tables.py             fits; 90 s with --walks 2000
    ./dev python tests/benchmarks/walk_tables.py --judge     judges what view.py has now

Nothing is tabulated in the end: 33 numbers hold what tables of albedo, curvature and view would.
What view.py ships was fitted by the same formulas and weights to 100,000 to 200,000 walks a view of
a compiled copy of the walk (numba), which takes NumPy an hour; this command comes to the same
errors, not to the same digits: the nine numbers of GAIN trade against each other.
Each half of the walks has its own seed; the difference of the two is the Monte-Carlo error, and its
square is taken off the squared error of the model.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "support")]

import numpy as np  # noqa: E402  (the checkout must be importable first)
from numpy.typing import NDArray  # noqa: E402
from scipy.optimize import least_squares  # noqa: E402

from cdrf_addon.core.walk import view  # noqa: E402
from cdrf_addon.core.walk.medium import medium  # noqa: E402
from cdrf_addon.core.walk.sphere_walk import BALL, HOLLOW, views, walk  # noqa: E402

COLOURS = np.array([0.1, 0.2, 0.34, 0.5, 0.62, 0.8, 0.9, 0.97, 1.0])
CURVED = np.array([0.01, 0.02, 0.04, 0.07, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0])
HOLLOWED = np.array([0.02, 0.05, 0.1, 0.2, 0.4, 1.0])
# Views, and the part of a ball's picture each stands for.
MU = np.array([0.05, 0.15, 0.25, 0.4, 0.55, 0.7, 0.85, 0.97])
PART = MU / MU.sum()
ENTRIES = ((1.0, 1.4), (0.25, 1.5), (0.0, 1.4))
"""GGX's alpha and the index: the Subsurface Scattering node's, the Principled's, a smooth one."""
# What the model may miss, by l kappa: the weight of a row in the fit is its inverse.
ALLOWED = np.array([0.006, 0.006, 0.006, 0.006, 0.006, 0.013, 0.02, 0.03, 0.08, 0.25])


def lights(count: int) -> NDArray[np.float64]:
    """Directions all over the sphere, (count, 3)."""
    i = np.arange(count) + 0.5
    z, around = 1.0 - 2.0 * i / count, np.pi * (1.0 + 5.0**0.5) * i
    s = np.sqrt(1.0 - z * z)
    return np.stack((s * np.cos(around), s * np.sin(around), z), axis=1)


LIGHTS = lights(40)


@dataclass(frozen=True)
class Walked:
    """Two halves of walks, by curvature x, view m and colour a."""

    shown: NDArray[np.float64]
    """Radiance under each light, (2, x, m, a, l)."""
    whole: NDArray[np.float64]
    """Under light from everywhere, (2, x, m, a)."""

    @property
    def noise(self) -> NDArray[np.float64]:
        """Squared error of the mean of the halves, under a light, (x, m, a)."""
        return np.asarray(((self.shown[0] - self.shown[1]) ** 2).mean(axis=-1) / 4.0)


def walk_all(
    body: str, curved: NDArray[np.float64], entry: tuple[float, float], count: int, seed: int
) -> Walked:
    """Walk `count` times for each half, curvature and view; one walk serves all colours."""
    omega = medium("RANDOM_WALK", COLOURS, 1.0).single_scattering
    shown = np.zeros((2, len(curved), len(MU), len(COLOURS), len(LIGHTS)))
    whole = np.zeros(shown.shape[:-1])
    for half in range(2):
        random = np.random.default_rng([seed, half])
        for i, x in enumerate(curved):
            for j, mu in enumerate(MU):
                entered = views(float(mu), count, *entry, random)
                out = walk(body, float(x), entered, random)
                weights = np.stack([out.weights(float(one)) for one in omega])
                whole[half, i, j] = weights.sum(axis=1) / count
                lit = np.maximum(out.normal @ LIGHTS.T, 0.0)
                shown[half, i, j] = weights @ lit / count
    return Walked(shown, whole)


def modelled(
    entry: tuple[float, float], curved: NDArray[np.float64], sign: float = 1.0
) -> NDArray[np.float64]:
    """Radiance of the model, (x, m, a, l)."""
    model = view.walk_model("RANDOM_WALK", *entry)
    x, mu = curved[:, None, None, None], MU[None, :, None]
    toward = np.stack((np.sqrt(1.0 - MU**2), 0.0 * MU, MU), axis=-1)[None, :, None, :]
    normal, size = np.array([0.0, 0.0, 1.0]), np.broadcast_to(x, (*x.shape[:3], len(COLOURS)))
    del mu
    return model.radiance(COLOURS, normal, toward, LIGHTS, sign * size, size).transpose(0, 1, 3, 2)


def error_of(
    walked: Walked, entry: tuple[float, float], curved: NDArray[np.float64], sign: float = 1.0
) -> NDArray[np.float64]:
    """Root mean square over a picture and its lights, over A, (x, a), without the noise."""
    miss = ((modelled(entry, curved, sign) - walked.shown.mean(axis=0)) ** 2).mean(axis=-1)
    mean = np.einsum("xma,m->xa", miss - walked.noise, PART)
    return np.asarray(np.sqrt(np.maximum(mean, 0.0)) / COLOURS)


def fit(balls: list[Walked], hollows: list[Walked]) -> dict[str, list[float]]:
    """Fit the energy of balls and of hollows, then tilt, width and haze to what is left."""
    weight = np.sqrt(PART)[None, :, None] / np.maximum(COLOURS, 0.34)

    def set_gain(p: NDArray[np.float64]) -> None:
        view.GAIN = tuple(np.append(p[:7], np.abs(p[7:9])))
        view.ENDED = float(p[9])

    def gain(p: NDArray[np.float64]) -> NDArray[np.float64]:
        set_gain(p)
        miss = []
        for walked, entry in zip(balls, ENTRIES, strict=True):
            own = view.walk_model("RANDOM_WALK", *entry).reflected(
                COLOURS, MU[:, None], CURVED[:, None, None]
            )
            off = (own - walked.whole.mean(axis=0)) * weight
            miss.append((off / ALLOWED[:, None, None]).ravel())
        return np.concatenate(miss)

    def hollow(p: NDArray[np.float64]) -> NDArray[np.float64]:
        view.HOLLOW = tuple(p)
        miss = []
        for walked, entry in zip(hollows, ENTRIES, strict=False):
            own = view.walk_model("RANDOM_WALK", *entry).reflected(
                COLOURS, MU[:, None], -HOLLOWED[:, None, None]
            )
            miss.append(((own - walked.whole.mean(axis=0)) * weight).ravel())
        return np.concatenate(miss)

    def set_shape(p: NDArray[np.float64]) -> None:
        view.WIDTH, view.TILT = tuple(p[:8]), tuple(p[8:14])
        view.HAZE = tuple(p[14:])

    def shape(p: NDArray[np.float64]) -> NDArray[np.float64]:
        set_shape(p)
        miss = []
        for walked, entry in zip(balls, ENTRIES, strict=True):
            seen, whole = walked.shown.mean(axis=0), walked.whole.mean(axis=0)
            model = view.walk_model("RANDOM_WALK", *entry)
            own = model.reflected(COLOURS, MU[:, None], CURVED[:, None, None])
            off = modelled(entry, CURVED) * (whole / own)[..., None] - seen
            off *= weight[..., None] / ALLOWED[:, None, None, None]
            miss.append(off[:, :, :-1].ravel())
        return np.concatenate(miss)

    start = [*view.GAIN, view.ENDED]
    found = least_squares(gain, start, x_scale="jac", max_nfev=300)
    set_gain(found.x)
    view.HOLLOW = tuple(least_squares(hollow, view.HOLLOW).x)
    begin = [*view.WIDTH, *view.TILT, *view.HAZE]
    found = least_squares(shape, begin, x_scale="jac", max_nfev=25)
    set_shape(found.x)
    names = ("WIDTH", "TILT", "HAZE", "GAIN", "HOLLOW")
    result = {name: [round(float(v), 4) for v in getattr(view, name)] for name in names}
    return result | {"ENDED": [round(view.ENDED, 4)]}


def judge(balls: list[Walked], hollows: list[Walked]) -> None:
    """Print the error of each entry, and beside it the Monte-Carlo error."""
    for walked, entry in zip(balls, ENTRIES, strict=True):
        print(f"\nballs, alpha {entry[0]}, index {entry[1]}: RMS / A; last the noise taken off")
        table(CURVED, error_of(walked, entry, CURVED), walked)
    for walked, entry in zip(hollows, ENTRIES, strict=False):
        print(f"\nhollows, alpha {entry[0]}, index {entry[1]}")
        table(-HOLLOWED, error_of(walked, entry, HOLLOWED, -1.0), walked)


def table(curved: NDArray[np.float64], errors: NDArray[np.float64], walked: Walked) -> None:
    """Print one line for each curvature, one column for each colour."""
    noise = np.sqrt(np.einsum("xma,m->xa", walked.noise, PART)) / COLOURS
    print("   l/R " + "".join(f"{a:8.2f}" for a in COLOURS))
    for x, row, own in zip(curved, errors, noise, strict=True):
        print(f"{x:6.2f} " + "".join(f"{e:8.4f}" for e in row) + f"   {own[2]:.4f} (A 0.34)")


def main() -> None:
    """Walk, fit, judge."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--walks", type=int, default=20_000, help="a view, curvature and half")
    parser.add_argument("--judge", action="store_true", help="judge view.py as it is, with seed 7")
    parser.add_argument("--out", type=Path, help="file for the coefficients, JSON")
    options = parser.parse_args()
    seed, start = (7 if options.judge else 5), time.perf_counter()
    balls = [
        walk_all(BALL, CURVED, entry, options.walks, seed + 100 * i)
        for i, entry in enumerate(ENTRIES)
    ]
    hollows = [
        walk_all(HOLLOW, HOLLOWED, entry, options.walks // 8, seed + 100 * i + 50)
        for i, entry in enumerate(ENTRIES[:2])
    ]
    print(f"walks: {time.perf_counter() - start:.0f} s", flush=True)
    if not options.judge:
        found = fit(balls, hollows)
        print(f"fits done: {time.perf_counter() - start:.0f} s")
        for name, values in found.items():
            print(name, "=", tuple(values))
        if options.out:
            options.out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    judge(balls, hollows)


if __name__ == "__main__":
    main()
