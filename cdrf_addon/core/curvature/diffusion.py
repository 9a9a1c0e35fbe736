# SPDX-License-Identifier: GPL-3.0-or-later
"""Diffuse fields over a surface by implicit heat steps: (M + l^2 / 2 L) x = M b.

M holds the vertex areas, L is the cotangent Laplacian (Pinkall and Polthier 1993), in which needle
triangles are softened. A step of length l blurs like a kernel of variance l^2 per axis. The mean of
the field over each component of the surface does not change.

A field blurred over l does not need triangles much smaller than l: on large meshes, long steps are
solved on a coarser mesh, whose vertices are the patches of the surface that share a cell of a grid.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..progress import with_progress
from .estimators.least_squares import solve
from .topology import (
    FLATNESS_LIMIT,
    columns,
    dot,
    edge_lengths,
    face_normals,
    half_cotangents,
    parts,
    repeated_faces,
    scatter,
)

if TYPE_CHECKING:
    from .clean import CleanMesh
    from .tri_mesh import Indices, Points

# Half a cotangent beyond this is a needle's (angles below 0.3 degrees): its negative weights are
# left out and the others are clamped to this, as more only stalls the solver. All other triangles
# keep theirs, the negative ones too: without them a field on sheared triangles is blurred half as
# far.
WEIGHT_LIMIT = 100.0
# Up to this many vertices no step is long enough to be worth a coarser mesh.
COARSE_ABOVE = 20_000
# Cells of the coarse mesh per length l.
CELLS_PER_LENGTH = 6.0
# A coarse mesh is worth its cost from this cell size on, in median edges.
COARSE_FROM = 1.6
# Components for which the cells would be smaller than this keep their vertices.
LEAST_CELL = 1e-3
# A face counts for at most this many times the median face in its component's size.
LARGEST_FACE = 100.0
# Residual of the conjugate gradients, as a part of the right-hand side. Gaussian curvature spans
# six decades on a head; at 1e-3, kappa in its flat parts was 33 % off at the worst vertex, now 0.4.
RESIDUAL = 1e-5
MAX_ITERATIONS = 1000
# A dozen iterations on a million vertices take about a quarter of a second.
ITERATIONS_PER_PAUSE = 12


@dataclass(frozen=True)
class _Level:
    """A triangulated surface and the two matrices of its heat equation."""

    vertices: Points
    triangles: Indices
    areas: Points
    """Diagonal of M, (n,)."""

    @cached_property
    def weights(self) -> Any:
        """Cotangent weights between neighbours, (n, n) sparse, empty diagonal."""
        from scipy.sparse import csr_array

        count = len(self.vertices)
        if not len(self.triangles):
            return csr_array((count, count))
        halves = half_cotangents(self.vertices, self.triangles)
        needle = (np.abs(halves) > WEIGHT_LIMIT).any(axis=0)
        if needle.any():
            halves[:, needle] = np.clip(halves[:, needle], 0.0, WEIGHT_LIMIT)
        corners = columns(self.triangles).astype(np.int32 if count < 2**31 else np.int64)
        # Row i of the halves belongs to the edge opposite corner i.
        tail, head = (np.roll(corners, -shift, axis=0).ravel() for shift in (1, 2))
        one_way = csr_array((halves.ravel(), (tail, head)), (count, count))
        return csr_array(one_way + one_way.T)

    @cached_property
    def valences(self) -> Points:
        """Diagonal of L: the sum of the weights at each vertex."""
        return np.asarray(self.weights.sum(axis=1)).ravel()

    def solve_steps(
        self, fields: Sequence[Points], length: Points, starts: Sequence[Points]
    ) -> Generator[None, None, list[Points]]:
        """Take one heat step of some fields, pausing now and then.

        Args:
            fields: b, (n,) each.
            length: (n,) one length for each component, in units of the median edge.
            starts: (n,) for each field, the nearer to its result the better.

        Returns:
            x, (n,) for each field.
        """
        from scipy.sparse import csr_array

        # Scaled by s = diag^-1/2 from both sides the system is (1 - C) s^-1 x = s M b: the
        # conjugate gradients on it are those preconditioned by the diagonal, for less work.
        indices, indptr = self.weights.indices, self.weights.indptr
        yield
        time = length**2 / 2.0
        scale = 1.0 / np.sqrt(self.areas + time * self.valences)
        coupling = self.weights.data * np.repeat(time * scale, np.diff(indptr))
        coupling *= np.take(scale, indices, mode="clip")
        matrix = csr_array((coupling, indices, indptr), self.weights.shape)
        yield
        found = []
        for values, start in zip(fields, starts, strict=True):
            right = scale * self.areas * values
            result = yield from conjugate_gradients(matrix, right, start / scale)
            found.append(scale * result)
        return found


def conjugate_gradients(
    coupling: Any, right: Points, start: Points
) -> Generator[None, None, Points]:
    """Solve (1 - coupling) x = right, pausing now and then.

    scipy's own solver takes dot products by BLAS, which wakes as many threads as there are cores
    for a microsecond of work each: fifteen times slower on a busy machine.

    Args:
        coupling: (n, n) sparse, symmetric, such that the whole is positive definite.
        right: (n,).
        start: (n,) a guess at the result; the right-hand side is taken where it is a better one.

    Returns:
        (n,), with a residual of at most RESIDUAL.
    """
    found, residual = right.copy(), coupling @ right
    size = _dot(residual, residual)
    other = right - start
    other += coupling @ start
    if _dot(other, other) < size:
        found, residual, size = start.copy(), other, _dot(other, other)
    enough = RESIDUAL**2 * _dot(right, right)
    step = residual.copy()
    for iteration in range(MAX_ITERATIONS):
        if size <= enough:
            break
        if iteration % ITERATIONS_PER_PAUSE == 0:
            yield
        image = coupling @ step
        np.subtract(step, image, out=image)
        steepness = _dot(step, image)
        if not steepness > 0.0:
            break  # only rounding is left
        along = size / steepness
        previous, size = size, 0.0
        for part in parts(len(step)):
            found[part] += along * step[part]
            residual[part] -= along * image[part]
            size += _dot(residual[part], residual[part])
        for part in parts(len(step)):
            step[part] *= size / previous
            step[part] += residual[part]
    return found


def _dot(one: Points, other: Points) -> float:
    """Dot product of two vectors, (n,), in one thread."""
    return float(np.einsum("i,i->", one, other))


@dataclass(frozen=True)
class _Neighbours:
    """Pairs of neighbouring patches, and the least squares of a gradient over them."""

    here: Indices
    """(e,) one patch of each pair; every pair stands there both ways."""
    there: Indices
    """(e,) the other."""
    weight: list[Points]
    """(3, e) offset from here to there over its squared length."""
    moments: list[list[Points]]
    """Lower triangle of the (3, 3, p) normal equations."""


@dataclass(frozen=True)
class _Coarse:
    """A coarser mesh, and the way back to the finer one."""

    level: _Level
    patch: Indices
    """(n,) vertex of the coarse mesh that each vertex of the fine one belongs to."""
    offset: Points
    """(3, n) from the patch's centre to the vertex."""

    def restrict(self, values: Points, areas: Points) -> Points:
        """Average values of the fine mesh's vertices, (n,), over the patches, (p,)."""
        total = np.bincount(self.patch, areas * values, minlength=len(self.level.areas))
        return total / self.level.areas

    def prolong(self, values: Points) -> Points:
        """Continue values of the patches, (p,), linearly to the fine mesh's vertices."""
        fine = values[self.patch]
        for offset, slope in zip(self.offset, self._gradients(values), strict=True):
            fine += offset * slope[self.patch]
        return fine

    def _gradients(self, values: Points) -> list[Points]:
        """Least-squares gradients over the neighbouring patches, three columns (p,)."""
        near = self._neighbours
        rise = values[near.there] - values[near.here]
        slopes = [
            np.bincount(near.here, part * rise, minlength=len(values)) for part in near.weight
        ]
        gradients, _ = solve(near.moments, slopes)
        return gradients

    @cached_property
    def _neighbours(self) -> _Neighbours:
        """Weigh each pair of neighbouring patches for the gradients."""
        graph = self.level.weights.tocoo()
        here, there = graph.row.astype(np.int64), graph.col.astype(np.int64)
        count = len(self.level.vertices)
        apart = [axis[there] - axis[here] for axis in columns(self.level.vertices)]
        closeness = 1.0 / dot(apart, apart)
        weight = [axis * closeness for axis in apart]
        # The lower triangle, which is all that is read.
        moments = [
            [np.bincount(here, weight[i] * apart[j], minlength=count) for j in range(i + 1)]
            for i in range(3)
        ]
        # A patch and its neighbours nearly lie in a plane: nothing is known across it.
        loose = 1e-2 * sum(moments[i][i] for i in range(3)) + np.finfo(np.float64).tiny
        for i in range(3):
            moments[i][i] += loose
        return _Neighbours(here, there, weight, moments)


