# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangle meshes made fit for libigl: welded, finite, non-degenerate, consistently wound.

libigl crashes, hangs or returns silent zeros on what artists call a normal mesh (loose vertices,
doubled faces, seams, one vertex at infinity). `clean` returns a copy on which none of that can
happen, says what it left out, and keeps the way back to the artist's vertices.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from .errors import MeshError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Points = NDArray[np.float64]
    Indices = NDArray[np.int64]

Result = TypeVar("Result")

# A triangle flatter than this (height / longest edge) has no usable normal in float32 coordinates.
FLATNESS_LIMIT = 1e-6
# A face this many times the median edge belongs to a vertex that has flown off.
EDGE_LIMIT = 1e6


@dataclass(frozen=True)
class TriMesh:
    """A triangle mesh as plain arrays: what Blender hands over, nothing assumed of it.

    Raises:
        MeshError: The arrays do not have the shape of a mesh.
    """

    vertices: Points
    """(n, 3) positions, float64, any unit."""
    triangles: Indices
    """(m, 3) vertex indices, int64."""

    def __post_init__(self) -> None:
        if self.vertices.ndim != 2 or self.vertices.shape[1] != 3:
            raise MeshError(f"Vertices must have the shape (n, 3), not {self.vertices.shape}.")
        if self.triangles.ndim != 2 or self.triangles.shape[1] != 3:
            raise MeshError(f"Triangles must have the shape (m, 3), not {self.triangles.shape}.")
        if self.triangles.size and not (
            self.triangles.min() >= 0 and self.triangles.max() < len(self.vertices)
        ):
            raise MeshError(
                f"A triangle names a vertex that does not exist (there are {len(self.vertices)})."
            )

    @classmethod
    def from_arrays(cls, vertices: ArrayLike, triangles: ArrayLike) -> TriMesh:
        """Convert anything array-like to float64 vertices and int64 triangles."""
        return cls(
            np.ascontiguousarray(vertices, dtype=np.float64),
            np.ascontiguousarray(triangles, dtype=np.int64),
        )


@dataclass
class CleaningReport:
    """What `clean` left out or changed, as counts; all zero on a good mesh."""

    non_finite_vertices: int = 0
    stray_faces: int = 0
    degenerate_faces: int = 0
    duplicate_faces: int = 0
    hub_vertices: int = 0
    flipped_faces: int = 0
    non_orientable: bool = False
    welded_vertices: int = 0

    def sentences(self) -> list[str]:
        """Describe for an artist what is worth knowing, a sentence each; empty on a good mesh."""
        told = [
            (self.non_finite_vertices, "{} vertices lie at infinity or nowhere (NaN); ignored."),
            (self.stray_faces, "{} faces reach a vertex that has flown far off; ignored."),
            (self.degenerate_faces, "{} faces have no area; ignored."),
            (self.duplicate_faces, "{} faces lie twice on the same vertices; used once."),
            (self.hub_vertices, "{} vertices join too many edges; filled from their neighbours."),
            (self.flipped_faces, "{} faces point the other way (Recalculate Normals mends it)."),
        ]
        lines = [text.format(f"{count:,}") for count, text in told if count]
        if self.non_orientable:
            lines.append("The surface has no outside (a Möbius strip); its seam is filled in.")
        return lines


@dataclass(frozen=True)
class CleanMesh:
    """A mesh libigl can be trusted with, centred, in units of its median edge."""

    vertices: Points
    """(n, 3) welded positions, centred, divided by `edge`."""
    triangles: Indices
    """(m, 3) kept faces."""
    edge: float
    """Median edge length in the source's unit; curvature is divided by it on the way back."""
    source: Indices
    """(N,) welded vertex of each source vertex; -1 where it belongs to no usable face."""
    seam: NDArray[np.bool_]
    """(n,) True where neighbouring faces cannot be wound alike (the seam of a Möbius strip)."""
    report: CleaningReport = field(default_factory=CleaningReport)


def clean(mesh: TriMesh) -> CleanMesh:
    """Weld, filter, orient and normalise a mesh in one go; see `clean_steps`."""
    return run_steps(clean_steps(mesh))


def run_steps(steps: Generator[Any, None, Result]) -> Result:
    """Run a generator of steps to its end and return its result."""
    while True:
        try:
            next(steps)
        except StopIteration as done:
            result: Result = done.value
            return result


