# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of analytic surfaces with their exact curvature, for benchmarks.

Closed surfaces are wound outwards, height fields upwards and the open tubes away from their axis;
k1 >= k2 are positive where the surface bulges that way.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

SEED = 20040911
BORDER_ROWS = 4
"""Rings next to a boundary whose one-sided neighbourhoods are judged apart."""
JITTER = 0.3
"""Part of a cell, or of the edge, by which a jittered mesh's vertices move along the surface."""
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Surface:
    """A mesh and the curvature of the surface it samples, at its vertices."""

    vertices: Floats
    triangles: Ints
    k1: Floats
    k2: Floats
    normals: Floats
    """Unit normals of the surface, outwards."""
    border: Bools | None = None
    """The vertices in the rows next to the boundary; None on a closed surface."""

    @property
    def kappa(self) -> Floats:
        return np.sqrt((self.k1**2 + self.k2**2) / 2.0)

    @property
    def mean(self) -> Floats:
        return (self.k1 + self.k2) / 2.0

    @property
    def inner(self) -> Bools:
        """All vertices but those in the rows next to a boundary."""
        if self.border is None:
            return np.ones(len(self.vertices), dtype=bool)
        return ~self.border

    @property
    def edge(self) -> float:
        """Mean edge length; an inner edge counts twice, once for each of its triangles."""
        a, b, c = (self.vertices[self.triangles[:, i]] for i in range(3))
        return float(np.mean([np.linalg.norm(p - q, axis=1) for p, q in ((a, b), (b, c), (c, a))]))


def noisy(surface: Surface, part_of_edge: float, rng: np.random.Generator) -> Surface:
    """Move the vertices along the normal, normally distributed; the curvature meant stays."""
    shift = rng.normal(scale=part_of_edge * surface.edge, size=len(surface.vertices))
    moved = surface.vertices + shift[:, None] * surface.normals
    return dataclasses.replace(surface, vertices=moved)


# --- closed -------------------------------------------------------------------------------------


def _random_sphere(count: int) -> tuple[Floats, Ints]:
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


def _unit_sphere(points: Floats, faces: Ints) -> Surface:
    one = np.ones(len(points))
    return Surface(points, faces, one, one, points)


def sphere(count: int) -> Surface:
    """Unit sphere, irregular."""
    return _unit_sphere(*_random_sphere(count))


