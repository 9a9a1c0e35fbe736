# SPDX-License-Identifier: GPL-3.0-or-later
"""What the estimators need to know of a clean mesh: who neighbours whom, and its normals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .clean import Indices, Points

    Columns: TypeAlias = "Points | Sequence[Points]"

# Below this, an averaged normal says nothing (opposite sheets cancel).
NORMAL_LIMIT = 1e-3
# Long arrays are worked on in parts of this size, whose temporaries stay in a core's cache.
PART = 16_384


def parts(count: int) -> Iterator[slice]:
    """Cut `count` elements into parts that fit into the cache."""
    return (slice(start, start + PART) for start in range(0, count, PART))


def columns(rows: NDArray[Any]) -> NDArray[Any]:
    """Lay (n, k) out as (k, n), contiguous: indexing by, or into, a column is much faster so."""
    return np.ascontiguousarray(rows.T)


def adjacency(triangles: Indices, count: int) -> Any:
    """Matrix that is True where two vertices share an edge, and on its diagonal.

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
    """Tell whether an edge is run through twice in one direction: faces doubled or flipped."""
    a, b, c = columns(triangles)
    return has_repeats(np.concatenate((a * count + b, b * count + c, c * count + a)))


def has_repeats(numbers: NDArray[Any]) -> bool:
    """Tell whether a number occurs twice; sorting is several times as fast as `np.unique`."""
    ranked = np.sort(numbers)
    return bool((ranked[1:] == ranked[:-1]).any())


def edge_pairs(triangles: Indices, count: int) -> tuple[Indices, Indices]:
    """The two half-edges of each edge of exactly two faces, however these are wound."""
    tail, head = half_edges(triangles)
    key = np.minimum(tail, head) * count + np.maximum(tail, head)
    order = np.argsort(key, kind="stable")
    key = key[order]
    start = np.flatnonzero(np.concatenate(([True], key[1:] != key[:-1])))
    pair = start[np.diff(np.append(start, len(key))) == 2]
    return order[pair], order[pair + 1]


def scatter(triangles: Indices, per_corner: Points, count: int) -> Points:
    """Sum values of the corners, (m, 3), or of the faces, (m,), at each vertex."""
    if per_corner.ndim == 1:
        per_corner = np.repeat(per_corner[:, None], 3, axis=1)
    return np.bincount(triangles.ravel(), per_corner.ravel(), minlength=count)


def face_normals(vertices: Points, triangles: Indices) -> tuple[Points, Points]:
    """Normals of the faces scaled by twice their area, (3, m), and that doubled area, (m,)."""
    normal, doubled_area = np.empty((3, len(triangles))), np.empty(len(triangles))
    for part, edges in _edge_parts(vertices, triangles):
        normal[:, part] = cross(edges[1], edges[2])
        doubled_area[part] = np.sqrt(dot(normal[:, part], normal[:, part]))
    return normal, doubled_area


def edge_lengths(vertices: Points, triangles: Indices) -> Points:
    """Length of the three edges of each triangle, from corner i to the next, shape (3, m)."""
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


def vertex_normals(
    faces: tuple[Points, Points], triangles: Indices, count: int
) -> tuple[Points, NDArray[np.bool_], NDArray[np.bool_]]:
    """Area-weighted unit normals, (n, 3); which vertices have faces; which have a normal.

    Args:
        faces: What `face_normals` returns.
        triangles: (m, 3) indices below `count`.
        count: Number of vertices n.
    """
    normal, area = faces
    total = np.stack([scatter(triangles, part, count) for part in normal])
    size = scatter(triangles, area, count)
    length = np.sqrt(dot(total, total))
    sound = length > NORMAL_LIMIT * size
    return columns(total / np.where(sound, length, 1.0)), size > 0.0, sound