def _cells(places: Points) -> Indices:
    """Number of the cell of each place, (3, n) to (n,), in a grid of unit spacing.

    The cells are those of a body-centred lattice: at most three of them meet along an edge. Where
    four meet, as in a cubic grid, a jagged border makes triangles that overlap.
    """
    corner = np.round(places)
    middle = np.floor(places) + 0.5
    nearer = dot(places - middle, places - middle) < dot(places - corner, places - corner)
    # Two cells far apart may share a number; vertices are merged only where an edge joins them.
    cell = (2.0 * np.where(nearer, middle, corner)).astype(np.int64)
    return (cell[0] << 42) + (cell[1] << 21) + cell[2]


def _coarsen_steps(fine: _Level, cell: Points) -> Generator[None, None, _Coarse]:
    """Merge the vertices that share a grid cell and are joined by edges within it.

    Args:
        fine: The mesh to coarsen.
        cell: (n,) size of the cells, one number for each component, in units of the median edge.

    Returns:
        The coarse mesh and the way back.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    axes, triangles = columns(fine.vertices), fine.triangles
    count = len(fine.vertices)
    key = _cells(axes / cell)
    corners = columns(triangles)
    of_corner = key[corners]
    within = [of_corner[i - 1] == of_corner[i] for i in range(3)]
    tail, head = (
        np.concatenate([corners[i - back][within[i]] for i in range(3)]) for back in (1, 0)
    )
    joined = np.ones(len(tail), dtype=np.int8), (tail, head)
    yield
    _, patch = connected_components(coo_array(joined, (count, count)), directed=False)
    yield
    areas = np.bincount(patch, fine.areas)
    centres = np.stack([np.bincount(patch, fine.areas * axis) / areas for axis in axes])
    rows = np.ascontiguousarray(centres.T)
    level = _Level(rows, _distinct_triangles(rows, patch[triangles]), areas)
    return _Coarse(level, patch, axes - centres[:, patch])


def _distinct_triangles(vertices: Points, triangles: Indices) -> Indices:
    """Drop faces that have collapsed, and all but one of those on the same vertices."""
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)].astype(np.int64)
    if not len(triangles):
        return triangles
    triangles = triangles[~repeated_faces(triangles, len(vertices))]
    longest = edge_lengths(vertices, triangles).max(axis=0)
    return triangles[face_normals(vertices, triangles).doubled_area > FLATNESS_LIMIT * longest**2]


class Diffusion:
    """Take heat steps on a clean mesh; all lengths are in its unit, the median edge."""

    def __init__(self, mesh: CleanMesh) -> None:
        self._doubled_area = mesh.face_normals.doubled_area
        areas = scatter(mesh.triangles, self._doubled_area / 6.0, len(mesh.vertices))
        self._fine = _Level(mesh.vertices, mesh.triangles, areas)
        self._coarser: list[_Coarse] = []
        self._standing = np.arange(len(areas))
        """(c,) a vertex of the fine mesh in the same component as each vertex of the coarsest."""

    def size(self) -> Points:
        """Return the square root of the area of the component that each vertex belongs to, (n,).

        A face counts for at most a hundred times its component's median face, so that a vertex that
        has flown off does not change the size of the rest.
        """
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        triangles = self._fine.triangles
        count = len(self._fine.vertices)
        a, b, c = columns(triangles)
        ends = np.concatenate((a, a)), np.concatenate((b, c))  # which joins b and c, too
        edges = coo_array((np.ones(len(ends[0]), dtype=np.int8), ends), (count, count))
        components, part = connected_components(edges, directed=False)
        of_face = part[a]
        order = np.lexsort((self._doubled_area, of_face)) if components > 1 else None
        ranked = np.sort(self._doubled_area) if order is None else self._doubled_area[order]
        faces = np.bincount(of_face, minlength=components)
        middle = ranked[np.cumsum(faces) - faces + faces // 2]
        bounded = np.minimum(self._doubled_area, LARGEST_FACE * middle[of_face])
        area = np.bincount(of_face, bounded / 2.0, minlength=components)
        return np.asarray(np.sqrt(area)[part])

    def steps(
        self,
        fields: Sequence[Points],
        length: Points,
        starts: Sequence[Points] | None = None,
    ) -> Generator[float, None, list[Points]]:
        """Diffuse some fields over one length, yielding the part done.

        Args:
            fields: (n,) each, at the vertices.
            length: Standard deviation of the blur, (n,), one number for each component of the
                surface; not less than it was in the last call.
            starts: Guesses at the results, (n,) each; by default the fields themselves.

        Returns:
            An array (n,) for each field, within the range of its values.
        """
        starts = fields if starts is None else starts
        level = self._coarser[-1].level if self._coarser else self._fine
        cell = length[self._standing] / CELLS_PER_LENGTH
        yield 0.0
        if cell.max() >= COARSE_FROM and len(length) > COARSE_ABOVE:
            coarsening = _coarsen_steps(level, np.maximum(cell, LEAST_CELL))
            coarse = yield from with_progress(coarsening, 0.1)
            level, standing = coarse.level, np.empty(len(coarse.level.areas), dtype=np.int64)
            standing[coarse.patch] = self._standing
            self._standing = standing
            self._coarser.append(coarse)
            yield 0.2
        solving = level.solve_steps(
            [self._restrict(values) for values in fields],
            length[self._standing],
            [self._restrict(values) for values in starts],
        )
        found = yield from with_progress(solving, 0.5)
        yield 0.9
        return [
            np.clip(self._prolong(result), values.min(), values.max())
            for result, values in zip(found, fields, strict=True)
        ]

    def _restrict(self, values: Points) -> Points:
        areas = self._fine.areas
        for coarse in self._coarser:
            values, areas = coarse.restrict(values, areas), coarse.level.areas
        return values

    def _prolong(self, values: Points) -> Points:
        for coarse in reversed(self._coarser):
            values = coarse.prolong(values)
        return values