def _geodesic(count: int) -> tuple[Floats, Ints]:
    """An icosahedron with edges cut into equal parts, blown up; 10 parts^2 + 2 vertices."""
    parts = max(1, round(((count - 2) / 10) ** 0.5))
    golden = (1.0 + 5.0**0.5) / 2.0
    plane = np.array([(0.0, 1, golden), (0, 1, -golden), (0, -1, golden), (0, -1, -golden)])
    corners = np.concatenate([np.roll(plane, turn, axis=1) for turn in range(3)])
    solid = ConvexHull(corners)
    sides = solid.simplices.astype(np.int64)
    a, b, c = (corners[sides[:, i]] for i in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0.0
    sides[inward] = sides[inward][:, ::-1]

    # Lattice points of a side: weights j on its second corner, k on its third, else on its first.
    j, k = np.indices((parts + 1, parts + 1))
    inside = j + k <= parts
    slot = np.where(inside, np.cumsum(inside).reshape(inside.shape) - 1, 0)
    weights = np.stack((parts - j - k, j, k), axis=-1)[inside]
    points = (weights @ corners[sides]).reshape(-1, 3)
    # Points shared by sides have the same weights on the same corners, hashed without rounding.
    code = np.random.default_rng(SEED).integers(2**63, size=len(corners), dtype=np.uint64)
    keys = np.einsum("pw,sw->sp", weights.astype(np.uint64), code[sides]).ravel()
    _, first, shared = np.unique(keys, return_index=True, return_inverse=True)
    if len(first) != 10 * parts**2 + 2:
        raise AssertionError("two points of the geodesic sphere have the same key")

    up = j + k < parts
    down = j + k < parts - 1
    lattice = np.concatenate(
        [
            np.stack((slot[:-1, :-1], slot[1:, :-1], slot[:-1, 1:]), -1)[up[:-1, :-1]],
            np.stack((slot[1:, :-1], slot[1:, 1:], slot[:-1, 1:]), -1)[down[:-1, :-1]],
        ]
    )
    offset = np.arange(len(sides)) * len(weights)
    faces = shared[(offset[:, None, None] + lattice).reshape(-1, 3)].astype(np.int64)
    points = points[first]
    return points / np.linalg.norm(points, axis=1, keepdims=True), faces


def ico_sphere(count: int) -> Surface:
    """Unit sphere of nearly equilateral triangles."""
    return _unit_sphere(*_geodesic(count))


def jittered_sphere(count: int) -> Surface:
    """The ico-sphere, each vertex moved along it into a disc that cannot turn a triangle over."""
    points, faces = _geodesic(count)
    edge = _unit_sphere(points, faces).edge
    rng = np.random.default_rng(SEED)
    away = rng.normal(size=points.shape)
    away -= (away * points).sum(axis=1, keepdims=True) * points
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    moved = points + JITTER * edge * np.sqrt(rng.random(len(points)))[:, None] * away
    return _unit_sphere(moved / np.linalg.norm(moved, axis=1, keepdims=True), faces)


def uv_sphere(count: int) -> Surface:
    """Unit sphere of meridians and parallels; each pole joins all meridians."""
    rings = round((count / 2) ** 0.5)
    segments = 2 * rings
    polar = np.arange(1, rings) * np.pi / rings
    faces, u, _ = _grid(segments, rings - 1, wrapped=(True, False))
    v = np.tile(polar[::-1], segments)  # northwards, as u runs eastwards
    body = np.stack((np.sin(v) * np.cos(u), np.sin(v) * np.sin(u), np.cos(v)), axis=1)
    south, north = len(body), len(body) + 1
    here = np.arange(segments) * (rings - 1)
    after = np.roll(here, -1)
    caps = (
        np.stack((np.full(segments, south), after, here), 1),
        np.stack((np.full(segments, north), here + rings - 2, after + rings - 2), 1),
    )
    points = np.concatenate((body, [(0.0, 0.0, -1.0), (0.0, 0.0, 1.0)]))
    return _unit_sphere(points, np.concatenate((faces, *caps)))


def ellipsoid(count: int) -> Surface:
    """Semi-axes 1, 0.7, 0.5, irregular. Level set: Gaussian and mean curvature in closed form."""
    points, faces = _random_sphere(count)
    axes = np.array((1.0, 0.7, 0.5))
    points = points * axes
    weight = (points**2 / axes**4).sum(axis=1)
    gaussian = 1.0 / (axes.prod() * weight) ** 2
    mean = ((axes**2).sum() - (points**2).sum(axis=1)) / (2.0 * axes.prod() ** 2 * weight**1.5)
    root = np.sqrt(np.maximum(mean**2 - gaussian, 0.0))
    normals = points / axes**2 / np.sqrt(weight)[:, None]
    return Surface(points, faces, mean + root, mean - root, normals)


def torus(count: int, jitter: float = 0.0) -> Surface:
    """Radii 1 and 0.4; `jitter` moves the parameters by that part of a cell."""
    minor = round((count / 2) ** 0.5)
    faces, u, v = _grid(2 * minor, minor, wrapped=(True, True), jitter=jitter)
    ring = 1.0 + 0.4 * np.cos(v)
    points = np.stack((ring * np.cos(u), ring * np.sin(u), 0.4 * np.sin(v)), axis=1)
    normals = np.stack((np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)), axis=1)
    return Surface(points, faces, np.full(len(points), 2.5), np.cos(v) / ring, normals)


def jittered_torus(count: int) -> Surface:
    """The torus with its vertices moved along it by up to 0.3 of a cell."""
    return torus(count, jitter=JITTER)


# --- with a boundary ----------------------------------------------------------------------------


def _grid(
    columns: int, rows: int, *, wrapped: tuple[bool, bool], jitter: float = 0.0
) -> tuple[Ints, Floats, Floats]:
    """Cut a grid of quads along the same diagonal each; vertex i, j has the index i rows + j.

    Returns:
        The triangles, wound from the first direction to the second, and the parameters of the
        vertices: 0 to 2 pi in a wrapped direction, -1 to 1 in one with two ends.
    """
    i, j = np.indices((columns, rows))
    index = i * rows + j
    right, up = np.roll(index, -1, axis=0), np.roll(index, -1, axis=1)
    quads = np.stack((index, right, np.roll(right, -1, axis=1), up), axis=-1)
    quads = quads[: columns if wrapped[0] else -1, : rows if wrapped[1] else -1].reshape(-1, 4)
    faces = np.concatenate((quads[:, (0, 1, 2)], quads[:, (0, 2, 3)]))
    rng = np.random.default_rng(SEED)
    parameters = []
    for cell, size, around in ((i, columns, wrapped[0]), (j, rows, wrapped[1])):
        place = cell.ravel() + jitter * rng.uniform(-1.0, 1.0, cell.size)
        parameters.append(place * 2.0 * np.pi / size if around else place * 2.0 / (size - 1) - 1.0)
    return faces, parameters[0], parameters[1]


def _ends(columns: int, rows: int) -> Bools:
    """The rows next to the two ends of a tube."""
    row = np.arange(rows)
    return np.tile((row < BORDER_ROWS) | (row >= rows - BORDER_ROWS), columns)