def clean_steps(mesh: TriMesh) -> Generator[None, None, CleanMesh]:
    """Weld, filter, orient and normalise a mesh, pausing between the parts of the work.

    Args:
        mesh: Any mesh; unchanged.

    Returns:
        The mesh for the estimator and the way back.

    Raises:
        MeshError: No face is left; the text says why.
    """
    report = CleaningReport()
    if not len(mesh.vertices):
        raise MeshError("The mesh has no vertices; give it some geometry first.")
    if not len(mesh.triangles):
        raise MeshError("The mesh has no faces, only loose vertices or edges; fill faces first.")
    finite = np.isfinite(mesh.vertices).all(axis=1)
    vertices, triangles = _drop_non_finite(mesh, finite, report)
    vertices, edge = _normalise(vertices, triangles)
    yield
    triangles = _drop_stray(vertices, triangles, report)
    yield
    welded, first = weld(vertices)
    yield
    report.welded_vertices = int(len(vertices) - len(first))
    vertices, triangles = vertices[first], welded[triangles]
    triangles = _drop_degenerate(vertices, triangles, report)
    yield
    triangles = _drop_duplicates(triangles, report)
    yield
    if not len(triangles):
        raise MeshError(
            "No face of the mesh can be used ("
            + (" ".join(report.sentences()) or "all of them are degenerate.")
            + ") Clean it up with Mesh > Clean Up or Merge by Distance."
        )
    triangles, seam = _orient(triangles, len(vertices), report)
    yield
    used = np.zeros(len(vertices), dtype=bool)
    used[triangles] = True
    compact = np.where(used, np.cumsum(used) - 1, -1)
    source = np.full(len(mesh.vertices), -1, dtype=np.int64)
    source[finite] = compact[welded]
    return CleanMesh(
        np.ascontiguousarray(vertices[used]),
        np.ascontiguousarray(compact[triangles]),
        edge,
        source,
        seam[used],
        report,
    )


def weld(vertices: Points) -> tuple[Indices, Indices]:
    """Merge vertices at exactly equal positions (seams of imported files are exact copies).

    Args:
        vertices: (n, 3) finite or not; NaNs are never merged wrongly, only with the same bits.

    Returns:
        (n,) new index of each vertex, numbered by first appearance, and the index of the first
        vertex of each group.
    """
    bits = np.ascontiguousarray(vertices + 0.0).view(np.uint64)  # + 0.0 turns -0.0 into 0.0
    # An odd multiplier per axis mixes 192 bits into 64; the comparison below catches a collision.
    with np.errstate(over="ignore"):
        key = bits[:, 0] * np.uint64(0x9E3779B97F4A7C15)
        key ^= (key >> np.uint64(29)) + bits[:, 1] * np.uint64(0xBF58476D1CE4E5B9)
        key ^= (key >> np.uint64(31)) + bits[:, 2] * np.uint64(0x94D049BB133111EB)
    _, first, group = np.unique(key, return_index=True, return_inverse=True)
    if not np.array_equal(bits[first[group]], bits):
        _, first, group = np.unique(bits, axis=0, return_index=True, return_inverse=True)
        group = group.reshape(-1)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return rank[group].astype(np.int64), first[order].astype(np.int64)


def _drop_non_finite(
    mesh: TriMesh, finite: NDArray[np.bool_], report: CleaningReport
) -> tuple[Points, Indices]:
    report.non_finite_vertices = int((~finite).sum())
    triangles = mesh.triangles[finite[mesh.triangles].all(axis=1)]
    if not len(triangles):
        raise MeshError(
            "Every face has a vertex at infinity or nowhere (NaN); check the modifiers and drivers "
            "that move the vertices."
        )
    return mesh.vertices[finite], (np.cumsum(finite) - 1)[triangles]


def edge_lengths(vertices: Points, triangles: Indices) -> Points:
    """Length of the three edges of each triangle, shape (m, 3)."""
    corners = vertices[triangles]
    return np.asarray(np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2))


