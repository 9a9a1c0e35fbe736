# SPDX-License-Identifier: GPL-3.0-or-later
"""libigl's quadric fit (Panozzo, Puppo and Rocca 2010), guarded against what crashes it.

Its mean curvature is right; k1 and k2 depend on the order of the vertices by up to some parts in a
thousand of the largest, as it symmetrises the Weingarten map wrongly. A clean mesh sorts its
vertices, so that the same shape always gives the same numbers.

libigl holds Python's interpreter lock, so the work is cut into pieces, between which progress is
shown and the work can be stopped.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from ...errors import DependencyError
from ..topology import NORMAL_LIMIT, adjacency, face_normals, vertex_normals
from .estimate import Estimate, fittable_faces

if TYPE_CHECKING:
    from ..clean import CleanMesh
    from ..tri_mesh import Indices, Mask, Points

# libigl takes about 0.15 s for a chunk of this many vertices: Blender stays responsive.
CHUNK_VERTICES = 16_384
# Rounds of removing vertices without a normal; each round only removes, so it ends.
GUARD_ROUNDS = 64


def import_igl() -> ModuleType:
    """Import libigl late, as it loads scipy, 0.2 s.

    Raises:
        DependencyError: It is not installed; the extension's own package brings it.
    """
    try:
        import igl
    except ImportError as error:
        raise DependencyError(
            "The curvature library libigl is missing from this Blender: install the extension from "
            f"its zip file, which brings libigl along ({error})."
        ) from error
    return igl


def libigl_steps(mesh: CleanMesh, radius: int) -> Generator[float, None, Estimate]:
    """Fit quadrics with libigl, yielding the part done.

    Args:
        mesh: A clean mesh, in units of its median edge.
        radius: Rings of neighbours in the fit, at least 2.

    Returns:
        Principal curvatures per unit of the clean mesh.
    """
    triangles = yield from _guard_steps(mesh, radius)
    result = Estimate.empty(len(mesh.vertices))
    for part, done in _chunks(mesh.vertices, triangles, radius):
        result.put(part.rows, _fit(part, radius))
        yield 0.3 + 0.7 * done
    return result


@dataclass(frozen=True)
class _Part:
    """A piece of the mesh with the rings around it."""

    vertices: Points
    """(p, 3) positions."""
    triangles: Indices
    """(q, 3) indices in this part."""
    rows: Indices
    """(b,) index in the whole mesh of the vertices wanted."""
    local: Indices
    """(b,) the same vertices in this part."""


def _guard_steps(mesh: CleanMesh, radius: int) -> Generator[float, None, Indices]:
    """Drop the faces around vertices that join too many edges or whose neighbourhood has no normal.

    libigl divides by the length of that normal; the NaN it gets crashes its SVD, or comes out as
    a silent zero. Dropped vertices are filled from their neighbours afterwards.
    """
    triangles = mesh.triangles[fittable_faces(mesh)]
    count = len(mesh.vertices)
    progress = 0.0
    for _ in range(GUARD_ROUNDS):
        normals = vertex_normals(face_normals(mesh.vertices, triangles), triangles, count)
        used = normals.used
        bad = used & ~normals.sound
        near = adjacency(triangles, count).astype(np.float64)
        progress += (0.3 - progress) / 4.0
        yield progress
        # Sums over walks, not over rings with each vertex once; both vanish together.
        ring, weight = normals.unit, used.astype(np.float64)
        for _ring in range(radius):
            ring, weight = near @ ring, near @ weight
        bad |= used & (np.sqrt((ring**2).sum(axis=1)) <= NORMAL_LIMIT * weight)
        if not bad.any():
            return triangles
        triangles = triangles[~bad[triangles].any(axis=1)]
        if not len(triangles):
            break
    return triangles[:0]


def _chunks(
    vertices: Points, triangles: Indices, radius: int
) -> Generator[tuple[_Part, float], None, None]:
    """Cut the mesh into compact pieces, each with the rings around it that its fits need.

    The order within a piece is that of the whole, so that the result does not depend on the cut;
    consecutive vertices of a clean mesh lie together.
    """
    count = len(vertices)
    if not len(triangles):
        return
    if count <= CHUNK_VERTICES:
        every = np.arange(count)
        yield _Part(vertices, triangles, every, every), 1.0
        return
    from scipy.sparse import csr_array

    incidence = csr_array(
        (
            np.ones(triangles.size, dtype=np.int8),
            (triangles.ravel(), np.repeat(np.arange(len(triangles)), 3)),
        ),
        (count, len(triangles)),
    )
    local = np.empty(count, dtype=np.int64)
    for start in range(0, count, CHUNK_VERTICES):
        rows = np.arange(start, min(start + CHUNK_VERTICES, count))
        within = rows
        # `radius` rings for the fit, and one more for the normals of the outermost.
        for _ring in range(radius + 1):
            faces = _distinct(incidence[within].indices, len(triangles))
            if not len(faces):
                break
            within = _distinct(np.concatenate((rows, triangles[faces].ravel())), count)
        if len(faces):
            local[within] = np.arange(len(within))
            yield (
                _Part(vertices[within], local[triangles[faces]], rows, local[rows]),
                min(1.0, (start + CHUNK_VERTICES) / count),
            )


def _distinct(indices: Indices, count: int) -> Indices:
    """Sort and deduplicate indices below `count` (ten times as fast as numpy's unique here)."""
    seen = np.zeros(count, dtype=bool)
    seen[indices] = True
    return np.flatnonzero(seen)


def _fit(part: _Part, radius: int) -> Estimate:
    """Fit one piece, a sentinel dome in front of it."""
    igl = import_igl()
    sentinel_vertices, sentinel_triangles = _sentinel()
    offset = len(sentinel_vertices)
    _, _, larger, smaller, bad = igl.principal_curvature(
        np.concatenate((sentinel_vertices, part.vertices)),
        np.concatenate((sentinel_triangles, part.triangles + offset)),
        radius,
    )
    good: Mask = np.zeros(len(part.vertices), dtype=bool)
    good[part.triangles] = True
    failed = np.asarray(bad, dtype=np.int64)
    good[failed[failed >= offset] - offset] = False
    return Estimate(larger[offset + part.local], smaller[offset + part.local], good[part.local])


def _sentinel() -> tuple[Points, Indices]:
    """Make a small dome that libigl fits before anything else.

    libigl's SVD leaves its rank uninitialised when the matrix holds a NaN, and crashes if no good
    fit came before. After this dome one always has.
    """
    steps = np.arange(5.0)
    x, y = (grid.ravel() for grid in np.meshgrid(steps, steps, indexing="ij"))
    dome = np.stack((x, y, -0.05 * ((x - 2.0) ** 2 + (y - 2.0) ** 2)), axis=1)
    corner = (np.arange(4)[:, None] * 5 + np.arange(4)[None, :]).ravel()
    lower = np.stack((corner, corner + 5, corner + 6), axis=1)
    upper = np.stack((corner, corner + 6, corner + 1), axis=1)
    return dome, np.concatenate((lower, upper)).astype(np.int64)
