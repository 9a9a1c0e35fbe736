# SPDX-License-Identifier: GPL-3.0-or-later
"""Texture-space diffusion after d'Eon and Luebke (GPU Gems 3, chapter 14), in NumPy.

Irradiance is drawn into the surface's texture, blurred there by one Gaussian after the other, each
in two passes along u and v of seven taps, and the blurred maps are added up with the profile's
weights. The stretch of the parametrisation divides the widths. Albedo is applied by its root before
and after the blur. Maps are (texels, texels, ...), row 0 at v = 0.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, map_coordinates

from cdrf_addon.core.reflectance.profile import Profile

from ..common.arrays import Array, Mask
from .geometry import Geometry

TAPS = np.arange(-3, 4)
"""In standard deviations, as in the chapter's convolution shader."""
# A kernel wider than this part of the texture is cut: nothing is left to blur over.
MOST_SIGMA = 0.1
LEAST_STRETCH = 1e-9


def tap_weights() -> Array:
    """Weights of the seven taps, sum 1."""
    weights = np.exp(-0.5 * TAPS.astype(np.float64) ** 2)
    return np.asarray(weights / weights.sum())


@dataclass(frozen=True)
class Atlas:
    """What texels are on the surface, and how the surface is stretched there.

    Attributes:
        mask: Texels inside the UV islands, (n, n).
        triangle: Triangle of each texel; 0 outside.
        weights: Barycentric coordinates there, (n, n, 3).
        stretch: World units that a texel spans along u and along v, (n, n, 2).
    """

    mask: Mask
    triangle: NDArray[np.int64]
    weights: Array
    stretch: Array

    @property
    def size(self) -> int:
        """Texels each way."""
        return len(self.mask)

    def interpolate(self, triangles: NDArray[np.int64], values: Array) -> Array:
        """Values at the vertices to the texels of the mask, (texels, k)."""
        corners = values[triangles[self.triangle[self.mask]]]
        return np.einsum("pc,pck->pk", self.weights[self.mask], corners)


