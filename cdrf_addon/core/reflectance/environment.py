# SPDX-License-Identifier: GPL-3.0-or-later
"""Light from all around: a world's radiance as spherical harmonics, filtered as the skin filters.

The irradiance of a convex surface is its surroundings' radiance blurred by max(cos, 0), and 99 % of
it lies in the bands 0 to 2 (Ramamoorthi and Hanrahan 2001). A translucent sphere blurs with
f(theta, sigma) instead, so band l is multiplied by

    A_l(sigma) = 2 pi integral of f(theta, sigma) P_l(cos theta) sin theta d theta,

which for diffusion on the sphere is A_l(0) exp(-l (l + 1) sigma^2 / 2), A_l(0) = pi, 2 pi/3, pi/4.

One small bright source (the sun of an HDRI) has more in the higher bands than three can hold: it is
taken out and shaded like any other light of its size.

Directions are world space, Z up. Arrays of harmonics are (9, 3): m within l, then the colours.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ..errors import ParameterError
from .lut import DEFAULT_LAYOUT, VARIANCE_MAX, LutLayout, cosine_axis
from .model import SPHERE, Model

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

BANDS = 3
LAMBERT_FACTORS = (math.pi, 2.0 * math.pi / 3.0, math.pi / 4.0)
"""A_l(0), l = 0, 1, 2."""
BAND_OF = (0, 1, 1, 1, 2, 2, 2, 2, 2)
"""Band of each harmonic."""

# Real orthonormal harmonics as polynomials of the direction, in the order of `polynomials`.
_NORMS = (
    math.sqrt(1.0 / (4.0 * math.pi)),
    *(math.sqrt(3.0 / (4.0 * math.pi)),) * 3,
    *(math.sqrt(15.0 / (4.0 * math.pi)),) * 3,
    math.sqrt(5.0 / (16.0 * math.pi)),
    math.sqrt(15.0 / (16.0 * math.pi)),
)

BAND_ROWS = 512
"""Rows of a table of band factors: between them they are linear to 3e-5."""

# A source is taken out if it is this many times brighter than the mean, lies within this angle of
# its brightest spot, and gives at least this part of the mean irradiance.
BRIGHT = 4.0
SUN_REACH = math.radians(30.0)
LEAST_SUN = 0.1
# What a half float holds: brighter pixels of an HDRI are mistakes.
MOST_RADIANCE = 65504.0


@dataclass(frozen=True)
class Sun:
    """The one bright spot of a world, as a distant light."""

    direction: tuple[float, float, float]
    """Unit vector towards it."""
    radiance: tuple[float, float, float]
    """What a white Lambert surface facing it sends out, per channel: irradiance / pi."""
    sin2_half_angle: float
    """Squared sine of the half-angle of a disc that is spread as it is."""


@dataclass(frozen=True)
class Environment:
    """What lights a convex surface from all around."""

    harmonics: NDArray[np.float64]
    """(9, 3): radiance in bands 0 to 2, the sun's left out."""
    sun: Sun | None = None

    @property
    def is_black(self) -> bool:
        """Tell whether nothing comes from anywhere."""
        return self.sun is None and not np.abs(self.harmonics).max() > 0.0

    @property
    def is_uniform(self) -> bool:
        """Tell whether the same comes from everywhere, to a part in ten thousand."""
        rest = float(np.abs(self.harmonics[1:]).max())
        return self.sun is None and rest <= 1e-4 * float(np.abs(self.harmonics[0]).max())


def polynomials(direction: ArrayLike) -> NDArray[np.float64]:
    """Polynomials behind the harmonics, (..., 9): 1; x, y, z; xy, yz, zx; 3z^2-1, x^2-y^2."""
    d = np.asarray(direction, dtype=np.float64)
    x, y, z = np.moveaxis(d, -1, 0)
    return np.stack(
        (np.ones_like(x), x, y, z, x * y, y * z, z * x, 3.0 * z * z - 1.0, x * x - y * y), axis=-1
    )


