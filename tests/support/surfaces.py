# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of analytic surfaces with their exact curvature, for benchmarks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

SEED = 20040911
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Surface:
    """A mesh and the curvature of the surface it samples, at its vertices."""

    vertices: Floats
    triangles: NDArray[np.int64]
    k1: Floats
    k2: Floats

    @property
    def kappa(self) -> Floats:
        return np.sqrt((self.k1**2 + self.k2**2) / 2.0)

    @property
    def mean(self) -> Floats:
        return (self.k1 + self.k2) / 2.0

    @property
    def inner(self) -> NDArray[np.bool_]:
        """All vertices: none of these surfaces has a boundary."""
        return np.ones(len(self.vertices), dtype=bool)


def _random_sphere(count: int) -> tuple[Floats, NDArray[np.int64]]:
    """Nearly even points on the unit sphere (a spiral, jittered), triangulated by their hull."""
    rng = np.random.default_rng(SEED)
    index = np.arange(count) + 0.5
    polar = np.arccos(1.0 - 2.0 * index / count)
    turn = np.pi * (1.0 + 5.0**0.5) * index
    points = np.stack(
        (np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)), axis=1
    )
    points += rng.normal(scale=0.3 * np.sqrt(4.0 * np.pi / count) / 2.0, size=points.shape)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    hull = ConvexHull(points)
    faces = hull.simplices.astype(np.int64)
    normal = np.cross(
        points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]]
    )
    inward = (normal * points[faces].mean(axis=1)).sum(axis=1) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    return points, faces


def sphere(count: int) -> Surface:
    """Unit sphere, irregular."""
    points, faces = _random_sphere(count)
    one = np.ones(count)
    return Surface(points, faces, one, one)


def ellipsoid(count: int) -> Surface:
    """Semi-axes 1, 0.7, 0.5, irregular. Level set: Gaussian and mean curvature in closed form."""
    points, faces = _random_sphere(count)
    axes = np.array((1.0, 0.7, 0.5))
    points = points * axes
    weight = (points**2 / axes**4).sum(axis=1)
    gaussian = 1.0 / (axes.prod() * weight) ** 2
    mean = ((axes**2).sum() - (points**2).sum(axis=1)) / (2.0 * axes.prod() ** 2 * weight**1.5)
    root = np.sqrt(np.maximum(mean**2 - gaussian, 0.0))
    return Surface(points, faces, mean + root, mean - root)


def torus(count: int, jitter: float = 0.0) -> Surface:
    """Radii 1 and 0.4; `jitter` moves the parameters by that part of a cell."""
    minor = round((count / 2) ** 0.5)
    major = 2 * minor
    rng = np.random.default_rng(SEED)
    u, v = (grid.ravel().astype(np.float64) for grid in np.indices((major, minor)))
    u = (u + jitter * rng.uniform(-1.0, 1.0, len(u))) * 2.0 * np.pi / major
    v = (v + jitter * rng.uniform(-1.0, 1.0, len(v))) * 2.0 * np.pi / minor
    ring = 1.0 + 0.4 * np.cos(v)
    points = np.stack((ring * np.cos(u), ring * np.sin(u), 0.4 * np.sin(v)), axis=1)
    i, j = (grid.ravel() for grid in np.indices((major, minor)))
    a, b = i * minor + j, ((i + 1) % major) * minor + j
    c = ((i + 1) % major) * minor + (j + 1) % minor
    d = i * minor + (j + 1) % minor
    faces = np.concatenate((np.stack((a, b, c), 1), np.stack((a, c, d), 1)))
    return Surface(points, faces, np.full(len(points), 2.5), np.cos(v) / ring)


def jittered_torus(count: int) -> Surface:
    """The torus with its vertices moved along it by up to 0.3 of a cell."""
    return torus(count, jitter=0.3)


SURFACES: dict[str, Callable[[int], Surface]] = {
    "irregular sphere": sphere,
    "irregular ellipsoid": ellipsoid,
    "torus": torus,
    "jittered torus": jittered_torus,
}
