# SPDX-License-Identifier: GPL-3.0-or-later
"""Small meshes for the tests of the numerics, some with their exact curvature.

Sphere: k1 = k2 = 1 / r.
Torus of radii R > r: k1 = 1 / r along the small circle; the normal leans by v, so the large circle,
of radius R + r cos v, bends by k2 = cos v / (R + r cos v).
Ellipsoid x^2/a^2 + y^2/b^2 + z^2/c^2 = 1, as a level set: with w = sum x_i^2 / a_i^4 its Gaussian
curvature is 1 / (abc w)^2 and its mean (a^2 + b^2 + c^2 - |x|^2) / (2 (abc)^2 w^(3/2)); k1 and k2
are mean +- sqrt(mean^2 - Gaussian).
"""

from __future__ import annotations

import math

import numpy as np

from cdrf_addon.core.curvature.topology import edge_lengths


def grid_triangles(rows: int, columns: int, *, wrap: tuple[bool, bool]) -> np.ndarray:
    """Triangles of a grid of vertices, row by row, closed in the directions of `wrap`."""
    i, j = np.meshgrid(
        np.arange(rows if wrap[0] else rows - 1),
        np.arange(columns if wrap[1] else columns - 1),
        indexing="ij",
    )
    a, b, c, d = (
        ((i + di) % rows * columns + (j + dj) % columns).ravel()
        for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1))
    )
    return np.concatenate((np.stack((a, b, c), 1), np.stack((a, c, d), 1)))


def plane(size: int = 20) -> tuple[np.ndarray, np.ndarray]:
    """A square of unit cells in the plane z = 0."""
    x, y = np.meshgrid(np.arange(float(size)), np.arange(float(size)), indexing="ij")
    vertices = np.stack((x.ravel(), y.ravel(), np.zeros(x.size)), 1)
    return vertices, grid_triangles(size, size, wrap=(False, False))


# An icosahedron's faces over the vertices made in `icosphere`, wound outwards.
ICOSAHEDRON = """
0 11 5  0 5 1  0 1 7  0 7 10  0 10 11  1 5 9  5 11 4  11 10 2  10 7 6  7 1 8
3 9 4  3 4 2  3 2 6  3 6 8  3 8 9  4 9 5  2 4 11  6 2 10  8 6 7  9 8 1
"""


def icosphere(subdivisions: int) -> tuple[np.ndarray, np.ndarray]:
    """A unit sphere, faces wound outwards: an icosahedron, its faces cut in four repeatedly."""
    g = (1.0 + math.sqrt(5.0)) / 2.0
    corners = [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)]
    vertices = np.array([np.roll((x, y, 0.0), turn) for turn in range(3) for x, y in corners])
    faces = np.array(ICOSAHEDRON.split(), dtype=np.int64).reshape(-1, 3)
    for _ in range(subdivisions):
        edges = np.sort(np.concatenate((faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]])), 1)
        ends, of_face = np.unique(edges, axis=0, return_inverse=True)
        ab, bc, ca = (of_face.reshape(-1) + len(vertices)).reshape(3, -1)
        vertices = np.concatenate((vertices, vertices[ends].mean(axis=1)))
        a, b, c = faces.T
        quarters = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        faces = np.concatenate([np.stack(quarter, 1) for quarter in quarters])
    return vertices / np.linalg.norm(vertices, axis=1, keepdims=True), faces


def moebius(length: int = 60, width: int = 8) -> tuple[np.ndarray, np.ndarray]:
    """A Möbius strip of radius 1 and half-width 0.3."""
    u, v = np.meshgrid(
        np.arange(length) * 2.0 * math.pi / length, np.linspace(-0.3, 0.3, width), indexing="ij"
    )
    out = 1.0 + v * np.cos(u / 2.0)
    points = np.stack((out * np.cos(u), out * np.sin(u), v * np.sin(u / 2.0)), -1)
    # One row more than there is, then name its vertices: the first row the other way round.
    names = np.arange((length + 1) * width)
    names[length * width :] = np.arange(width)[::-1]
    faces = names[grid_triangles(length + 1, width, wrap=(False, False))]
    return points.reshape(-1, 3), faces