def _sides(size: int) -> Bools:
    """The rows next to the four sides of a square."""
    near = _ends(1, size)
    return (near[:, None] | near[None, :]).ravel()


def _tube(count: int, aspect: float) -> tuple[Ints, Floats, Floats, Bools]:
    """A grid closed around an axis; `aspect` is the circumference over the length."""
    rows = round((count / aspect) ** 0.5)
    columns = round(count / rows)
    faces, u, v = _grid(columns, rows, wrapped=(True, False))
    return faces, u, v, _ends(columns, rows)


def cylinder(count: int) -> Surface:
    """Radius 1, height 2, open at both ends."""
    faces, u, z, border = _tube(count, np.pi)
    normals = np.stack((np.cos(u), np.sin(u), np.zeros_like(u)), axis=1)
    points = normals + np.stack((0.0 * z, 0.0 * z, z), axis=1)
    return Surface(points, faces, np.ones_like(u), np.zeros_like(u), normals, border)


def cone(count: int) -> Surface:
    """A cone of 45 degrees from radius 1.25 to 0.25, open at both ends: a tip has no curvature."""
    faces, u, v, border = _tube(count, 0.75 * 2.0 * np.pi / 2.0**0.5)
    radius = 0.75 - 0.5 * v
    points = np.stack((radius * np.cos(u), radius * np.sin(u), 0.5 * v), axis=1)
    normals = np.stack((np.cos(u), np.sin(u), np.ones_like(u)), axis=1) / 2.0**0.5
    return Surface(points, faces, 0.5**0.5 / radius, np.zeros_like(u), normals, border)


def catenoid(count: int) -> Surface:
    """The minimal surface of radius cosh z for z from -1 to 1: k1 = -k2 = 1 / cosh^2 z."""
    faces, u, z, border = _tube(count, np.pi / np.sinh(1.0) * np.cosh(0.5))
    radius = np.cosh(z)
    points = np.stack((radius * np.cos(u), radius * np.sin(u), z), axis=1)
    normals = np.stack((np.cos(u), np.sin(u), -np.sinh(z)), axis=1) / radius[:, None]
    return Surface(points, faces, radius**-2, -(radius**-2), normals, border)


def _height_field(
    count: int, field: Callable[[Floats, Floats], tuple[Floats, ...]], jitter: float = 0.0
) -> Surface:
    """The graph over [-1, 1]^2 of a field that gives z, its gradient and its second derivatives."""
    size = round(count**0.5)
    faces, x, y = _grid(size, size, wrapped=(False, False), jitter=jitter)
    z, p, q, r, s, t = field(x, y)
    weight = np.sqrt(1.0 + p**2 + q**2)
    normals = np.stack((-p, -q, np.ones_like(p)), axis=1) / weight[:, None]
    gaussian = (r * t - s**2) / weight**4
    mean = -((1.0 + q**2) * r - 2.0 * p * q * s + (1.0 + p**2) * t) / (2.0 * weight**3)
    root = np.sqrt(np.maximum(mean**2 - gaussian, 0.0))
    points = np.stack((x, y, z), axis=1)
    return Surface(points, faces, mean + root, mean - root, normals, _sides(size))


def _saddle(x: Floats, y: Floats) -> tuple[Floats, ...]:
    one = np.ones_like(x)
    return (x**2 - y**2) / 2.0, x, -y, one, 0.0 * one, -one


def _waves(x: Floats, y: Floats) -> tuple[Floats, ...]:
    """0.1 sin 4x sin 4y: hills, hollows and saddles."""
    height, rate = 0.1, 4.0
    along, across = np.sin(rate * x), np.sin(rate * y)
    along_slope, across_slope = rate * np.cos(rate * x), rate * np.cos(rate * y)
    z = height * along * across
    gradient = height * along_slope * across, height * along * across_slope
    return z, *gradient, -(rate**2) * z, height * along_slope * across_slope, -(rate**2) * z


def saddle(count: int) -> Surface:
    """The height field (x^2 - y^2) / 2."""
    return _height_field(count, _saddle)


def sine_field(count: int, jitter: float = 0.0) -> Surface:
    """A height field of waves both ways; `jitter` as for the torus."""
    return _height_field(count, _waves, jitter)


ALL_SURFACES: dict[str, Callable[[int], Surface]] = {
    "ico-sphere": ico_sphere,
    "irregular sphere": sphere,
    "jittered sphere": jittered_sphere,
    "UV sphere": uv_sphere,
    "torus": torus,
    "jittered torus": jittered_torus,
    "irregular ellipsoid": ellipsoid,
    "cylinder": cylinder,
    "cone": cone,
    "saddle": saddle,
    "catenoid": catenoid,
    "sine field": sine_field,
    "jittered sine field": partial(sine_field, jitter=JITTER),
}
