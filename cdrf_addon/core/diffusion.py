# SPDX-License-Identifier: GPL-3.0-or-later
"""Fields diffused over a surface by implicit heat steps: (M + l^2 / 2 L) x = M b.

M holds the vertex areas, L is the cotangent Laplacian (Pinkall and Polthier 1993, by libigl), in
which needle triangles are softened. A step of length l blurs like a kernel of variance l^2 per
axis. The mean of the field over each component of the surface does not change.

A field blurred over l does not need triangles much smaller than l: on large meshes, long steps are
solved on a coarser mesh, whose vertices are the patches of the surface that share a cell of a grid.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from .mesh import FLATNESS_LIMIT, edge_lengths, repeated_faces
from .progress import with_progress
from .topology import face_normals, scatter

if TYPE_CHECKING:
    from .mesh import CleanMesh, Indices, Points

# Half a cotangent beyond this is a needle's (angles below 0.3 degrees): its negative weights are
# left out and the others end here, as more only stalls the solver. All other triangles keep theirs,
# also the negative ones: without them a field on sheared triangles is blurred half as far.
WEIGHT_LIMIT = 100.0
# Up to this many vertices no step is long enough to be worth a coarser mesh.
COARSE_ABOVE = 20_000
# Cells of the coarse mesh per length l.
CELLS_PER_LENGTH = 6.0
# A coarse mesh is worth its making from this cell size on, in median edges.
COARSE_FROM = 1.6
# Components for which the cells would be smaller than this keep their vertices.
LEAST_CELL = 1e-3
# Times the median face, beyond which a face says nothing of its component's size.
LARGEST_FACE = 100.0
# Residual of the conjugate gradients, as a part of the right-hand side. Gaussian curvature spans
# six decades on a head; at 1e-3, kappa in its flat parts was 33 % off at the worst vertex, now 0.4.
RESIDUAL = 1e-5
MAX_ITERATIONS = 1000
# A dozen iterations on a million vertices take about half a second.
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

        from .estimators.libigl import import_igl

        count = len(self.vertices)
        if not len(self.triangles):
            return csr_array((count, count))
        halves = import_igl().cotmatrix_entries(self.vertices, self.triangles)
        needle = (np.abs(halves) > WEIGHT_LIMIT).any(axis=1)
        if needle.any():
            halves[needle] = np.clip(halves[needle], 0.0, WEIGHT_LIMIT)
        # Column i belongs to the edge opposite corner i.
        tail, head = (np.roll(self.triangles, -shift, axis=1).ravel() for shift in (1, 2))
        weights = halves.ravel()
        one_way = csr_array((weights, (tail, head)), (count, count))
        return csr_array(one_way + one_way.T)

    @cached_property
    def valences(self) -> Points:
        """Diagonal of L: the sum of the weights at each vertex."""
        return np.asarray(self.weights.sum(axis=1)).ravel()

    def solve_steps(self, right: Points, length: Points) -> Generator[None, None, Points]:
        """Take one heat step, pausing now and then.

        Args:
            right: M b, (n,).
            length: (n,) one length for each component.
        """
        time = length**2 / 2.0
        diagonal = self.areas + time * self.valences
        coupling = self.weights.copy()
        coupling.data *= np.repeat(time, np.diff(coupling.indptr))
        yield
        found = yield from conjugate_gradients(diagonal, coupling, right)
        return found


def conjugate_gradients(
    diagonal: Points, coupling: Any, right: Points
) -> Generator[None, None, Points]:
    """Solve (diag - coupling) x = right, preconditioned by diag, pausing now and then.

    scipy's own solver takes dot products by BLAS, which wakes as many threads as there are cores
    for a microsecond of work each: fifteen times slower on a busy machine.

    Args:
        diagonal: (n,) positive.
        coupling: (n, n) sparse, symmetric, such that the whole is positive definite.
        right: (n,).

    Returns:
        (n,), with a residual of at most RESIDUAL.
    """
    inverse = 1.0 / diagonal
    found = right * inverse
    residual = coupling @ found  # right - A found, as diag found is right
    enough = RESIDUAL**2 * _dot(right * inverse, right)
    step = residual * inverse
    size = _dot(residual, step)
    image = np.empty_like(step)
    for iteration in range(MAX_ITERATIONS):
        if size <= enough:
            break
        if iteration % ITERATIONS_PER_PAUSE == 0:
            yield
        np.multiply(diagonal, step, out=image)
        image -= coupling @ step
        steepness = _dot(step, image)
        if not steepness > 0.0:
            break  # only rounding is left
        along = size / steepness
        found += along * step
        image *= along
        residual -= image
        np.multiply(residual, inverse, out=image)
        previous, size = size, _dot(residual, image)
        step *= size / previous
        step += image
    return found


def _dot(one: Points, other: Points) -> float:
    return float(np.einsum("i,i->", one, other))


@dataclass(frozen=True)
class _Coarse:
    """A coarser mesh, and the way back from it."""

    level: _Level
    patch: Indices
    """(n,) vertex of the coarse mesh that each vertex of the fine one belongs to."""
    offset: Points
    """(n, 3) from the patch's centre to the vertex."""

    def restrict(self, right: Points) -> Points:
        """Sum a right-hand side, (n,), over the patches."""
        return np.bincount(self.patch, right, minlength=len(self.level.areas))

    def prolong(self, values: Points) -> Points:
        """Continue values of the patches, (p,), linearly to the fine mesh's vertices."""
        gradient = self._gradients(values)
        fine = values[self.patch]
        for axis in range(3):
            fine += self.offset[:, axis] * gradient[:, axis][self.patch]
        return fine

    def _gradients(self, values: Points) -> Points:
        """Least-squares gradients over the neighbouring patches, (p, 3)."""
        here, there, weight, inverse = self._neighbours
        rise = values[there] - values[here]
        slopes = [np.bincount(here, part * rise, minlength=len(values)) for part in weight.T]
        return np.asarray((inverse @ np.stack(slopes, axis=1)[:, :, None])[:, :, 0])

    @cached_property
    def _neighbours(self) -> tuple[Indices, Indices, Points, Points]:
        """Pairs of neighbouring patches, their weights, (e, 3), and inverse moments, (p, 3, 3)."""
        graph = self.level.weights.tocoo()
        here, there = graph.row, graph.col
        centres = self.level.vertices
        apart = centres[there] - centres[here]
        weight = apart / (apart**2).sum(axis=1)[:, None]
        moment = np.empty((len(centres), 3, 3))
        for i in range(3):
            for j in range(i, 3):
                entry = np.bincount(here, weight[:, i] * apart[:, j], minlength=len(centres))
                moment[:, i, j] = moment[:, j, i] = entry
        # A patch and its neighbours lie in a plane, nearly: nothing is known across it.
        loose = 1e-2 * np.trace(moment, axis1=1, axis2=2) + np.finfo(np.float64).tiny
        moment += loose[:, None, None] * np.eye(3)
        return here, there, weight, np.linalg.inv(moment)


