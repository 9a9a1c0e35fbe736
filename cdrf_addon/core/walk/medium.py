# SPDX-License-Identifier: GPL-3.0-or-later
"""The medium in which Cycles' subsurface methods walk, from what is set on the node.

Each method has its own reading of colour and radius. Source of every figure: Blender,
intern/cycles/kernel/closure/bssrdf.h and integrator/subsurface_random_walk.h at 5.3 alpha (commit
e5f416414 took the radius' factor away) and at 4.5; the papers are named beside the formulas.

    method               albedo of a scattering   mean free path           entry
    RANDOM_WALK (5.2)    van de Hulst             radius                   refracted
    RANDOM_WALK_LEGACY   Chiang et al.            radius / (4 pi)          refracted
    RANDOM_WALK (4.5)    the same as legacy, under the newer one's name
    RANDOM_WALK_SKIN     Chiang et al.            radius sqrt(3 (1 - a'))  half by cosine, half
                                                                           refracted, roughness 1
    BURLEY               a profile on the surface, nothing walks: no view dependence

An anisotropic walk goes on as the isotropic one of similar moments after its tenth flight, in
Cycles as here; `mean_free_path` and `single_scattering` are those reduced ones, the rest is in
`first_free_path` and `first_scattering`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..errors import ParameterError
from ..scattering.dipole import mismatch
from ..scattering.node_radius import BURLEY, LEGACY, OLD_FREE_PATH, RANDOM_WALK, SKIN
from .entry import LEAST_IOR, MOST_IOR

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

METHODS = (RANDOM_WALK, SKIN, LEGACY, BURLEY)
# A walk that has scattered this often is given up (BSSRDF_MAX_BOUNCES).
BOUNCES = 256
# From this flight on the medium is the isotropic one.
SIMILAR_FROM = 10
MOST_ALBEDO = 0.999999
# Media that scatter less walk with this albedo and are darkened by what it is too much.
LEAST_ALBEDO = 0.2
MOST_ANISOTROPY, OLD_ANISOTROPY = 0.99, 0.9
# Part of the skin variant's walks that enter by the cosine law.
SKIN_DIFFUSE = 0.5


@dataclass(frozen=True)
class WalkMedium:
    """What walks in, for any number of channels; every array is of the colour's shape."""

    method: str
    """RANDOM_WALK, RANDOM_WALK_SKIN, RANDOM_WALK_LEGACY or BURLEY."""
    colour: NDArray[np.float64]
    """Base colour A, in [0, 1]."""
    single_scattering: NDArray[np.float64]
    """Albedo of a scattering, of the reduced (isotropic) medium."""
    mean_free_path: NDArray[np.float64]
    """Of the reduced medium, in the radius' unit. With BURLEY the profile's d."""
    first_scattering: NDArray[np.float64]
    """Albedo of the first ten scatterings; the same where the anisotropy is 0."""
    first_free_path: NDArray[np.float64]
    """Mean length of the first ten flights."""
    darkening: NDArray[np.float64]
    """Factor on all that gets out: below 1 where Cycles raised the albedo to LEAST_ALBEDO."""
    anisotropy: float
    """Mean cosine of the first ten scatterings."""
    alpha: float
    """GGX's alpha at the entry: the SSS node's Roughness, the square of the Principled's."""
    ior: float
    diffuse: float
    """Part of the walks that enter by the cosine law, whatever the view."""

    @property
    def view_dependent(self) -> bool:
        """False where the method knows no view: G = E = 1 and no tilt."""
        return self.method != BURLEY

    @property
    def equivalent_colour(self) -> NDArray[np.float64]:
        """Colour of which van de Hulst's inversion makes this medium; in [0, 1]."""
        return colour_of(self.single_scattering)


def van_de_hulst(colour: ArrayLike) -> NDArray[np.float64]:
    """Similarity parameter s, 1 - s^2 the reduced albedo, of a half-space of that colour.

    Van de Hulst's relation, inverted (d'Eon, A Hitchhiker's Guide to Multiple Scattering, v0.3.2,
    eq. 53.7); 0 for white, 1 for black.
    """
    a = np.clip(np.asarray(colour, dtype=np.float64), 0.0, 1.0)
    s = 4.20863 * a - np.sqrt(9.59217 + 41.6808 * a + 17.7126 * a * a) + 4.09712
    return np.asarray(np.clip(s, 0.0, 1.0))


def colour_of(single_scattering: ArrayLike) -> NDArray[np.float64]:
    """Invert `van_de_hulst`: the colour of a half-space of this reduced albedo, in [0, 1].

    The root of a quadratic: (4.20863 a + 4.09712 - s)^2 = 9.59217 + 41.6808 a + 17.7126 a^2 has
    no term a^2, as 4.20863^2 is 17.7126.
    """
    s = np.sqrt(1.0 - np.clip(np.asarray(single_scattering, dtype=np.float64), 0.0, 1.0))
    rest = 4.09712 - s
    return np.asarray(np.clip((9.59217 - rest**2) / (2.0 * 4.20863 * rest - 41.6808), 0.0, 1.0))