def _normalise(vertices: Points, triangles: Indices) -> tuple[Points, float]:
    # Two steps, so that neither 1e300 nor 1e-300 overflows a square on the way.
    used = vertices[triangles[:, 0]]
    centred = vertices * 0.5 - np.median(used, axis=0) * 0.5
    extent = float(np.median(np.abs(centred[triangles]).max(axis=(1, 2))))
    if not extent > 0.0:
        extent = float(np.abs(centred[triangles]).max())
    if not extent > 0.0:
        raise MeshError("All faces shrink to one point; check the scale of the object.")
    with np.errstate(over="ignore"):
        scaled = np.clip(centred / extent, -1e30, 1e30)
    lengths = edge_lengths(scaled, triangles)
    positive = lengths[lengths > 0.0]
    if not len(positive):
        raise MeshError("All faces shrink to points; check the scale of the object.")
    median = float(np.median(positive))
    edge = median * extent * 2.0
    if not (np.isfinite(edge) and edge > np.finfo(np.float64).tiny):
        raise MeshError(
            f"Edges of {edge:.3g} units are outside what numbers can hold; "
            "check the scale of the object."
        )
    return scaled / median, edge


def _drop_stray(vertices: Points, triangles: Indices, report: CleaningReport) -> Indices:
    with np.errstate(over="ignore"):  # an infinite length is as stray as any
        stray = edge_lengths(vertices, triangles).max(axis=1) > EDGE_LIMIT
    report.stray_faces = int(stray.sum())
    return triangles[~stray]


def _drop_degenerate(vertices: Points, triangles: Indices, report: CleaningReport) -> Indices:
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    doubled_area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    longest = edge_lengths(vertices, triangles).max(axis=1)
    good = doubled_area > FLATNESS_LIMIT * longest**2
    report.degenerate_faces = int((~good).sum())
    return triangles[good]


def _drop_duplicates(triangles: Indices, report: CleaningReport) -> Indices:
    ordered = np.sort(triangles, axis=1)
    order = np.lexsort(ordered.T)
    ranked = ordered[order]
    repeated = np.zeros(len(triangles), dtype=bool)
    # lexsort is stable, so the first of each run is the first in the mesh: it stays.
    repeated[order[1:]] = (ranked[1:] == ranked[:-1]).all(axis=1)
    report.duplicate_faces = int(repeated.sum())
    return triangles[~repeated]


def _orient(
    triangles: Indices, vertex_count: int, report: CleaningReport
) -> tuple[Indices, NDArray[np.bool_]]:
    """Wind neighbouring faces alike; the larger part of each component keeps its side.

    Consistency is two-colouring the graph of faces: each face stands twice in it, as it is and
    flipped, joined to its neighbours so that only consistent windings meet. A face that meets its
    own mirror image lies on a surface without an outside.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    count = len(triangles)
    tail = triangles.ravel()
    head = np.roll(triangles, -1, axis=1).ravel()
    forward = tail < head
    key = np.minimum(tail, head) * (int(triangles.max()) + 1) + np.maximum(tail, head)
    order = np.argsort(key, kind="stable")
    key, forward, face = key[order], forward[order], order // 3
    # Only edges of exactly two faces say anything about winding.
    start = np.flatnonzero(np.concatenate(([True], key[1:] != key[:-1])))
    pair = start[np.diff(np.append(start, len(key))) == 2]
    one, other, alike = face[pair], face[pair + 1], forward[pair] == forward[pair + 1]
    seam = np.zeros(vertex_count, dtype=bool)
    if not alike.any():
        return triangles, seam

    mirror = np.where(alike, count, 0)
    rows = np.concatenate((one, one + count))
    columns = np.concatenate((other + mirror, other + count - mirror))
    graph = coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), (2 * count, 2 * count))
    _, label = connected_components(graph, directed=False)
    as_is, flipped = label[:count], label[count:]
    report.non_orientable = bool((as_is == flipped).any())
    # Of a component and its mirror image, take the one that holds more faces as they are.
    kept = np.bincount(as_is, minlength=int(label.max()) + 1)
    flip = (kept[flipped] > kept[as_is]) | ((kept[flipped] == kept[as_is]) & (flipped < as_is))
    flip &= as_is != flipped
    report.flipped_faces = int(flip.sum())
    # Edges that are still alike after that have no consistent winding at all.
    torn = order[pair][alike ^ flip[one] ^ flip[other]]
    seam[tail[torn]] = seam[head[torn]] = True
    return np.where(flip[:, None], triangles[:, ::-1], triangles), seam