def make_atlas(vertices: Array, triangles: NDArray[np.int64], uv: Array, size: int) -> Atlas:
    """Rasterise triangles into their texture.

    Args:
        vertices: (v, 3), world units.
        triangles: (t, 3).
        uv: Texture coordinates of the triangles' corners, (t, 3, 2), in [0, 1].
        size: Texels each way.
    """
    corners = uv * size
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    area = _cross(b - a, c - a)
    triangle = np.zeros((size, size), dtype=np.int64)
    weights = np.zeros((size, size, 3))
    mask = np.zeros((size, size), dtype=bool)
    low = np.floor(corners.min(axis=1) - 0.5).astype(np.int64)
    side = (np.ceil(corners.max(axis=1) - 0.5).astype(np.int64) - low + 1).max(axis=1)
    usable = np.abs(area) > 1e-12
    for step in range(math.ceil(math.log2(max(int(side.max()), 2))) + 1):
        # Triangles of about one size together, each tried on a square of texels.
        span = 2**step
        chosen = np.flatnonzero(usable & (side <= span) & (side > span // 2))
        offsets = np.indices((span, span)).reshape(2, -1).T[:, ::-1]
        for part in np.array_split(chosen, max(1, len(chosen) * span**2 // 2_000_000)):
            texel = low[part][:, None] + offsets
            place = texel + 0.5
            first = _cross(c[part, None] - b[part, None], place - b[part, None])
            second = _cross(a[part, None] - c[part, None], place - c[part, None])
            bary = np.stack((first, second), axis=-1) / area[part][:, None, None]
            bary = np.concatenate((bary, 1.0 - bary.sum(axis=-1, keepdims=True)), axis=-1)
            inside = (bary >= -1e-9).all(axis=-1)
            inside &= ((texel >= 0) & (texel < size)).all(axis=-1)
            x, y = texel[inside].T
            mask[y, x] = True
            triangle[y, x] = np.broadcast_to(part[:, None], inside.shape)[inside]
            weights[y, x] = bary[inside]
    return Atlas(mask, triangle, weights, _stretch(vertices, triangles, corners)[triangle])


def _cross(one: Array, other: Array) -> Array:
    return np.asarray(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0])


def _stretch(vertices: Array, triangles: NDArray[np.int64], corners: Array) -> Array:
    """Lengths of dP/du and dP/dv of each triangle, per texel, (t, 2)."""
    p = vertices[triangles]
    edges = np.stack((p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    d = np.stack((corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    area = _cross(d[:, 0], d[:, 1])
    area = np.where(np.abs(area) > 1e-12, area, np.inf)[:, None]
    along_u = (edges[:, 0] * d[:, 1, 1, None] - edges[:, 1] * d[:, 0, 1, None]) / area
    along_v = (edges[:, 1] * d[:, 0, 0, None] - edges[:, 0] * d[:, 1, 0, None]) / area
    lengths = np.stack([np.linalg.norm(axis, axis=1) for axis in (along_u, along_v)], axis=1)
    return np.maximum(lengths, LEAST_STRETCH)


@dataclass
class Cost:
    """What a run did."""

    passes: int = 0
    texels: int = 0
    taps: int = 0
    """Texture reads of all channels together."""
    seconds: dict[str, float] = field(default_factory=dict)


def blur(values: Array, atlas: Atlas, sigma: float, cost: Cost | None = None) -> Array:
    """Blur by a Gaussian of a width in world units, along u, then along v.

    What is outside the islands does not count: a constant stays what it is.

    Args:
        values: (n, n, k), 0 outside the mask.
        atlas: Of the surface.
        sigma: Standard deviation, world units.
        cost: Counts the passes.
    """
    rows, columns = np.nonzero(atlas.mask)
    taps = tap_weights()
    present = atlas.mask.astype(np.float64)
    for axis, direction in ((0, (0.0, 1.0)), (1, (1.0, 0.0))):
        texels = np.minimum(sigma / atlas.stretch[rows, columns, axis], MOST_SIGMA * atlas.size)
        total = np.zeros((len(rows), values.shape[2]))
        weight = np.zeros(len(rows))
        for tap, share in zip(TAPS, taps, strict=True):
            place = [base + tap * texels * way
                     for base, way in zip((rows, columns), direction, strict=True)]  # fmt: skip
            read = {"order": 1, "mode": "constant", "cval": 0.0, "prefilter": False}
            weight += share * map_coordinates(present, place, **read)
            for channel in range(values.shape[2]):
                total[:, channel] += share * map_coordinates(values[..., channel], place, **read)
        values = np.zeros_like(values)
        values[rows, columns] = total / weight[:, None]
        if cost is not None:
            cost.passes += 1
            cost.texels = len(rows)
            cost.taps += len(TAPS) * len(rows)
    return values


def diffuse(irradiance: Array, atlas: Atlas, profile: Profile, millimetres: float,
            cost: Cost | None = None) -> Array:  # fmt: skip
    """Blur irradiance by a profile.

    Args:
        irradiance: (n, n, 3), 0 outside the mask.
        atlas: Of the surface.
        profile: Widths in mm.
        millimetres: In a world unit.
        cost: Counts the passes.
    """
    weights = np.array(profile.weights) / np.sum(profile.weights, axis=0)
    total = np.zeros_like(irradiance)
    blurred, variance = irradiance, 0.0
    for width, parts in sorted(zip(profile.widths, weights, strict=True), key=lambda one: one[0]):
        # Gaussians convolve to Gaussians: each starts from the one before.
        step = math.sqrt(width**2 - variance) / millimetres
        blurred = blur(blurred, atlas, step, cost)
        variance = width**2
        total += blurred * parts
    return total


def spread_out(values: Array, mask: Mask) -> Array:
    """Fill what lies outside the islands with the nearest texel: filtering finds no edge."""
    nearest = distance_transform_edt(~mask, return_distances=False, return_indices=True)
    return np.asarray(values[tuple(nearest)])


def sample(values: Array, uv: Array) -> Array:
    """Read a texture bilinearly at (p, 2) coordinates; (p, k)."""
    size = len(values)
    place = [uv[:, 1] * size - 0.5, uv[:, 0] * size - 0.5]
    read = {"order": 1, "mode": "nearest", "prefilter": False}
    channels = [
        map_coordinates(values[..., channel], place, **read) for channel in range(values.shape[2])
    ]
    return np.stack(channels, axis=1)


Lighting = Callable[[Array, Array], Array]
"""(positions, normals) to radiance of a white surface there, (n, 3)."""


def shade(geometry: Geometry, lighting: Lighting, albedo: Array, profile: Profile,
          millimetres: float, size: int) -> tuple[Array, Cost]:  # fmt: skip
    """Shade the pixels of a shape by texture blurring.

    Args:
        geometry: With UVs.
        lighting: What arrives at the surface; timed apart, as a renderer has it anyway.
        albedo: (3,).
        profile: Widths in mm.
        millimetres: In a world unit.
        size: Texels each way.

    Returns:
        Radiance at each hit, (p, 3), and the cost.
    """
    assert geometry.corners is not None
    shape, hits, cost = geometry.shape, geometry.hits, Cost()

    def timed(name: str, start: float) -> float:
        now = time.perf_counter()
        cost.seconds[name] = now - start
        return now

    start = time.perf_counter()
    atlas = make_atlas(shape.vertices, shape.triangles, geometry.corners, size)
    start = timed("maps", start)
    places = atlas.interpolate(shape.triangles, shape.vertices)
    normals = atlas.interpolate(shape.triangles, shape.normals)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    arriving = lighting(places, normals)
    start = timed("light", start)
    irradiance = np.zeros((size, size, 3))
    irradiance[atlas.mask] = arriving * np.sqrt(albedo)
    blurred = diffuse(irradiance, atlas, profile, millimetres, cost)
    start = timed("blur", start)
    uv = np.einsum("pc,pck->pk", hits.weights, geometry.corners[hits.triangle])
    found = sample(spread_out(blurred, atlas.mask), uv) * np.sqrt(albedo)
    timed("composition", start)
    return found, cost
