# SPDX-License-Identifier: GPL-3.0-or-later
"""Edges, neighbours, lengths and normals of a triangle mesh, as fast as numpy can make them.

Vectors are columns, (3, m), wherever speed matters; `columns` turns rows into them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .tri_mesh import Indices, Mask, Points

    Columns: TypeAlias = "Points | Sequence[Points]"

# An averaged normal shorter than this part of its weights is noise (opposite sheets cancel).
NORMAL_LIMIT = 1e-3
# A triangle flatter than this (height / longest edge) has no usable normal in float32 coordinates.
FLATNESS_LIMIT = 1e-6
# Long arrays are worked on in parts of this size, whose temporaries stay in a core's cache.
PART = 16_384
# Three vertices of up to so many bits fit into one number.
KEY_BITS = 21


@dataclass(frozen=True)
class FaceNormals:
    """Normals of the faces and their areas."""

    scaled: Points
    """(3, m) normals times twice the area of their face."""
    doubled_area: Points
    """(m,) twice the areas."""

    def __getitem__(self, faces: Mask) -> FaceNormals:
        """Select some of the faces."""
        return FaceNormals(self.scaled[:, faces], self.doubled_area[faces])


@dataclass(frozen=True)
class VertexNormals:
    """Area-weighted normals at the vertices."""

    unit: Points
    """(n, 3) unit normals, where `sound`."""
    used: Mask
    """(n,) True at vertices of a face."""
    sound: Mask
    """(n,) True where the normals of the faces do not cancel out."""


@dataclass(frozen=True)
class SharedEdges:
    """Edges of exactly two faces that are wound alike; all arrays (e,)."""

    face: Indices
    """One face of each edge."""
    other: Indices
    """The other face."""
    corner: Indices
    """Corner of `face`, 0 to 2, at which the edge starts."""
    other_corner: Indices
    """Corner of `other` at which the edge starts, run in the opposite direction."""

    def __getitem__(self, edges: Mask) -> SharedEdges:
        """Select some of the edges."""
        return SharedEdges(
            self.face[edges], self.other[edges], self.corner[edges], self.other_corner[edges]
        )


# --- layout -------------------------------------------------------------------------------------


def parts(count: int) -> Iterator[slice]:
    """Cut `count` elements into parts that fit into the cache."""
    return (slice(start, start + PART) for start in range(0, count, PART))


def columns(rows: NDArray[Any]) -> NDArray[Any]:
    """Lay (n, k) out as (k, n), contiguous: much faster to index by a column, or into one."""
    return np.ascontiguousarray(rows.T)


def dot(one: Columns, other: Columns) -> Points:
    """Dot product of vectors as columns, (3, m)."""
    x, y, z = one
    u, v, w = other
    total = x * u
    total += y * v
    total += z * w
    return total


def cross(one: Columns, other: Columns) -> Points:
    """Cross product of vectors as columns, (3, m); several times as fast as numpy's."""
    x, y, z = one
    u, v, w = other
    return np.stack((y * w - z * v, z * u - x * w, x * v - y * u))


def has_repeats(numbers: NDArray[Any]) -> bool:
    """Return whether a number occurs twice; sorting is several times as fast as `np.unique`."""
    ranked = np.sort(numbers)
    return bool((ranked[1:] == ranked[:-1]).any())


# --- edges and neighbours -----------------------------------------------------------------------


def adjacency(triangles: Indices, count: int) -> Any:
    """Return the matrix that is True where two vertices share an edge, and on its diagonal.

    Args:
        triangles: (m, 3) indices below `count`.
        count: Number of vertices.

    Returns:
        A scipy sparse array (count, count) of bool; products of it are rings of neighbours.
    """
    from scipy.sparse import csr_array, eye_array

    index = np.int32 if max(count, 3 * len(triangles)) < 2**31 else np.int64
    corners = columns(triangles).astype(index)
    ends = corners.ravel(), np.roll(corners, -1, axis=0).ravel()
    one_way = csr_array((np.ones(triangles.size, dtype=bool), ends), (count, count))
    return csr_array(one_way + one_way.T + eye_array(count, dtype=bool))


def half_edges(triangles: Indices) -> tuple[Indices, Indices]:
    """Start and end of the three edges of each face, (3m,) each; number 3f + c is face f's c-th."""
    return triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()


def runs_twice(triangles: Indices, count: int) -> bool:
    """Return whether two faces run through an edge in one direction: doubled or flipped faces."""
    a, b, c = columns(triangles)
    return has_repeats(np.concatenate((a * count + b, b * count + c, c * count + a)))


def edge_pairs(triangles: Indices, count: int) -> tuple[Indices, Indices]:
    """Return the two half-edges of each edge of exactly two faces, however these are wound."""
    tail, head = half_edges(triangles)
    key = np.minimum(tail, head) * count + np.maximum(tail, head)
    order = np.argsort(key, kind="stable")
    key = key[order]
    start = np.flatnonzero(np.concatenate(([True], key[1:] != key[:-1])))
    pair = start[np.diff(np.append(start, len(key))) == 2]
    return order[pair], order[pair + 1]