def _cells(places: Points) -> Indices:
    """Number of the cell of each place, (n,), in a grid of unit spacing.

    The cells are those of a body-centred lattice: at most three of them meet along an edge. Where
    four meet, as in a cubic grid, a jagged border makes triangles that overlap.
    """
    corner = np.round(places)
    middle = np.floor(places) + 0.5
    nearer = ((places - middle) ** 2).sum(axis=1) < ((places - corner) ** 2).sum(axis=1)
    # Two cells far apart may get one number: vertices are merged only where an edge joins them.
    cell = (2.0 * np.where(nearer[:, None], middle, corner)).astype(np.int64)
    return (cell[:, 0] << 42) + (cell[:, 1] << 21) + cell[:, 2]


def _coarsen(fine: _Level, cell: Points) -> _Coarse:
    """Merge the vertices that share a grid cell, of a size of its own, and are joined within it."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    vertices, triangles = fine.vertices, fine.triangles
    count = len(vertices)
    key = _cells(vertices / cell[:, None])
    tail, head = triangles.T.ravel(), np.roll(triangles, -1, axis=1).T.ravel()
    within = key[tail] == key[head]
    joined = np.ones(int(within.sum()), dtype=np.int8), (tail[within], head[within])
    _, patch = connected_components(coo_array(joined, (count, count)), directed=False)
    areas = np.bincount(patch, fine.areas)
    centres = np.stack([np.bincount(patch, fine.areas * part) for part in vertices.T], 1)
    centres /= areas[:, None]
    level = _Level(centres, _distinct_triangles(centres, patch[triangles]), areas)
    return _Coarse(level, patch, vertices - centres[patch])


def _distinct_triangles(vertices: Points, triangles: Indices) -> Indices:
    """Drop faces that have collapsed, and doubles."""
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)].astype(np.int64)
    if not len(triangles):
        return triangles
    triangles = triangles[~repeated_faces(triangles, len(vertices))]
    _, doubled_area = face_normals(vertices, triangles)
    longest = edge_lengths(vertices, triangles).max(axis=0)
    return triangles[doubled_area > FLATNESS_LIMIT * longest**2]


class Diffusion:
    """Heat steps on a clean mesh, all lengths in its unit (the median edge)."""

    def __init__(self, mesh: CleanMesh) -> None:
        _, doubled_area = mesh.face_normals
        areas = scatter(mesh.triangles, doubled_area / 6.0, len(mesh.vertices))
        self._fine = _Level(mesh.vertices, mesh.triangles, areas)

        self._doubled_area = doubled_area

    def size(self) -> Points:
        """Square root of the area of the component that each vertex belongs to, (n,).

        A face counts for at most a hundred times its component's median face, so that a vertex that
        has flown off does not change the size of the rest.
        """
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        triangles = self._fine.triangles
        count = len(self._fine.vertices)
        ends = np.roll(triangles, -1, axis=1).ravel(), triangles.ravel()
        edges = coo_array((np.ones(triangles.size, dtype=np.int8), ends), (count, count))
        components, part = connected_components(edges, directed=False)
        of_face = part[triangles[:, 0]]
        order = np.lexsort((self._doubled_area, of_face)) if components > 1 else None
        ranked = np.sort(self._doubled_area) if order is None else self._doubled_area[order]
        faces = np.bincount(of_face, minlength=components)
        middle = ranked[np.cumsum(faces) - faces + faces // 2]
        bounded = np.minimum(self._doubled_area, LARGEST_FACE * middle[of_face])
        area = np.bincount(of_face, bounded / 2.0, minlength=components)
        return np.asarray(np.sqrt(area)[part])

    def steps(
        self, values: Points, lengths: Sequence[Points]
    ) -> Generator[float, None, list[Points]]:
        """Diffuse a field over each of some lengths, yielding the part done.

        Args:
            values: (n,) at the vertices.
            lengths: Standard deviations of the blur, (n,) each, one number for each component of
                the surface; ascending.

        Returns:
            An array (n,) for each length, within the range of the values.
        """
        low, high = values.min(), values.max()
        level, right = self._fine, self._fine.areas * values
        first = np.arange(len(values))
        coarser: list[_Coarse] = []
        found = []
        for done, length in enumerate(lengths):
            part = done / len(lengths)
            yield part
            cell = length[first] / CELLS_PER_LENGTH
            if cell.max() >= COARSE_FROM and len(values) > COARSE_ABOVE:
                coarser.append(_coarsen(level, np.maximum(cell, LEAST_CELL)))
                level, right = coarser[-1].level, coarser[-1].restrict(right)
                # A vertex of each patch stands for its component.
                standing = np.empty(len(level.areas), dtype=np.int64)
                standing[coarser[-1].patch] = first
                first = standing
                yield part
            solving = level.solve_steps(right, length[first])
            result = yield from with_progress(solving, (done + 0.9) / len(lengths))
            for coarse in reversed(coarser):
                result = coarse.prolong(result)
            found.append(np.clip(result, low, high))
        return found