# Chiang, Kutz and Burley 2016 for g = 0, with the polynomials in g of Wrenninge, Villemin and Hery
# 2017: lowest power first; B and E are offset + factor exp(polynomial).
_A: tuple[float, ...] = (1.8260523782, -1.28451056436, -1.79904629312, 9.19393289202)
_A += (-22.8215585862, 32.0234874259, -23.6264803333, 7.21067002658)
_B: tuple[float, ...] = (0.0, 31.1491581433, -201.847017512, 841.576016723)
_B += (-2018.09288505, 2731.71560286, -1935.41424244, 559.009054474)
_C: tuple[float, ...] = (1.09686102424, -0.394704063468, 1.05258115941, -8.83963712726)
_C += (28.8643230661, -46.8802913581, 38.5402837518, -12.7181042538)
_D: tuple[float, ...] = (0.496310210422, 0.360146581622, -2.15139309747, 17.8896899217)
_D += (-55.2984010333, 82.065982243, -58.5106008578, 15.8478295021)
_E: tuple[float, ...] = (0.0, 76.7316253952, -594.356773233, 2448.8834203)
_E += (-5576.68528998, 7116.60171912, -4763.54467887, 1303.5318055)
_F: tuple[float, ...] = (2.40602999408, -2.51814844609, 9.18494908356, -79.2191708682)
_F += (259.082868209, -403.613804597, 302.85712436, -87.4370473567)


def chiang(colour: ArrayLike, anisotropy: float = 0.0) -> NDArray[np.float64]:
    """Albedo of a scattering for a colour, as the older walks take it; anisotropy 0 to 0.9.

    It was fitted to walks with an end, and so makes up for the light lost there: above a colour of
    0.8 it is higher than van de Hulst's, and 1 from about 0.95 on.
    """
    a = np.clip(np.asarray(colour, dtype=np.float64), 0.0, 1.0)

    def at(coefficients: tuple[float, ...]) -> float:
        return float(np.polynomial.polynomial.polyval(anisotropy, coefficients))

    b = 4.98511194385 + 0.127355959438 * math.exp(at(_B))
    e = 4.23190299701 + 0.00310603949088 * math.exp(at(_E))
    blend = a**0.25
    dark = (1.0 - blend) * at(_A) * np.arctan(b * a) ** at(_C)
    light = blend * at(_D) * np.arctan(e * a) ** at(_F)
    return np.asarray(np.clip(dark + light, 0.0, MOST_ALBEDO))


def random_walk(
    colour: ArrayLike,
    radius: ArrayLike,
    anisotropy: float = 0.0,
    alpha: float = 1.0,
    ior: float = 1.4,
) -> WalkMedium:
    """Random Walk of 5.2 and later: van de Hulst's albedo, the radius itself as the free path."""
    g = min(max(float(anisotropy), -MOST_ANISOTROPY), MOST_ANISOTROPY)
    square = van_de_hulst(colour) ** 2
    albedo = np.minimum((1.0 - square) / (1.0 - g * square), MOST_ALBEDO)
    return _medium(RANDOM_WALK, colour, albedo, np.asarray(radius), g, alpha, ior)


def legacy(
    colour: ArrayLike,
    radius: ArrayLike,
    anisotropy: float = 0.0,
    alpha: float = 1.0,
    ior: float = 1.4,
) -> WalkMedium:
    """Random Walk (Legacy) of 5.2 and later, and Random Walk up to 5.1.

    4.5 ends the anisotropy at 0; negative ones are van de Hulst's in the newer ones.
    """
    g = min(max(float(anisotropy), -MOST_ANISOTROPY), OLD_ANISOTROPY)
    albedo, path = _old(colour, np.asarray(radius) * OLD_FREE_PATH, g)
    return _medium(LEGACY, colour, albedo, path, g, alpha, ior)


def skin(
    colour: ArrayLike,
    radius: ArrayLike,
    anisotropy: float = 0.0,
    alpha: float = 1.0,
    ior: float = 1.4,
) -> WalkMedium:
    """Random Walk (Skin): its roughness is always 1, and half of its walks know no view.

    The radius times sqrt(3 (1 - a')), a' the albedo of the dipole with that colour (Jensen et al.
    2001), found by halving twelve times as Cycles does. `alpha` is taken and not used.
    """
    g = min(max(float(anisotropy), -MOST_ANISOTROPY), OLD_ANISOTROPY)
    index = min(max(float(ior), LEAST_IOR), MOST_IOR)
    albedo, path = _old(colour, np.asarray(radius) * _dipole_path(colour, index), g)
    del alpha
    return _medium(SKIN, colour, albedo, path, g, 1.0, ior, SKIN_DIFFUSE)