def unweld(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Give each face its own vertices, in the order of the original; also each one's original."""
    corner = np.argsort(faces.ravel(), kind="stable")
    place = np.empty_like(corner)
    place[corner] = np.arange(len(corner))
    original = faces.ravel()[corner]
    return vertices[original], place.reshape(faces.shape), original


# --- surfaces of known curvature -----------------------------------------------------------------

Surface = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""Vertices, faces, and the exact k1 and k2 at the vertices."""


def jitter(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Move the vertices of a unit sphere along it by a random 15 % of an edge, a normal deviate."""
    rng = np.random.default_rng(3)
    step = 0.15 * edge_lengths(vertices, faces).mean()
    moved = vertices + step * rng.normal(size=vertices.shape)
    return moved / np.linalg.norm(moved, axis=1, keepdims=True)


def sphere(level: int, *, irregular: bool) -> Surface:
    vertices, faces = icosphere(level)
    if irregular:
        vertices = jitter(vertices, faces)
    one = np.ones(len(vertices))
    return vertices, faces, one, one


def ellipsoid(level: int, *, irregular: bool) -> Surface:
    unit, faces, _, _ = sphere(level, irregular=irregular)
    axes = np.array((1.0, 0.8, 0.6))
    vertices = unit * axes
    w = (unit**2 / axes**2).sum(axis=1)
    product = axes.prod()
    mean = ((axes**2).sum() - (vertices**2).sum(axis=1)) / (2.0 * product**2 * w**1.5)
    split = np.sqrt(np.maximum(mean**2 - 1.0 / (product * w) ** 2, 0.0))
    return vertices, faces, mean + split, mean - split


def torus(level: int, *, irregular: bool) -> Surface:
    """Radii 1 and 0.4, 2^(level + 1) x 2^level vertices; irregular by a quarter of a cell."""
    rows, columns = 2 ** (level + 1), 2**level
    u, v = (grid.ravel() for grid in np.indices((rows, columns)).astype(np.float64))
    if irregular:
        rng = np.random.default_rng(5)
        u, v = (angle + rng.uniform(-0.25, 0.25, angle.shape) for angle in (u, v))
    u, v = u * 2.0 * math.pi / rows, v * 2.0 * math.pi / columns
    large, small = 1.0, 0.4
    out = large + small * np.cos(v)
    vertices = np.stack((out * np.cos(u), out * np.sin(u), small * np.sin(v)), 1)
    faces = grid_triangles(rows, columns, wrap=(True, True))
    return vertices, faces, np.full(len(vertices), 1.0 / small), np.cos(v) / out


def uv_sphere(segments: int, rings: int) -> tuple[np.ndarray, np.ndarray]:
    """A unit sphere as Blender makes it, the poles last but one and last."""
    polar = np.arange(1, rings) * math.pi / rings
    around = np.arange(segments) * 2.0 * math.pi / segments
    a, b = np.meshgrid(polar, around, indexing="ij")
    body = np.stack((np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)), -1).reshape(-1, 3)
    faces = grid_triangles(rings - 1, segments, wrap=(False, True))
    here, after = np.arange(segments), (np.arange(segments) + 1) % segments
    last, top, bottom = (rings - 2) * segments, len(body), len(body) + 1
    caps = [np.stack((np.full(segments, top), here, after), 1)]
    caps.append(np.stack((np.full(segments, bottom), last + after, last + here), 1))
    return np.vstack((body, (0.0, 0.0, 1.0), (0.0, 0.0, -1.0))), np.vstack((faces, *caps))


def cone(segments: int, rings: int) -> tuple[np.ndarray, np.ndarray]:
    """A cone of 45 degrees, its tip vertex 0, open below; ring i has the radius i / rings."""
    around = np.arange(segments) * 2.0 * math.pi / segments
    r, b = np.meshgrid(np.arange(1, rings + 1) / rings, around, indexing="ij")
    body = np.stack((r * np.cos(b), r * np.sin(b), 1.0 - r), -1).reshape(-1, 3)
    here, after = np.arange(segments), (np.arange(segments) + 1) % segments
    tip = np.stack((np.zeros(segments, dtype=np.int64), here + 1, after + 1), 1)
    faces = grid_triangles(rings, segments, wrap=(False, True)) + 1
    return np.vstack(((0.0, 0.0, 1.0), body)), np.vstack((tip, faces))


def mixed_mesh() -> tuple[np.ndarray, np.ndarray]:
    """A torus, a distant ball, a tetrahedron, a fan, loose vertices and a few bad faces."""
    around, faces, _, _ = torus(4, irregular=True)
    ball, sides = icosphere(3)
    tetrahedron = np.array([(1.0, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])
    fan, blades = cone(300, 2)
    pieces = [around, ball + 5.0, tetrahedron - 5.0, fan - (0.0, 0.0, 5.0), np.eye(3) * 20.0]
    of_piece = [faces, sides, np.array([(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)]), blades]
    starts = np.cumsum([0] + [len(piece) for piece in pieces])
    wound = [rows + start for rows, start in zip(of_piece, starts, strict=False)]
    return np.concatenate(pieces), np.concatenate([*wound, faces[:3], faces[:3, [0, 0, 1]]])
