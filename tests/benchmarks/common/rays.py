# SPDX-License-Identifier: GPL-3.0-or-later
"""Casts rays: what the camera sees of a shape, what a light reaches, what is near a rim."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import bpy  # noqa: F401  (mathutils is only there after it)
import igl
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .arrays import Array, Mask
from .shapes import Shape

ORTHO_SCALE = 3.0
SHADOW_OFFSET = 0.002
FAR = 1e3
OPEN_MARGIN = 0.3
"""Pixels this close to the rim of an open mesh are left out: light escapes through the hole."""


@dataclass(frozen=True)
class Hits:
    """What the camera's rays meet: flat arrays over the pixels that hit."""

    pixel: NDArray[np.int64]
    triangle: NDArray[np.int64]
    weights: Array
    position: Array

    def interpolate(self, shape: Shape, values: Array) -> Array:
        """Interpolate values at the vertices of the shape, (n, k)."""
        corners = values[shape.triangles[self.triangle]]
        return np.einsum("pc,pck->pk", self.weights, corners)

    def take(self, keep: NDArray[Any]) -> Hits:
        """Choose pixels."""
        return Hits(*(array[keep] for array in vars(self).values()))


def tree_of(shape: Shape) -> BVHTree:
    """Return the tree of a shape that rays are cast into."""
    return BVHTree.FromPolygons(shape.vertices.tolist(), shape.triangles.tolist())


def cast_camera(shape: Shape, size: int) -> Hits:
    """Cast one ray through the middle of every pixel; row 0 at the bottom."""
    tree = tree_of(shape)
    steps = (np.arange(size) + 0.5 - size / 2.0) / size * ORTHO_SCALE
    found = []
    for number, (z, x) in enumerate(itertools.product(steps, steps)):
        place, _, triangle, _ = tree.ray_cast(Vector((x, -10.0, z)), Vector((0.0, 1.0, 0.0)))
        if place is not None:
            found.append((number, triangle, *place))
    table = np.array(found)
    triangle = table[:, 1].astype(np.int64)
    position = table[:, 2:]
    a, b, c = np.moveaxis(shape.vertices[shape.triangles[triangle]], 1, 0)
    weights = igl.barycentric_coordinates(*map(np.ascontiguousarray, (position, a, b, c)))
    weights = np.clip(weights, 0.0, 1.0)
    weights /= weights.sum(axis=1, keepdims=True)
    return Hits(table[:, 0].astype(np.int64), triangle, weights, position)


def reached(
    tree: BVHTree, places: Array, normals: Array, towards: Array, distances: Array | None = None
) -> Mask:
    """Return which places on a surface a light reaches, by rays.

    Args:
        tree: Of what may be in the way.
        places: Positions on the surface, (n, 3).
        normals: Unit normals there, (n, 3); rays start SHADOW_OFFSET along them.
        towards: Unit vectors towards the light, (n, 3).
        distances: How far away the light is, (n,); None is beyond everything.
    """
    far = np.full(len(places), FAR) if distances is None else distances
    hits = (
        tree.ray_cast(Vector(start), Vector(way), distance)[0]
        for start, way, distance in zip(places + SHADOW_OFFSET * normals, towards, far, strict=True)
    )
    return np.array([place is None for place in hits], dtype=bool)


def near_rim(shape: Shape, hits: Hits) -> Mask:
    """Return which hits are within OPEN_MARGIN of the rim of a hole."""
    rim = shape.rim()
    if not len(rim):
        return np.zeros(len(hits.pixel), dtype=bool)
    return np.asarray(cKDTree(rim).query(hits.position)[0] < OPEN_MARGIN)


def unit(vectors: Array) -> Array:
    """Normalise rows."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, 1e-12))
