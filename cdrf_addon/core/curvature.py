# SPDX-License-Identifier: GPL-3.0-or-later
"""Principal curvatures at the vertices of any mesh, by libigl's quadric fit, guarded.

The estimator is Panozzo, Puppo and Rocca 2010 as libigl has it (a quadric through the k-ring of
each vertex). kappa is the curvedness sqrt((k1^2 + k2^2) / 2), which is 1/r on a sphere of radius r.

The work is a generator, so that an operator can show progress and stop between two steps; libigl
holds Python's interpreter lock, so a thread would not help.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, field
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import DependencyError, ParameterError
from .mesh import CleaningReport, CleanMesh, Result, TriMesh, clean_steps, run_steps

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .mesh import Indices, Points

DEFAULT_RADIUS = 2
# A chunk of this many vertices takes libigl about 0.15 s: short enough to feel alive.
CHUNK_VERTICES = 16_384
# Below this, the averaged normal of a neighbourhood says nothing (opposite sheets cancel).
NORMAL_LIMIT = 1e-3
# libigl's k-ring search is quadratic in the valence: 0.02 s at 500, 3.5 s at 5,000.
VALENCE_LIMIT = 256
# Rounds of removing vertices without a normal; each round only removes, so it ends.
GUARD_ROUNDS = 64
# Rounds of filling bad vertices from their neighbours: holes of up to this many rings close.
FILL_ROUNDS = 64
# Curvature radii below this part of the median edge are noise of the fit, not shape.
CURVATURE_LIMIT = 1e3

Steps = Generator[float, None, "CurvatureField"]


@dataclass(frozen=True)
class CurvatureField:
    """Principal curvatures at the vertices of the source mesh, 1/unit; all arrays (n,) float64."""

    k1: Points
    """The larger principal curvature; positive where the surface bulges outwards."""
    k2: Points
    """The smaller principal curvature."""
    filled: NDArray[np.bool_]
    """True where the fit failed and the value comes from the neighbours (or is 0: no face)."""
    report: CleaningReport = field(default_factory=CleaningReport)

    @property
    def kappa(self) -> Points:
        """Curvedness sqrt((k1^2 + k2^2) / 2) >= 0 (Koenderink and van Doorn 1992)."""
        return np.asarray(np.hypot(self.k1, self.k2) / np.sqrt(2.0))

    @property
    def mean(self) -> Points:
        """Signed mean curvature (k1 + k2) / 2."""
        return self.k1 / 2.0 + self.k2 / 2.0

    def sentences(self) -> list[str]:
        """Say to an artist what was unusual, a sentence each; empty on a good mesh."""
        lines = self.report.sentences()
        count = int(self.filled.sum())
        if count:
            lines.append(
                f"{count:,} of {len(self.filled):,} vertices have too little around them to fit; "
                "their curvature comes from their neighbours."
            )
        return lines


def principal_curvatures(mesh: TriMesh, radius: int = DEFAULT_RADIUS) -> CurvatureField:
    """Estimate the principal curvatures in one go; see `curvature_steps`."""
    return run_steps(curvature_steps(mesh, radius))


def curvature_steps(mesh: TriMesh, radius: int = DEFAULT_RADIUS) -> Steps:
    """Estimate the principal curvatures of any mesh, yielding the part done after each step.

    Args:
        mesh: Any mesh; unchanged. Positions in the unit whose inverse the result has.
        radius: Rings of neighbours in the fit, 2 to 10; 2 is the most accurate on clean meshes,
            3 to 5 suit noisy scans.

    Yields:
        Progress from 0 to 1.

    Returns:
        The curvatures at the source's vertices, finite everywhere.

    Raises:
        ParameterError: The radius is outside 2 to 10.
        MeshError: No face of the mesh can be used.
    """
    if not 2 <= radius <= 10:
        raise ParameterError(f"The fit takes 2 to 10 rings of neighbours, not {radius}.")
    yield 0.0
    cleaned = yield from _paced(clean_steps(mesh), 0.0, 0.03)
    triangles = yield from _paced(_guard_steps(cleaned, radius), 0.2, 0.02)
    count = len(cleaned.vertices)
    k1, k2 = np.zeros(count), np.zeros(count)
    good = np.zeros(count, dtype=bool)
    for part, done in _chunks(cleaned.vertices, triangles, radius):
        k1[part.rows], k2[part.rows], good[part.rows] = _fit(part, radius)
        yield 0.3 + 0.65 * done
    _fill(cleaned, k1, k2, good)

    belongs = cleaned.source >= 0
    at = np.where(belongs, cleaned.source, 0)
    yield 1.0
    return CurvatureField(
        np.where(belongs, k1[at], 0.0) / cleaned.edge,
        np.where(belongs, k2[at], 0.0) / cleaned.edge,
        # Loose vertices are no failure: nothing is rendered there.
        belongs & ~good[at],
        cleaned.report,
    )


@dataclass(frozen=True)
class _Part:
    vertices: Points
    triangles: Indices
    rows: Indices
    """Index in the whole mesh of the vertices wanted."""
    local: Indices
    """The same vertices in this part."""


def _adjacency(triangles: Indices, count: int) -> Any:
    """Matrix of ones where two vertices share an edge (a scipy sparse array, untyped)."""
    from scipy.sparse import csr_array

    tail = triangles.ravel()
    head = np.roll(triangles, -1, axis=1).ravel()
    ends = np.concatenate((tail, head)), np.concatenate((head, tail))
    matrix = csr_array((np.ones(len(ends[0])), ends), (count, count))
    matrix.data[:] = 1.0
    return matrix


def _paced(
    steps: Generator[None, None, Result], start: float, pace: float
) -> Generator[float, None, Result]:
    """Turn pauses into progress: `pace` for each, from `start` to 0.3 at the most."""
    while True:
        try:
            next(steps)
        except StopIteration as done:
            result: Result = done.value
            return result
        start += pace
        yield min(start, 0.3)


def _guard_steps(cleaned: CleanMesh, radius: int) -> Generator[None, None, Indices]:
    """Drop the faces around vertices that join too many edges or whose neighbourhood has no normal.

    libigl divides by the length of that normal; the NaN it gets crashes its SVD, or comes out as
    a silent zero. Dropped vertices are filled from their neighbours afterwards.
    """
    triangles = cleaned.triangles
    count = len(cleaned.vertices)
    hub = np.bincount(triangles.ravel(), minlength=count) > VALENCE_LIMIT
    cleaned.report.hub_vertices = int(hub.sum())
    hub |= cleaned.seam
    if hub.any():
        triangles = triangles[~hub[triangles].any(axis=1)]
    for _ in range(GUARD_ROUNDS):
        unit, used, sound = _vertex_normals(cleaned.vertices, triangles)
        bad = used & ~sound
        yield
        ring, weight = unit, used.astype(np.float64)
        adjacency = _adjacency(triangles, count)
        yield
        for _ring in range(radius):
            ring, weight = ring + adjacency @ ring, weight + adjacency @ weight
        bad |= used & (np.linalg.norm(ring, axis=1) <= NORMAL_LIMIT * weight)
        if not bad.any():
            return triangles
        triangles = triangles[~bad[triangles].any(axis=1)]
        if not len(triangles):
            break
    return triangles[:0]


def _vertex_normals(
    vertices: Points, triangles: Indices
) -> tuple[Points, NDArray[np.bool_], NDArray[np.bool_]]:
    """Area-weighted vertex normals; which vertices have faces, and which a normal to speak of."""
    corners = vertices[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    count = len(vertices)
    total = np.stack([_scatter(triangles, normal[:, axis], count) for axis in range(3)], 1)
    size = _scatter(triangles, np.linalg.norm(normal, axis=1), count)
    length = np.linalg.norm(total, axis=1)
    sound = length > NORMAL_LIMIT * size
    return total / np.where(sound, length, 1.0)[:, None], size > 0.0, sound


def _scatter(triangles: Indices, per_face: Points, count: int) -> Points:
    """Sum a face value at each of the face's vertices."""
    return np.bincount(triangles.ravel(), np.repeat(per_face, 3), minlength=count)