def shared_edges(triangles: Indices, count: int) -> SharedEdges:
    """List the edges of exactly two faces that are wound alike, below `count` vertices."""
    tail, head = half_edges(triangles)
    one, other = edge_pairs(triangles, count)
    wound = tail[one] == head[other]
    one, other = one[wound], other[wound]
    return SharedEdges(one // 3, other // 3, one % 3, other % 3)


def face_key(a: Indices, b: Indices, c: Indices) -> Indices:
    """Pack each face's three vertices into one number that orders them alike.

    Args:
        a: (m,) first vertex of each face, below 2^KEY_BITS.
        b: (m,) second vertex.
        c: (m,) third vertex.

    Returns:
        (m,) numbers.
    """
    return (a << 2 * KEY_BITS) | (b << KEY_BITS) | c


def repeated_faces(triangles: Indices, count: int) -> Mask:
    """Return which faces lie on the same three of `count` vertices as an earlier one, (m,)."""
    repeated = np.zeros(len(triangles), dtype=bool)
    a, b, c = columns(triangles)
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    middle = a + b + c - low - high
    # One number a face shows at once that all are different, as they mostly are.
    if count < 2**KEY_BITS and not has_repeats(face_key(low, middle, high)):
        return repeated
    order = np.lexsort((high, middle, low))
    ordered = np.stack((low, middle, high), axis=1)[order]
    # lexsort is stable, so the first of each run is the first in the mesh: it stays.
    repeated[order[1:]] = (ordered[1:] == ordered[:-1]).all(axis=1)
    return repeated


# --- lengths and normals ------------------------------------------------------------------------


def edge_lengths(vertices: Points, triangles: Indices) -> Points:
    """Length of the three edges of each triangle, from corner i to the next, (3, m)."""
    length = np.empty((3, len(triangles)))
    for part, edges in _edge_parts(vertices, triangles):
        for side in range(3):
            edge = edges[(side + 2) % 3]
            length[side, part] = np.sqrt(dot(edge, edge))
    return length


def half_cotangents(vertices: Points, triangles: Indices) -> Points:
    """Half the cotangent of the angle at each corner of the triangles, (3, m)."""
    half = np.empty((3, len(triangles)))
    for part, edges in _edge_parts(vertices, triangles):
        normal = cross(edges[1], edges[2])
        scale = -0.5 / np.sqrt(dot(normal, normal))
        for corner in range(3):
            half[corner, part] = scale * dot(edges[(corner + 1) % 3], edges[(corner + 2) % 3])
    return half


def face_normals(vertices: Points, triangles: Indices) -> FaceNormals:
    """Compute the normals of the faces, scaled by twice their area."""
    normal, doubled_area = np.empty((3, len(triangles))), np.empty(len(triangles))
    for part, edges in _edge_parts(vertices, triangles):
        normal[:, part] = cross(edges[1], edges[2])
        doubled_area[part] = np.sqrt(dot(normal[:, part], normal[:, part]))
    return FaceNormals(normal, doubled_area)


def scatter(triangles: Indices, per_corner: Points, count: int) -> Points:
    """Sum values of the corners or faces at each vertex.

    Args:
        triangles: (m, 3) indices below `count`.
        per_corner: Values of the corners, (m, 3), or of the faces, (m,).
        count: Number of vertices n.

    Returns:
        (n,) sums.
    """
    if per_corner.ndim == 1:
        per_corner = np.repeat(per_corner[:, None], 3, axis=1)
    return np.bincount(triangles.ravel(), per_corner.ravel(), minlength=count)


def vertex_normals(faces: FaceNormals, triangles: Indices, count: int) -> VertexNormals:
    """Average the normals of the faces at each vertex, weighted by area.

    Args:
        faces: What `face_normals` returns.
        triangles: (m, 3) indices below `count`.
        count: Number of vertices n.
    """
    total = np.stack([scatter(triangles, part, count) for part in faces.scaled])
    size = scatter(triangles, faces.doubled_area, count)
    length = np.sqrt(dot(total, total))
    sound = length > NORMAL_LIMIT * size
    return VertexNormals(columns(total / np.where(sound, length, 1.0)), size > 0.0, sound)


def _edge_parts(vertices: Points, triangles: Indices) -> Iterator[tuple[slice, list[list[Points]]]]:
    """Go through the triangles part by part, with the edge opposite each corner, run in turn."""
    axes = columns(vertices)
    for part in parts(len(triangles)):
        # mode="clip" skips the check of every index.
        corners = [
            [np.take(axis, corner, mode="clip") for axis in axes]
            for corner in columns(triangles[part])
        ]
        yield (
            part,
            [
                [end - start for start, end in zip(corners[i - 2], corners[i - 1], strict=True)]
                for i in range(3)
            ],
        )
