# SPDX-License-Identifier: GPL-3.0-or-later
"""Curvature tensor of each face, averaged at the vertices (Rusinkiewicz 2004): fast, for previews.

The second fundamental form of a face is fitted to how the vertex normals turn along its three
edges. It is turned into the tangent plane of each corner and averaged with the corner's Voronoi
area. On irregular meshes the error stays at some percent, however fine they are.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import TYPE_CHECKING

import numpy as np

from ..topology import cross, scatter
from .estimate import Estimate
from .least_squares import solve

if TYPE_CHECKING:
    from ..clean import CleanMesh
    from ..tri_mesh import Mask, Points


# What overflows on needles becomes infinite or NaN, and is replaced like any value above the limit.
_allow_overflow = np.errstate(over="ignore", invalid="ignore", divide="ignore")
PARTS = 6
"""Entries of a symmetric tensor that count: xx, xy, xz, yy, yz, zz."""
# Curvature radii below this part of the median edge are noise, not shape.
TENSOR_LIMIT = 1e3


def tensor_steps(mesh: CleanMesh) -> Generator[float, None, Estimate]:
    """Estimate at every vertex, yielding the part done.

    Args:
        mesh: A clean mesh, in units of its median edge.

    Returns:
        Principal curvatures per unit of the clean mesh.
    """
    total, normals, sound = yield from _total_steps(mesh)
    k1, k2 = _principal(total, normals)
    yield 1.0
    return Estimate(k1, k2, sound & ~mesh.seam)


def shape_operator_steps(mesh: CleanMesh) -> Generator[float, None, list[Points]]:
    """Return the shape operator in space, PARTS arrays (n,), yielding the part done.

    dN = S dP along the surface: its eigenvalues are the principal curvatures, positive where the
    surface bulges outwards, and zero along the normal. Finite, and zero where nothing can be said.
    """
    total, _, sound = yield from _total_steps(mesh)
    yield 1.0
    return _known_entries(total, sound & ~mesh.seam)


@_allow_overflow
def _known_entries(total: Points, sound: Mask) -> list[Points]:
    """Return the mean tensor at each vertex, PARTS arrays (n,); zero where it is not sound."""
    entries = total[:PARTS] / np.maximum(total[PARTS], np.finfo(np.float64).tiny)
    known = sound & (np.abs(entries) <= TENSOR_LIMIT).all(axis=0)
    return list(np.where(known, entries, 0.0))


def _total_steps(mesh: CleanMesh) -> Generator[float, None, tuple[Points, Points, Mask]]:
    """Sum the tensors of the faces at every vertex, yielding the part done.

    Returns:
        (PARTS + 1, n): the sums weighted by area, then the weights; the normals (n, 3); and where
        they do not cancel out (n,).
    """
    vertices, triangles = mesh.vertices, mesh.triangles
    count = len(vertices)
    corners = [vertices.T[:, triangles[:, corner]] for corner in range(3)]
    edges = [corners[(i + 2) % 3] - corners[(i + 1) % 3] for i in range(3)]
    normal, doubled_area = mesh.face_normals.scaled, mesh.face_normals.doubled_area
    normals, sound = _max_normals(mesh, normal, edges)
    yield 0.3
    at_corner = [normals.T[:, triangles[:, corner]] for corner in range(3)]
    unit = normal / doubled_area
    along = edges[0] / np.sqrt((edges[0] ** 2).sum(axis=0))
    across = cross(unit, along)
    e, f, g = _second_form(edges, at_corner, along, across)
    yield 0.6
    weights = _voronoi_corners(edges, doubled_area)
    total = np.zeros((PARTS + 1, count))
    for corner in range(3):
        turned = [_turned(axis, unit, at_corner[corner]) for axis in (along, across)]
        one_corner = np.zeros((len(triangles), 3))
        for row, entry in enumerate((*_tensor((e, f, g), *turned), np.ones(len(triangles)))):
            one_corner[:, corner] = weights[corner] * entry
            total[row] += scatter(triangles, one_corner, count)
        yield 0.6 + 0.13 * corner
    return total, normals, sound


@_allow_overflow
def _tensor(form: tuple[Points, Points, Points], u: Points, v: Points) -> list[Points]:
    """Return the six entries of a face's second form in space, its axes turned into u and v."""
    e, f, g = form
    return [
        e * u[i] * u[j] + f * (u[i] * v[j] + v[i] * u[j]) + g * v[i] * v[j]
        for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
    ]