def panorama_directions(height: int, width: int) -> NDArray[np.float64]:
    """Directions of an equirectangular picture's pixels, (height, width, 3), row 0 at the bottom.

    The picture of a camera that looks along +Y with +Z up: its centre is +Y, its right half +X.
    """
    azimuth = 2.0 * math.pi * ((np.arange(width) + 0.5) / width - 0.5)
    elevation = math.pi * ((np.arange(height) + 0.5) / height - 0.5)[:, None]
    around = np.cos(elevation)
    x, y = around * np.sin(azimuth), around * np.cos(azimuth)
    return np.stack((x, y, np.broadcast_to(np.sin(elevation), x.shape)), axis=-1)


def solid_angles(height: int, width: int) -> NDArray[np.float64]:
    """Solid angle of each pixel, (height, 1); they add up to 4 pi exactly."""
    edges = np.sin(math.pi * (np.arange(height + 1) / height - 0.5))
    return np.asarray(np.diff(edges)[:, None] * (2.0 * math.pi / width))


def project(panorama: ArrayLike, *, sun_threshold: float = 0.0) -> Environment:
    """Sum up a panorama.

    Args:
        panorama: Radiance, (height, width, 3), laid out as in `panorama_directions`. What is no
            number or negative counts as black.
        sun_threshold: As Blender's World > Sun Threshold: what is brighter than this, or than a few
            times the mean, may be taken out as a sun. 0 takes nothing out.

    Raises:
        ParameterError: The panorama has another shape.
    """
    picture = np.asarray(panorama, dtype=np.float64)
    if picture.ndim != 3 or picture.shape[2] != 3 or min(picture.shape) < 2:
        raise ParameterError(f"A panorama is (height, width, 3), not {picture.shape}.")
    picture = np.clip(np.nan_to_num(picture, posinf=MOST_RADIANCE, neginf=0.0), 0.0, MOST_RADIANCE)
    height, width, _ = picture.shape
    direction = panorama_directions(height, width)
    weight = solid_angles(height, width)
    sun, picture = _take_sun(picture, direction, weight, sun_threshold)
    basis = polynomials(direction) * _NORMS
    harmonics = np.einsum("hwk,hwc,hx->kc", basis, picture, weight, optimize=True)
    return Environment(harmonics, sun)


def _take_sun(
    picture: NDArray[np.float64],
    direction: NDArray[np.float64],
    weight: NDArray[np.float64],
    threshold: float,
) -> tuple[Sun | None, NDArray[np.float64]]:
    """Split a panorama into its sun, if it has one, and the rest."""
    peak = picture.max(axis=-1)
    mean = float((picture * weight[..., None]).sum()) / 4.0  # irradiance averaged over the sphere
    threshold = min(threshold, BRIGHT * mean / (3.0 * math.pi))
    if not (threshold > 0.0 and peak.max() > threshold):
        return None, picture
    excess = picture * np.clip(1.0 - threshold / np.maximum(peak, threshold), 0.0, 1.0)[..., None]
    # The brightest spot is where most light comes from, not the brightest pixel.
    flux = excess * weight[..., None]
    total = flux.sum(axis=-1)
    centre = _brightest(total, direction)
    near = direction @ centre >= math.cos(SUN_REACH)
    flux = flux * near[..., None]
    resultant = np.einsum("hwc,hwk->ck", flux, direction)
    axis = resultant.sum(axis=0)
    length = float(np.linalg.norm(axis))
    if not length / 4.0 >= LEAST_SUN * mean:
        return None, picture
    axis = axis / length
    red, green, blue = (float(v) for v in np.maximum(resultant @ axis, 0.0) / math.pi)
    # A uniform disc of half-angle w has the mean cosine (1 + cos w) / 2 to its centre.
    cosine = float(np.clip(2.0 * length / float(flux.sum()) - 1.0, 0.0, 1.0))
    x, y, z = (float(v) for v in axis)
    sun = Sun((x, y, z), (red, green, blue), 1.0 - cosine**2)
    return sun, picture - excess * near[..., None]


