# SPDX-License-Identifier: GPL-3.0-or-later
"""A random walk under a curved surface, as a shader can afford it.

Per channel, A the colour, l the mean free path, H the mean curvature and kappa the curvedness:

    L = E_light / pi * reflected(A, mu, l H) * kernel(N'.L; width, haze)
    N' = normalize(N - k S l (V - mu N)),  k = tilt(A, mu, l kappa)

- `reflected` is A G E: what comes out at all. G is the flat limit's (core/walk/flat.py). Where the
  surface bulges less is absorbed before light gets out: R = F (D + z) / (D + F z), F = A G and
  D = 1 - F, is F at z = 0 and 1 at z = infinity: no energy is won. Hollows give back
  R = F / (1 + h l |H|). What walks without an end would add to a plane falls off where the surface
  bulges: in a small body none is that long.
- `tilt`: light that entered along the view is gathered beside the pixel.
- `kernel` is the sphere's f(angle, width) less haze (c + 5/4 (c^2 - 1/3)), c = N'.L: exits have a
  longer tail than a Gaussian, and the two lowest harmonics hold it. Its mean over all lights is
  1/4 as that of f, and it costs no second look-up.

All coefficients are fits to walks of spheres, 0.01 <= l kappa <= 0.5, three pairs of roughness and
index at once (`./dev bench walk` makes such fits, and judges these). RMS over A of a
ball's picture under all suns: 0.006 to l kappa = 0.1, 0.015 at 0.2, 0.033 at 0.3, for A >= 0.34.
Those here come from 100,000 to 200,000 walks a view of a compiled copy of core/walk/sphere_walk.py;
fewer walks in NumPy give other digits at similar errors.
Skin and legacy walks miss no more. An anisotropic medium is taken for the isotropic one of its
moments: at g = 0.8 the spread of G over the views is 1.1 (A = 0.8) to 1.65 times (A = 0.34) what
that says. What roughness and index do is in the mean depth of the entry and its length along the
surface, both polynomials in mu.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..reflectance.sphere_model import sphere_reflectance
from ..scattering.node_radius import BURLEY, RANDOM_WALK
from .flat import TAIL_POWERS, FlatFit, flat_fit
from .medium import BOUNCES

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

# Beyond it tilt and haze stay: a body of 2.5 mean free paths is seen through, and no normal
# stands for that.
MOST_CURVED = 0.4
# And here every curvature ends, so that infinities are numbers.
_ENDLESS = 1e9
# Of c^2 - 1/3 over that of c in the haze.
HAZE_RATIO = 1.25
# No plane gives all back: keeps 0 / 0 away at A = 1 and l H = 0.
LEAST_LOST = 1e-4

# Shallowest mean entry the fit of `GAIN` has seen; what is below it (rough, index near 1, seen from
# the side) takes this one's, where the polynomial is sure to be positive.
LEAST_DEPTH = 0.18

# width: s y / sqrt(1 + (s y / m)^2), y = l kappa
#   s = (0 + 1 A + 2 A^2 + 3 A^3) (1 + 4 depth), m = 5 + 6 A + 7 depth
WIDTH = (0.4203, 1.9395, -4.4425, 4.5363, 0.7467, 1.0142, -0.8719, 0.1057)
# tilt k: (0 + 1 A + depth (2 + 3 A) + y (4 + 5 depth)) along, y = min(l kappa, MOST_CURVED)
TILT = (1.2245, -0.2342, -0.9843, 0.8979, -1.1682, 3.5273)
# haze: A^2 (0 + 1 A^2) (1 + 2 depth) y^2 / (y + 3)
HAZE = (0.1426, 0.0159, 3.6315, 0.0398)
# z = y (0 + (1 + 2 A + 3 A^2 + depth (4 + 5 A + 6 A^2)) y / (y + 7 + 8 (1 - A) depth)), y = l H
GAIN = (1.1047, 100.0546, -296.318, 210.8184, -94.8402, 334.8726, -183.3339, 0.9669, 9.5458)
# From l H = 1 / ENDED on no walk is ended early.
ENDED = 4.2457
# h = 0 + 1 A + depth (2 + 3 A) + 4 y / (1 + y), y = -l H
HOLLOW = (1.273, -0.254, -0.534, 1.254, 0.488)


@dataclass(frozen=True)
class WalkModel:
    """What is constant over a material: a method, its roughness and its index."""

    flat: FlatFit
    view_dependent: bool = True

    def depth(self, mu: ArrayLike) -> NDArray[np.float64]:
        """Mean cosine of the entry to the inward normal."""
        return _polynomial(self.flat.depth, _view(mu))

    def along(self, mu: ArrayLike) -> NDArray[np.float64]:
        """Mean component of the entry along the surface, over the sine of the view."""
        return _polynomial(self.flat.along, _view(mu))

    def flat_part(
        self, colour: ArrayLike, mu: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return A G of walks without an end, and what the end takes away.

        Of the older methods only the difference of the two is meant (core/walk/flat.py).
        """
        a, view = _colour(colour), _view(mu)
        inner = _polynomial(self.flat.base, view) + a * _polynomial(self.flat.slope, view)
        tail = sum(t * a**n for t, n in zip(self.flat.tail, TAIL_POWERS, strict=True))
        lost = np.asarray(_polynomial(self.flat.lost, view) * tail)
        return np.clip(a * (1.0 + (1.0 - a) * inner), 0.0, 1.0), lost

    def reflected(
        self, colour: ArrayLike, mu: ArrayLike, mean: ArrayLike = 0.0
    ) -> NDArray[np.float64]:
        """A G E: the radiance under light of radiance 1 from everywhere.

        Args:
            colour: A, in [0, 1].
            mu: N.V; below 0 counts as 0.
            mean: l H, positive where the surface bulges; infinities are limits, NaN is flat.

        Returns:
            In [0, 1], of the broadcast shape.
        """
        a, y = _colour(colour), _curvature(mean)
        flat, lost = self.flat_part(a, mu)
        if not self.view_dependent:
            return np.array(np.broadcast_to(flat, np.broadcast_shapes(flat.shape, y.shape)))
        bulge, hollow = np.maximum(y, 0.0), np.maximum(-y, 0.0)
        shown = np.maximum(flat - lost * np.maximum(1.0 - ENDED * bulge, 0.0), 0.0)
        z = self._odds(a, mu, bulge)
        missing = np.maximum(1.0 - shown, LEAST_LOST)
        h = HOLLOW[0] + HOLLOW[1] * a + self.depth(mu) * (HOLLOW[2] + HOLLOW[3] * a)
        h = h + HOLLOW[4] * hollow / (1.0 + hollow)
        return np.asarray(shown * (missing + z) / ((missing + shown * z) * (1.0 + h * hollow)))

    def _odds(
        self, a: NDArray[np.float64], mu: ArrayLike, y: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        depth = np.maximum(self.depth(mu), LEAST_DEPTH)
        top = (
            (GAIN[1] + depth * GAIN[4])
            + (GAIN[2] + depth * GAIN[5]) * a
            + (GAIN[3] + depth * GAIN[6]) * a**2
        )
        return np.asarray(y * (GAIN[0] + top * y / (y + GAIN[7] + GAIN[8] * (1.0 - a) * depth)))

    def gain(self, colour: ArrayLike, mu: ArrayLike, mean: ArrayLike = 0.0) -> NDArray[np.float64]:
        """G E: `reflected` over Lambert's, with the limit of dark colours at A = 0."""
        a = np.maximum(_colour(colour), 1e-4)
        return self.reflected(a, mu, mean) / a

    def tilt(self, colour: ArrayLike, mu: ArrayLike, curvedness: ArrayLike) -> NDArray[np.float64]:
        """Return k of N' = normalize(N - k l S (V - mu N)), from l kappa.

        Beyond MOST_CURVED it falls as 1 / (l kappa), so that k l S ends.
        """
        a, size = _colour(colour), np.abs(_curvature(curvedness))
        y, depth = np.minimum(size, MOST_CURVED), self.depth(mu)
        k = TILT[0] + TILT[1] * a + depth * (TILT[2] + TILT[3] * a)
        k = (k + y * (TILT[4] + TILT[5] * depth)) * self.along(mu)
        return np.asarray(k * MOST_CURVED / np.maximum(size, MOST_CURVED))

    def width(self, colour: ArrayLike, mu: ArrayLike, curvedness: ArrayLike) -> NDArray[np.float64]:
        """Width of the blur, radians, from l kappa; ends at 0.2 to 1.1 by colour."""
        a, size = _colour(colour), np.abs(_curvature(curvedness))
        if not self.view_dependent:
            return np.array(np.broadcast_to(size, np.broadcast_shapes(a.shape, size.shape)))
        depth = self.depth(mu)
        slope = WIDTH[0] + a * (WIDTH[1] + a * (WIDTH[2] + a * WIDTH[3]))
        straight = slope * (1.0 + WIDTH[4] * depth) * size
        most = WIDTH[5] + WIDTH[6] * a + WIDTH[7] * depth
        return np.asarray(straight / np.sqrt(1.0 + (straight / most) ** 2))

    def haze(self, colour: ArrayLike, mu: ArrayLike, curvedness: ArrayLike) -> NDArray[np.float64]:
        """Weight of the tail in `kernel`, from l kappa; in [0, 0.3]."""
        a, y = _colour(colour), np.minimum(np.abs(_curvature(curvedness)), MOST_CURVED)
        strength = a**2 * (HAZE[0] + HAZE[1] * a**2) * (1.0 + HAZE[2] * self.depth(mu))
        part = strength * y**2 / (y + HAZE[3])
        return np.asarray(part if self.view_dependent else part * 0.0)

    def radiance(
        self,
        colour: ArrayLike,
        normal: ArrayLike,
        view: ArrayLike,
        light: ArrayLike,
        mean: ArrayLike,
        curvedness: ArrayLike,
        shape: ArrayLike | None = None,
    ) -> NDArray[np.float64]:
        """Radiance under one distant light of irradiance pi (so that a Lambert shows A N.L).

        Args:
            colour: A, (..., c).
            normal: N, unit, (..., 3).
            view: V, unit, from the surface, (..., 3).
            light: L, unit, from the surface, (..., 3).
            mean: l H, (..., c), signed.
            curvedness: l kappa, (..., c).
            shape: l S (V - mu N), the shape operator on the view's tangent, (..., c, 3); l H times
                the tangent where there is none.

        Returns:
            (..., c).
        """
        n, v, s = (np.asarray(d, dtype=np.float64) for d in (normal, view, light))
        mu = np.clip((n * v).sum(axis=-1), 0.0, 1.0)[..., None]
        y = _curvature(mean)
        shown = self.reflected(colour, mu, y)
        if shape is None:
            turned = y[..., None] * (v - mu * n)[..., None, :]
        else:
            turned = np.asarray(shape, dtype=np.float64)
        k = self.tilt(colour, mu, curvedness)[..., None] if self.view_dependent else 0.0
        tilted = n[..., None, :] - k * turned
        tilted = tilted / np.maximum(np.linalg.norm(tilted, axis=-1, keepdims=True), 1e-300)
        cosine = np.clip((tilted * s[..., None, :]).sum(axis=-1), -1.0, 1.0)
        width = self.width(colour, mu, curvedness)
        return shown * kernel(cosine, width, self.haze(colour, mu, curvedness))


def kernel(cosine: ArrayLike, width: ArrayLike, haze: ArrayLike = 0.0) -> NDArray[np.float64]:
    """Irradiance by the cosine of the tilted normal to the light, 1 under the light.

    Its mean over all lights is 1/4 whatever width and haze.
    """
    c = np.clip(np.asarray(cosine, dtype=np.float64), -1.0, 1.0)
    own = sphere_reflectance(np.arccos(c), width)
    tail = c + HAZE_RATIO * (c**2 - 1.0 / 3.0)
    return np.asarray(np.maximum(own - np.asarray(haze, dtype=np.float64) * tail, 0.0))


def walk_model(
    method: str = RANDOM_WALK,
    alpha: float = 1.0,
    ior: float = 1.4,
    anisotropy: float = 0.0,
    bounces: float = BOUNCES,
) -> WalkModel:
    """Coefficients of a method, GGX's alpha (the node's Roughness or its square) and an index."""
    return WalkModel(flat_fit(method, alpha, ior, anisotropy, bounces), method != BURLEY)


def _polynomial(coefficients: tuple[float, ...], x: NDArray[np.float64]) -> NDArray[np.float64]:
    value = np.zeros_like(x)
    for coefficient in reversed(coefficients):
        value = value * x + coefficient
    return value


def _colour(colour: ArrayLike) -> NDArray[np.float64]:
    return np.clip(np.nan_to_num(np.asarray(colour, dtype=np.float64)), 0.0, 1.0)


def _view(mu: ArrayLike) -> NDArray[np.float64]:
    return np.clip(np.nan_to_num(np.asarray(mu, dtype=np.float64)), 0.0, 1.0)


def _curvature(value: ArrayLike) -> NDArray[np.float64]:
    """Bound it; a vertex without a curvature (NaN) is flat."""
    numbers = np.nan_to_num(np.asarray(value, dtype=np.float64), posinf=_ENDLESS, neginf=-_ENDLESS)
    return np.clip(numbers, -_ENDLESS, _ENDLESS)