def _chunks(
    vertices: Points, triangles: Indices, radius: int
) -> Generator[tuple[_Part, float], None, None]:
    """Cut the mesh into compact pieces, each with the rings around it that its fits need.

    Order within a piece is the order in the whole, so that the result does not depend on the cut.
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
    order = _morton_order(vertices)
    local = np.empty(count, dtype=np.int64)
    for start in range(0, count, CHUNK_VERTICES):
        rows = np.sort(order[start : start + CHUNK_VERTICES])
        within = rows
        # radius rings for the fit, one more because their normals look at their own faces.
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


def _morton_order(vertices: Points) -> Indices:
    """Order along a space-filling curve (Morton 1966), so that a run of vertices is a patch."""
    low = vertices.min(axis=0)
    span = max(float((vertices.max(axis=0) - low).max()), np.finfo(np.float64).tiny)
    cell = ((vertices - low) / span * 1023.0).astype(np.uint64)
    code = np.zeros(len(vertices), dtype=np.uint64)
    for bit in range(10):
        for axis in range(3):
            code |= ((cell[:, axis] >> np.uint64(bit)) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return np.argsort(code, kind="stable")


def _fit(part: _Part, radius: int) -> tuple[Points, Points, NDArray[np.bool_]]:
    igl = _libigl()
    sentinel_vertices, sentinel_triangles = _sentinel()
    offset = len(sentinel_vertices)
    _, _, larger, smaller, bad = igl.principal_curvature(
        np.concatenate((sentinel_vertices, part.vertices)),
        np.concatenate((sentinel_triangles, part.triangles + offset)),
        radius,
    )
    k1, k2 = larger[offset + part.local], smaller[offset + part.local]
    good = np.zeros(len(part.vertices), dtype=bool)
    good[part.triangles] = True
    failed = np.asarray(bad, dtype=np.int64)
    good[failed[failed >= offset] - offset] = False
    good = good[part.local]
    with np.errstate(invalid="ignore"):
        good &= (np.abs(k1) <= CURVATURE_LIMIT) & (np.abs(k2) <= CURVATURE_LIMIT)
    return np.where(good, k1, 0.0), np.where(good, k2, 0.0), good


def _libigl() -> ModuleType:
    """Import libigl late: it loads scipy, 0.2 s.

    Raises:
        DependencyError: It is not there; the extension's own package brings it.
    """
    try:
        import igl
    except ImportError as error:
        raise DependencyError(
            "The curvature library libigl is missing from this Blender: install the extension from "
            f"its zip file, which brings libigl along ({error})."
        ) from error
    return igl


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


def _fill(cleaned: CleanMesh, k1: Points, k2: Points, good: NDArray[np.bool_]) -> None:
    """Give vertices without a fit the mean of their neighbours, ring by ring, in place.

    Pieces without a single fit (a lone tetrahedron) are too small for a quadric; there the turn of
    the normals along the edges stands in.
    """
    if good.all():
        return
    adjacency = _adjacency(cleaned.triangles, len(good))
    known = good.copy()
    for _ in range(FILL_ROUNDS):
        neighbours = adjacency @ known.astype(np.float64)
        reached = ~known & (neighbours > 0.0)
        if not reached.any():
            break
        for values in (k1, k2):
            around = adjacency @ np.where(known, values, 0.0)
            values[reached] = around[reached] / neighbours[reached]
        known |= reached
    if not known.all():
        turn = _turn_of_normals(cleaned, adjacency)
        k1[~known] = k2[~known] = turn[~known]


def _turn_of_normals(cleaned: CleanMesh, adjacency: Any) -> Points:
    """Mean of |dN| / |dP| over the edges at each vertex, signed: positive where normals diverge."""
    vertices = cleaned.vertices
    count = len(vertices)
    unit, _, sound = _vertex_normals(vertices, cleaned.triangles)
    start, end = adjacency.nonzero()
    along, turned = vertices[end] - vertices[start], unit[end] - unit[start]
    distance = np.maximum(np.linalg.norm(along, axis=1), np.finfo(np.float64).tiny)
    bend = np.linalg.norm(turned, axis=1) / distance
    bend *= np.where((along * turned).sum(axis=1) < 0.0, -1.0, 1.0)
    bend[~(sound[start] & sound[end])] = 0.0  # opposite sheets cancel: no normal, no turn
    edges = np.bincount(start, minlength=count)
    total = np.bincount(start, np.minimum(bend, CURVATURE_LIMIT), minlength=count)
    return np.asarray(total / np.maximum(edges, 1))