def _brightest(flux: NDArray[np.float64], direction: NDArray[np.float64]) -> NDArray[np.float64]:
    """Direction around which most flux lies: mean shift from the strongest pixel, (3,)."""
    flat, towards = flux.ravel(), direction.reshape(-1, 3)
    # Rows near the poles have narrow pixels, so the start is sought in coarse cells.
    cells = np.round(towards * 8.0).astype(np.int64) @ np.array([1, 64, 4096])
    names, member = np.unique(cells, return_inverse=True)
    sums = np.bincount(member.ravel(), weights=flat, minlength=len(names))
    inside = member.ravel() == int(sums.argmax())
    centre = flat[inside] @ towards[inside]
    for _ in range(3):
        centre = centre / np.linalg.norm(centre)
        inside = towards @ centre >= math.cos(SUN_REACH)
        centre = flat[inside] @ towards[inside]
    return np.asarray(centre / np.linalg.norm(centre))


def uniform(colour: ArrayLike) -> Environment:
    """The environment in which the same radiance comes from everywhere."""
    harmonics = np.zeros((9, 3))
    harmonics[0] = np.asarray(colour, dtype=np.float64) / _NORMS[0]
    return Environment(harmonics)


def shader_coefficients(harmonics: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients of `polynomials` in the radiance of a white Lambert surface, (9, 3).

    Norms and A_l(0) / pi are multiplied in; what is left to the shader are the factors
    A_l(sigma) / A_l(0).
    """
    factors = np.array([LAMBERT_FACTORS[band] for band in BAND_OF]) / math.pi
    return np.asarray(harmonics * (np.array(_NORMS) * factors)[:, None])


def lit_by(
    harmonics: NDArray[np.float64], normal: ArrayLike, factors: ArrayLike
) -> NDArray[np.float64]:
    """Radiance of a white surface under the harmonics, as the shader computes it.

    Args:
        harmonics: (9, 3).
        normal: Unit vectors, (..., 3).
        factors: `band_factors` of each channel, (3 channels, 3 bands).

    Returns:
        (..., 3), never negative.
    """
    each = np.asarray(factors, dtype=np.float64).T[list(BAND_OF)]
    value = polynomials(normal) @ (shader_coefficients(harmonics) * each)
    return np.asarray(np.maximum(value, 0.0))


def band_factors(model: Model, sigma: ArrayLike) -> NDArray[np.float64]:
    """A_l(sigma) / A_l(0) for l = 0, 1, 2: what is left of each band.

    In closed form on the sphere, where 1 is left of band 0: no energy is won or lost. Else by
    Gauss-Legendre quadrature on both sides of the terminator, 1e-7.

    Returns:
        (..., 3 bands) of sigma's shape; (..., 3 channels, 3 bands) where the model has colour.
    """
    width = np.asarray(sigma, dtype=np.float64)
    if model.kind == SPHERE:
        with np.errstate(over="ignore", under="ignore"):
            left = np.exp(-(width**2))
            return np.stack((np.ones_like(left), left, left**3), axis=-1)
    nodes, weights = _quadrature()
    value = model.evaluate(np.arccos(nodes), width[..., None])
    legendre = np.stack((np.ones_like(nodes), nodes, 1.5 * nodes**2 - 0.5), axis=-1)
    measure = 2.0 * math.pi * weights[:, None] * legendre / LAMBERT_FACTORS
    if model.colour:
        return np.asarray(np.einsum("...nc,nl->...cl", value, measure))
    return np.asarray(value @ measure)


def _quadrature(nodes: int = 48) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Nodes and weights in cos theta, with intervals that halve towards the terminator.

    f has a layer as thin as sigma there; what is left out of it is below 2^-20.
    """
    x, w = np.polynomial.legendre.leggauss(nodes)
    edges = [0.0, *(2.0**-k for k in range(10, -1, -2))]
    places, weights = [], []
    for low, high in pairwise(edges):
        half = (high - low) / 2.0
        for sign in (-1.0, 1.0):
            places.append(sign * (low + half * (x + 1.0)))
            weights.append(half * w)
    return np.concatenate(places), np.concatenate(weights)


def bands_of_table(
    table: NDArray[np.float64], layout: LutLayout = DEFAULT_LAYOUT
) -> NDArray[np.float64]:
    """Band factors of a model by its look-up table, which a file holds where the model is gone.

    Accurate to 1e-4, read as the shader reads it.

    Args:
        table: (height, width, 3) or (height, width), as of `lut.build_lut`.
        layout: The table's.

    Returns:
        (BAND_ROWS, 3 channels, 3 bands), rows evenly over the table's own axis of sigma.
    """
    from scipy.interpolate import CubicSpline  # late: scipy takes 0.2 s to load

    wide = np.asarray(table, dtype=np.float64)
    if wide.ndim == 2:
        wide = np.repeat(wide[..., None], 3, axis=2)
    # Over q = sign(c) sqrt|c|, where the table is smooth; margins repeat the end columns.
    q, columns = np.unique(_root(cosine_axis(layout)), return_index=True)
    x, w = np.polynomial.legendre.leggauss(48)
    place = np.concatenate((x - 1.0, x + 1.0)) / 2.0
    value = CubicSpline(q, wide[:, columns], axis=1)(place)
    cosine = place * np.abs(place)
    measure = np.concatenate((w, w)) * np.abs(place)  # dc = 2 |q| dq, and half an interval
    legendre = np.stack((np.ones_like(cosine), cosine, 1.5 * cosine**2 - 0.5), axis=-1)
    integral = np.einsum("hqc,ql->hcl", value, legendre * measure[:, None])
    factors = 2.0 * math.pi * integral / LAMBERT_FACTORS
    factors[0] = 1.0  # sigma = 0
    rows = np.linspace(0.0, 1.0, layout.height)
    return np.asarray(CubicSpline(rows, factors)(np.linspace(0.0, 1.0, BAND_ROWS)))


def _root(cosine: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.sign(cosine) * np.sqrt(np.abs(cosine)))


def sample_bands(bands: NDArray[np.float64], variance: ArrayLike) -> NDArray[np.float64]:
    """Read `bands_of_table` as the shader does, (..., 3 channels, 3 bands)."""
    part = np.minimum(np.asarray(variance, dtype=np.float64) / VARIANCE_MAX, 1.0) ** 0.25
    place = part * (BAND_ROWS - 1.0)
    row = np.minimum(place.astype(np.int64), BAND_ROWS - 2)
    up = (place - row)[..., None, None]
    return np.asarray(bands[row] * (1.0 - up) + bands[row + 1] * up)


def reduce_picture(pixels: NDArray[np.float32], height: int, width: int) -> NDArray[np.float32]:
    """Shrink a picture to (height, width, channels) by the mean of the pixels under each new one.

    Unlike a renderer's samples this misses no pixel: the sun of an HDRI is a few of millions.
    """
    rows = np.linspace(0.0, pixels.shape[0], height, endpoint=False).astype(np.int64)
    columns = np.linspace(0.0, pixels.shape[1], width, endpoint=False).astype(np.int64)
    sums = np.add.reduceat(pixels, rows, axis=0, dtype=np.float64)
    sums = np.add.reduceat(sums, columns, axis=1)
    high = np.diff(np.append(rows, pixels.shape[0]))
    wide = np.diff(np.append(columns, pixels.shape[1]))
    return np.asarray(sums / (high[:, None] * wide)[..., None], dtype=np.float32)
