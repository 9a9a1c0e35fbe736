# SPDX-License-Identifier: GPL-3.0-or-later
"""Walks of balls, hollows and cylinders in NumPy, and fits of the coefficients to them.

Nothing is tabulated in the end: 33 numbers hold what tables of albedo, curvature and view would.
Each half of the walks has its own seed; the difference of the two is the Monte-Carlo error, and its
square is taken off the squared error of the model.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from cdrf_addon.core.walk import view
from cdrf_addon.core.walk.medium import medium
from cdrf_addon.core.walk.sphere_walk import views, walk

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
    entry: tuple[float, float],
    curved: NDArray[np.float64],
    form: Form | None = None,
    every: int = 1,
) -> NDArray[np.float64]:
    """Radiance of the model, (x, m, a, l)."""
    form = form or Form()
    model = view.walk_model("RANDOM_WALK", *entry)
    x = curved[:, None, None, None]
    toward = np.stack((np.sqrt(1.0 - MU**2), 0.0 * MU, MU), axis=-1)[None, :, None, :]
    normal, size = np.array([0.0, 0.0, 1.0]), np.broadcast_to(x, (*x.shape[:3], len(COLOURS)))
    across = toward - normal * toward[..., 2:]
    shown = model.radiance(
        COLOURS,
        normal,
        toward,
        LIGHTS[::every],
        form.mean * size,
        form.curvedness * size,
        form.turned * size[..., None] * across[..., None, :],
    )
    return shown.transpose(0, 1, 3, 2)


@dataclass(frozen=True)
class Form:
    """What a body's curvatures are, over one over its radius."""

    mean: float = 1.0
    curvedness: float = 1.0
    turned: float = 1.0
    """Shape operator in the plane of the view."""


def error_of(
    walked: Walked,
    entry: tuple[float, float],
    curved: NDArray[np.float64],
    form: Form | None = None,
) -> NDArray[np.float64]:
    """Root mean square over a picture and its lights, over A, (x, a), without the noise."""
    miss = ((modelled(entry, curved, form) - walked.shown.mean(axis=0)) ** 2).mean(axis=-1)
    mean = np.einsum("xma,m->xa", miss - walked.noise, PART)
    return np.asarray(np.sqrt(np.maximum(mean, 0.0)) / COLOURS)


def noise_of(walked: Walked) -> NDArray[np.float64]:
    """Monte-Carlo error that `error_of` takes off, over A, (x, a)."""
    return np.asarray(np.sqrt(np.einsum("xma,m->xa", walked.noise, PART)) / COLOURS)


@dataclass(frozen=True)
class Coefficients:
    """Those of view.py, as they are at a moment."""

    values: dict[str, tuple[float, ...]]

    @classmethod
    def current(cls) -> Coefficients:
        """Take what view.py has."""
        return cls({name: tuple(np.atleast_1d(getattr(view, name))) for name in NAMES})

    def put(self) -> None:
        """Give them to view.py."""
        for name, numbers in self.values.items():
            setattr(view, name, numbers[0] if name == "ENDED" else numbers)

    def changed(self, **values: tuple[float, ...]) -> Coefficients:
        """Return them with other values."""
        return Coefficients({**self.values, **values})


NAMES = ("WIDTH", "TILT", "HAZE", "GAIN", "HOLLOW", "ENDED")


def _weight() -> NDArray[np.float64]:
    return np.asarray(np.sqrt(PART)[None, :, None] / np.maximum(COLOURS, 0.34))


def fit_energy(balls: list[Walked], hollows: list[Walked]) -> None:
    """Fit what comes out of balls (GAIN, ENDED) and of hollows (HOLLOW), in view.py."""

    def set_gain(p: NDArray[np.float64]) -> None:
        view.GAIN = tuple(np.append(p[:7], np.abs(p[7:9])))
        view.ENDED = float(p[9])

    def off(walked: Walked, entry: tuple[float, float], mean: NDArray[np.float64]) -> Any:
        model = view.walk_model("RANDOM_WALK", *entry)
        own = model.reflected(COLOURS, MU[:, None], mean[:, None, None])
        return (own - walked.whole.mean(axis=0)) * _weight()

    def gain(p: NDArray[np.float64]) -> NDArray[np.float64]:
        set_gain(p)
        pairs = zip(balls, ENTRIES, strict=False)
        return np.concatenate(
            [(off(*pair, CURVED) / ALLOWED[:, None, None]).ravel() for pair in pairs]
        )

    def hollow(p: NDArray[np.float64]) -> NDArray[np.float64]:
        view.HOLLOW = tuple(p)
        pairs = zip(hollows, ENTRIES, strict=False)
        return np.concatenate([off(*pair, -HOLLOWED).ravel() for pair in pairs])

    set_gain(least_squares(gain, [*view.GAIN, view.ENDED], x_scale="jac", max_nfev=300).x)
    if hollows:
        view.HOLLOW = tuple(least_squares(hollow, view.HOLLOW).x)


def fit_shape(
    balls: list[Walked], free: NDArray[np.bool_] | None = None, steps: int = 25, every: int = 1
) -> None:
    """Fit width, tilt and haze, in view.py, with the energy taken out.

    Args:
        balls: For each of ENTRIES, or the first of them.
        free: Which of the 18 numbers may change.
        steps: Evaluations, at most.
        every: Of the lights only each so many-th.
    """
    begin = np.array([*view.WIDTH, *view.TILT, *view.HAZE])
    chosen = np.ones(len(begin), dtype=bool) if free is None else free

    def set_shape(p: NDArray[np.float64]) -> None:
        own = begin.copy()
        own[chosen] = p
        view.WIDTH, view.TILT, view.HAZE = tuple(own[:8]), tuple(own[8:14]), tuple(own[14:])

    def shape(p: NDArray[np.float64]) -> NDArray[np.float64]:
        set_shape(p)
        miss = []
        for walked, entry in zip(balls, ENTRIES, strict=False):
            seen, whole = walked.shown.mean(axis=0)[..., ::every], walked.whole.mean(axis=0)
            model = view.walk_model("RANDOM_WALK", *entry)
            own = model.reflected(COLOURS, MU[:, None], CURVED[:, None, None])
            off = modelled(entry, CURVED, every=every) * (whole / own)[..., None] - seen
            off *= _weight()[..., None] / ALLOWED[:, None, None, None]
            miss.append(off[:, :, :-1].ravel())
        return np.concatenate(miss)

    set_shape(least_squares(shape, begin[chosen], x_scale="jac", max_nfev=steps).x)