def burley(
    colour: ArrayLike,
    radius: ArrayLike,
    anisotropy: float = 0.0,
    alpha: float = 1.0,
    ior: float = 1.4,
) -> WalkMedium:
    """Christensen-Burley: `mean_free_path` is the profile's d (Christensen and Burley 2015)."""
    a = np.clip(np.asarray(colour, dtype=np.float64), 0.0, 1.0)
    d = np.asarray(radius) * OLD_FREE_PATH / (1.9 - a + 3.5 * (a - 0.8) ** 2)
    albedo = 1.0 - van_de_hulst(a) ** 2
    del anisotropy
    return _medium(BURLEY, a, albedo, d, 0.0, alpha, ior, 1.0)


def medium(
    method: str,
    colour: ArrayLike,
    radius: ArrayLike,
    anisotropy: float = 0.0,
    alpha: float = 1.0,
    ior: float = 1.4,
    version: tuple[int, int] = (5, 2),
) -> WalkMedium:
    """Return the medium of a node, by Blender's name of its method.

    Args:
        method: As on the node; a name that is not known counts as RANDOM_WALK.
        colour: Base colour, any shape.
        radius: Radius times scale, broadcast against the colour; the unit of what comes back.
        anisotropy: The node's.
        alpha: GGX's, the node's Roughness (Subsurface Scattering) or its square (Principled).
        ior: The node's.
        version: Blender's: up to 5.1 RANDOM_WALK is what is called legacy now.

    Raises:
        ParameterError: A number is none, or a radius is negative.
    """
    makers = {SKIN: skin, LEGACY: legacy, BURLEY: burley}
    if not np.isfinite(np.array([anisotropy, alpha, ior], dtype=np.float64)).all():
        raise ParameterError("Anisotropy, roughness and index of a medium must be finite numbers.")
    if not np.isfinite(np.asarray(colour, dtype=np.float64)).all():
        raise ParameterError("The colour of a medium must be of finite numbers.")
    lengths = np.asarray(radius, dtype=np.float64)
    if not np.isfinite(lengths).all() or (lengths < 0.0).any():
        raise ParameterError("The radius of a medium must be of finite numbers of 0 or more.")
    make = makers.get(method, legacy if version < (5, 2) else random_walk)
    if version < (5, 2) and make is not burley:
        anisotropy = max(anisotropy, 0.0)
    return make(colour, lengths, anisotropy, alpha, ior)


def _old(
    colour: ArrayLike, path: NDArray[np.float64], g: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Albedo and mean free path of a flight, before 5.2; there the path is the reduced one's."""
    if g < 0.0:
        square = van_de_hulst(colour) ** 2
        return np.minimum((1.0 - square) / (1.0 - g * square), MOST_ALBEDO), path
    return chiang(colour, g), path * (1.0 - g)


def _dipole_path(colour: ArrayLike, ior: float) -> NDArray[np.float64]:
    a = np.clip(np.asarray(colour, dtype=np.float64), 0.0, 1.0)
    depth = 4.0 / 3.0 * mismatch(ior)
    low, high, middle = np.zeros_like(a), np.ones_like(a), np.zeros_like(a)
    for _ in range(12):
        middle = (low + high) / 2.0
        s = np.sqrt(3.0 * (1.0 - middle))
        less = middle / 2.0 * (1.0 + np.exp(-depth * s)) * np.exp(-s) < a
        low, high = np.where(less, middle, low), np.where(less, high, middle)
    ends = np.where(a < 1e-4, 0.0, np.where(a >= 0.995, MOST_ALBEDO, middle))
    return np.asarray(np.sqrt(3.0 * (1.0 - ends)))


def _medium(
    method: str,
    colour: ArrayLike,
    albedo: NDArray[np.float64],
    path: NDArray[np.float64],
    g: float,
    alpha: float,
    ior: float,
    diffuse: float = 0.0,
) -> WalkMedium:
    a = np.clip(np.asarray(colour, dtype=np.float64), 0.0, 1.0)
    a, albedo, path = np.broadcast_arrays(a, albedo, np.asarray(path, dtype=np.float64))
    walked = np.maximum(albedo, LEAST_ALBEDO)
    return WalkMedium(
        method,
        a,
        walked * (1.0 - g) / (1.0 - walked * g),
        path / (1.0 - walked * g),
        walked,
        path,
        albedo / walked,
        g,
        min(max(float(alpha), 0.0), 1.0),
        min(max(float(ior), LEAST_IOR), MOST_IOR),
        diffuse,
    )