@_allow_overflow
def _principal(total: Points, normals: Points) -> tuple[Points, Points]:
    """Return the principal curvatures of the mean tensor at each vertex, (n,) each."""
    xx, xy, xz, yy, yz, zz = total[:PARTS] / np.maximum(total[PARTS], np.finfo(np.float64).tiny)
    # The tensor has no part along the normal: k1 and k2 are half its trace, more or less the size
    # of what is left in the tangent plane without that half.
    half = (xx + yy + zz) / 2.0
    x, y, z = normals.T
    xx, yy, zz = (
        entry - half * (1.0 - part * part)
        for entry, part in zip((xx, yy, zz), (x, y, z), strict=True)
    )
    xy, xz, yz = xy + half * x * y, xz + half * x * z, yz + half * y * z
    left = xx**2 + yy**2 + zz**2 + 2.0 * (xy**2 + xz**2 + yz**2)
    split = np.sqrt(left / 2.0)
    return half + split, half - split


@_allow_overflow
def _max_normals(mesh: CleanMesh, normal: Points, edges: list[Points]) -> tuple[Points, Mask]:
    """Weigh vertex normals as Max (1999) does: exact where the vertices lie on a sphere."""
    square = [(edge**2).sum(axis=0) for edge in edges]
    count = len(mesh.vertices)
    total = np.zeros((3, count))
    size = np.zeros(count)
    for corner in range(3):
        part = np.zeros((len(mesh.triangles), 3))
        weight = 1.0 / (square[(corner + 1) % 3] * square[(corner + 2) % 3])
        for axis in range(3):
            part[:, corner] = normal[axis] * weight
            total[axis] += scatter(mesh.triangles, part, count)
        part[:, corner] = np.sqrt((normal**2).sum(axis=0)) * weight
        size += scatter(mesh.triangles, part, count)
    length = np.sqrt((total**2).sum(axis=0))
    sound = length > 1e-3 * size
    return (total / np.where(sound, length, 1.0)).T, sound


@_allow_overflow
def _second_form(
    edges: list[Points], normals: list[Points], along: Points, across: Points
) -> tuple[Points, Points, Points]:
    """Fit the second fundamental form (e, f; f, g) of each face in its own axes, (m,) each."""
    zero = np.zeros(edges[0].shape[1])
    matrix = [[zero, zero, zero] for _ in range(3)]
    right = [zero, zero, zero]
    for i, edge in enumerate(edges):
        turn = normals[(i + 2) % 3] - normals[(i + 1) % 3]
        s, t = (edge * along).sum(axis=0), (edge * across).sum(axis=0)
        # (e s + f t, f s + g t) should be the turn's parts along both axes.
        for row, value in (
            ((s, t, zero), (turn * along).sum(axis=0)),
            ((zero, s, t), (turn * across).sum(axis=0)),
        ):
            for j in range(3):
                matrix[j] = [matrix[j][k] + row[j] * row[k] for k in range(3)]
                right[j] = right[j] + row[j] * value
    (e, f, g), _ = solve(matrix, right)
    return e, f, g


@_allow_overflow
def _turned(axis: Points, from_normal: Points, to_normal: Points) -> Points:
    """Turn a vector in the plane of one normal into that of another, by the shortest way."""
    lean = (axis * to_normal).sum(axis=0)
    cosine = (from_normal * to_normal).sum(axis=0)
    # Opposite normals have no shortest way; such corners keep their axis, and a tiny weight.
    return axis - (from_normal + to_normal) * (lean / np.maximum(1.0 + cosine, 1e-3))


def _voronoi_corners(edges: list[Points], doubled_area: Points) -> list[Points]:
    """Return each corner's Voronoi area, or its share of an obtuse face (Meyer et al. 2003)."""
    square = [(edge**2).sum(axis=0) for edge in edges]
    cotangent = [
        (square[(i + 1) % 3] + square[(i + 2) % 3] - square[i]) / (2.0 * doubled_area)
        for i in range(3)
    ]
    obtuse = np.minimum(np.minimum(cotangent[0], cotangent[1]), cotangent[2]) < 0.0
    areas = []
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        voronoi = (square[j] * cotangent[j] + square[k] * cotangent[k]) / 8.0
        share = np.where(cotangent[i] < 0.0, doubled_area / 4.0, doubled_area / 8.0)
        areas.append(np.where(obtuse, share, voronoi))
    return areas
