# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangle meshes made fit for libigl: welded, finite, non-degenerate, consistently wound.

libigl crashes, hangs or returns silent zeros on what artists call a normal mesh (loose vertices,
doubled faces, seams, one vertex at infinity). `clean` returns a copy on which none of that can
happen, says what it left out, and keeps the way back to the artist's vertices.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..errors import MeshError
from ..progress import run_steps
from .topology import (
    columns,
    edge_lengths,
    edge_pairs,
    face_normals,
    half_edges,
    has_repeats,
    runs_twice,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Points = NDArray[np.float64]
    Indices = NDArray[np.int64]

# A triangle flatter than this (height / longest edge) has no usable normal in float32 coordinates.
FLATNESS_LIMIT = 1e-6
# A face this many times the median edge belongs to a vertex that has flown off.
EDGE_LIMIT = 1e6
# Three vertices of up to so many bits fit into one number.
KEY_BITS = 21
# Faces never meet at this angle: nothing is split.
NO_CREASE = np.pi


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
    crease_vertices: int = 0

    def sentences(self) -> list[str]:
        """Describe for an artist what is worth knowing, a sentence each; empty on a good mesh."""
        told = [
            (self.non_finite_vertices, "{} vertices lie at infinity or nowhere (NaN); ignored."),
            (self.stray_faces, "{} faces reach a vertex that has flown far off; ignored."),
            (self.degenerate_faces, "{} faces have no area; ignored."),
            (self.duplicate_faces, "{} faces lie twice on the same vertices; used once."),
            (self.hub_vertices, "{} vertices join too many edges; filled from their neighbours."),
            (
                self.crease_vertices,
                "{} vertices were added where creases are split; raise the angle "
                "if round parts are split too.",
            ),
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
    part_of: Indices
    """(n,) welded vertex of each vertex; some have several parts where creases split the mesh."""
    seam: NDArray[np.bool_]
    """(n,) True where neighbouring faces cannot be wound alike (the seam of a Möbius strip)."""
    report: CleaningReport = field(default_factory=CleaningReport)

    @cached_property
    def face_normals(self) -> tuple[Points, Points]:
        """Normals scaled by twice the faces' areas, (3, m), and those doubled areas, (m,)."""
        return face_normals(self.vertices, self.triangles)

    def to_source(self, values: Points, loose: float = 0.0) -> Points:
        """Carry values of the vertices, (n,), back to the source's, (N,); the mean of its parts."""
        if len(self.part_of) and self.part_of[-1] + 1 < len(self.part_of):
            parts = np.bincount(self.part_of)
            values = np.bincount(self.part_of, values) / parts
        return np.where(self.source >= 0, values[np.maximum(self.source, 0)], loose)


def clean(mesh: TriMesh, crease_angle: float = NO_CREASE) -> CleanMesh:
    """Weld, filter, orient and normalise a mesh in one go; see `clean_steps`."""
    return run_steps(clean_steps(mesh, crease_angle))


def clean_steps(mesh: TriMesh, crease_angle: float = NO_CREASE) -> Generator[None, None, CleanMesh]:
    """Weld, filter, orient and normalise a mesh, pausing between the parts of the work.

    The result does not depend on the order of the source's vertices: they are sorted along a
    space-filling curve, which also keeps neighbours together in memory.

    Args:
        mesh: Any mesh; unchanged.
        crease_angle: Split the surface where faces meet at a sharper angle than this, in radians.

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
    finite = np.isfinite(columns(mesh.vertices)).all(axis=0)
    vertices, triangles = _drop_non_finite(mesh, finite, report)
    yield
    vertices, edge, longest = _normalise(vertices, triangles)
    yield
    triangles = _drop_unusable(vertices, triangles, longest, report)
    yield
    welded, first = weld(vertices)
    report.welded_vertices = int(len(vertices) - len(first))
    yield
    if report.welded_vertices:
        vertices, triangles = vertices[first], welded[triangles]
    triangles = _drop_duplicates(triangles, len(vertices), report)
    yield
    if not len(triangles):
        raise MeshError(
            "No face of the mesh can be used ("
            + (" ".join(report.sentences()) or "all of them are degenerate.")
            + ") Clean it up with Mesh > Clean Up or Merge by Distance."
        )
    used = _used(vertices, triangles)
    order = morton_order(vertices if used.all() else vertices[used])
    if len(order) < len(used):
        order = np.flatnonzero(used)[order]
    place = np.full(len(vertices), -1, dtype=np.int64)
    place[order] = np.arange(len(order))
    yield
    source = np.full(len(mesh.vertices), -1, dtype=np.int64)
    source[finite] = place[welded]
    vertices = vertices[order]
    triangles = _canonical_faces(place[triangles], len(vertices))
    yield
    triangles, seam = _orient(triangles, len(vertices), report)
    yield
    part_of = np.arange(len(vertices))
    if crease_angle < NO_CREASE:
        triangles, part_of = split_creases(vertices, triangles, crease_angle)
        report.crease_vertices = len(part_of) - len(vertices)
        vertices, seam = vertices[part_of], seam[part_of]
    return CleanMesh(
        np.ascontiguousarray(vertices),
        np.ascontiguousarray(triangles),
        edge,
        source,
        part_of,
        seam,
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
    bits = columns(vertices + 0.0).view(np.uint64)  # + 0.0 turns -0.0 into 0.0
    # An odd multiplier per axis mixes 192 bits into 64; the comparison below catches a collision.
    with np.errstate(over="ignore"):
        key = bits[0] * np.uint64(0x9E3779B97F4A7C15)
        key ^= (key >> np.uint64(29)) + bits[1] * np.uint64(0xBF58476D1CE4E5B9)
        key ^= (key >> np.uint64(31)) + bits[2] * np.uint64(0x94D049BB133111EB)
    if not has_repeats(key):
        each = np.arange(len(key))
        return each, each
    _, first, group = np.unique(key, return_index=True, return_inverse=True)
    if not np.array_equal(bits[:, first[group]], bits):
        _, first, group = np.unique(bits, axis=1, return_index=True, return_inverse=True)
        group = group.reshape(-1)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return rank[group].astype(np.int64), first[order].astype(np.int64)


def morton_order(vertices: Points) -> Indices:
    """Order of the vertices along a space-filling curve (Morton 1966), (n,).

    Equal cells are ordered by position, so that the order depends on nothing else.
    """
    axes = columns(vertices)
    span = max(float(np.ptp(axes, axis=1).max()), np.finfo(np.float64).tiny)
    code = np.zeros(len(vertices), dtype=np.uint64)
    for axis, values in enumerate(axes):
        cell = ((values - values.min()) * ((2**21 - 1) / span)).astype(np.uint64)
        # Two zero bits between every two of the 21 bits.
        for shift, mask in (
            (32, 0x1F00000000FFFF),
            (16, 0x1F0000FF0000FF),
            (8, 0x100F00F00F00F00F),
            (4, 0x10C30C30C30C30C3),
            (2, 0x1249249249249249),
        ):
            cell = (cell | (cell << np.uint64(shift))) & np.uint64(mask)
        code |= cell << np.uint64(axis)
    order = np.argsort(code)
    ranked = code[order]
    if (ranked[1:] == ranked[:-1]).any():
        order = np.lexsort((*axes, code))
    return order


def _drop_non_finite(
    mesh: TriMesh, finite: NDArray[np.bool_], report: CleaningReport
) -> tuple[Points, Indices]:
    if finite.all():
        return mesh.vertices, mesh.triangles
    report.non_finite_vertices = int((~finite).sum())
    triangles = mesh.triangles[finite[mesh.triangles].all(axis=1)]
    if not len(triangles):
        raise MeshError(
            "Every face has a vertex at infinity or nowhere (NaN); check the modifiers and drivers "
            "that move the vertices."
        )
    return mesh.vertices[finite], (np.cumsum(finite) - 1)[triangles]


def _normalise(vertices: Points, triangles: Indices) -> tuple[Points, float, Points]:
    """Centre the vertices and divide them by their median edge.

    Returns:
        The vertices, the median edge, and the new length of each face's longest edge, (m,).
    """
    # Two steps, so that neither 1e300 nor 1e-300 overflows a square on the way.
    axes, used = columns(vertices), _used(vertices, triangles)
    middle = [np.median(axis[used], overwrite_input=True) for axis in axes]
    centred = axes * 0.5 - np.stack(middle)[:, None] * 0.5
    reach = np.abs(centred).max(axis=0)
    a, b, c = columns(triangles)
    of_face = np.maximum(np.maximum(reach[a], reach[b]), reach[c])
    extent = float(np.median(of_face, overwrite_input=True))
    if not extent > 0.0:
        extent = float(of_face.max())
    if not extent > 0.0:
        raise MeshError("All faces shrink to one point; check the scale of the object.")
    with np.errstate(over="ignore"):
        scaled = columns(np.clip(centred / extent, -1e30, 1e30))
    lengths = edge_lengths(scaled, triangles)
    positive = lengths[lengths > 0.0]
    if not len(positive):
        raise MeshError("All faces shrink to points; check the scale of the object.")
    median = float(np.median(positive, overwrite_input=True))
    edge = median * extent * 2.0
    if not (np.isfinite(edge) and edge > np.finfo(np.float64).tiny):
        raise MeshError(
            f"Edges of {edge:.3g} units are outside what numbers can hold; "
            "check the scale of the object."
        )
    return scaled / median, edge, lengths.max(axis=0) / median


def _used(vertices: Points, triangles: Indices) -> NDArray[np.bool_]:
    """Tell which vertices belong to a face, (n,)."""
    used = np.zeros(len(vertices), dtype=bool)
    used[triangles.ravel()] = True
    return used


def _drop_unusable(
    vertices: Points, triangles: Indices, longest: Points, report: CleaningReport
) -> Indices:
    """Drop faces that reach a vertex far away, and those without area."""
    stray = longest > EDGE_LIMIT
    report.stray_faces = int(stray.sum())
    if stray.any():  # first, as their areas may be more than numbers can hold
        triangles, longest = triangles[~stray], longest[~stray]
    _, doubled_area = face_normals(vertices, triangles)
    good = doubled_area > FLATNESS_LIMIT * longest**2
    report.degenerate_faces = int((~good).sum())
    return triangles if good.all() else triangles[good]


def _drop_duplicates(triangles: Indices, count: int, report: CleaningReport) -> Indices:
    repeated = repeated_faces(triangles, count)
    report.duplicate_faces = int(repeated.sum())
    return triangles[~repeated] if report.duplicate_faces else triangles


def repeated_faces(triangles: Indices, count: int) -> NDArray[np.bool_]:
    """Tell which faces lie on the same three of `count` vertices as an earlier one, (m,)."""
    repeated = np.zeros(len(triangles), dtype=bool)
    a, b, c = columns(triangles)
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    middle = a + b + c - low - high
    # One number a face tells at once that all are different, as they mostly are.
    if count < 2**KEY_BITS and not has_repeats(_face_key(low, middle, high)):
        return repeated
    order = np.lexsort((high, middle, low))
    ordered = np.stack((low, middle, high), axis=1)[order]
    # lexsort is stable, so the first of each run is the first in the mesh: it stays.
    repeated[order[1:]] = (ordered[1:] == ordered[:-1]).all(axis=1)
    return repeated


def split_creases(vertices: Points, triangles: Indices, angle: float) -> tuple[Indices, Indices]:
    """Cut the surface open along its sharp edges.

    Args:
        vertices: (n, 3) positions.
        triangles: (m, 3) consistently wound faces.
        angle: Faces that meet at a sharper angle than this, in radians, are parted.

    Returns:
        Triangles in terms of the parts, (m, 3), and the vertex each part belongs to, (p,); the
        first n parts are the vertices themselves.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    normal, area = face_normals(vertices, triangles)
    normal = normal / area
    face, other, corner, opposite = shared_edges(triangles, len(vertices))
    smooth = (normal[:, face] * normal[:, other]).sum(axis=0) >= np.cos(angle)
    face, other, corner, opposite = (array[smooth] for array in (face, other, corner, opposite))
    # A corner of a face goes on over a smooth edge to the corner of the next at the same vertex.
    following, preceding = (corner + 1) % 3, (opposite + 1) % 3
    one = np.concatenate((3 * face + corner, 3 * face + following))
    two = np.concatenate((3 * other + preceding, 3 * other + opposite))
    size = 3 * len(triangles)
    graph = coo_array((np.ones(len(one), dtype=np.int8), (one, two)), (size, size))
    _, fan = connected_components(graph, directed=False)
    # Fans are numbered by first corner; the first fan of a vertex keeps the vertex's number.
    owner = np.zeros(fan.max() + 1, dtype=np.int64)
    owner[fan] = triangles.ravel()
    order = np.argsort(owner, kind="stable")
    first = np.ones(len(order), dtype=bool)
    first[1:] = owner[order][1:] != owner[order][:-1]
    number = np.empty(len(order), dtype=np.int64)
    number[order[first]] = owner[order[first]]
    number[order[~first]] = len(vertices) + np.arange(int((~first).sum()))
    part_of = np.concatenate((np.arange(len(vertices)), owner[order[~first]]))
    return number[fan].reshape(-1, 3), part_of


def shared_edges(triangles: Indices, count: int) -> tuple[Indices, Indices, Indices, Indices]:
    """List the edges of exactly two faces that are wound alike.

    Returns:
        The two faces of each, and the corner of each at which the edge starts.
    """
    tail, head = half_edges(triangles)
    one, other = edge_pairs(triangles, count)
    wound = tail[one] == head[other]
    one, other = one[wound], other[wound]
    return one // 3, other // 3, one % 3, other % 3


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

    seam = np.zeros(vertex_count, dtype=bool)
    if not runs_twice(triangles, vertex_count):
        return triangles, seam
    count = len(triangles)
    tail, head = half_edges(triangles)
    # Only edges of exactly two faces say anything about winding.
    edge, twin = edge_pairs(triangles, vertex_count)
    one, other, alike = edge // 3, twin // 3, tail[edge] == tail[twin]
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
    torn = edge[alike ^ flip[one] ^ flip[other]]
    seam[tail[torn]] = seam[head[torn]] = True
    return np.where(flip[:, None], triangles[:, ::-1], triangles), seam


def _canonical_faces(triangles: Indices, count: int) -> Indices:
    """Start each face at its first vertex, winding kept, and sort the faces.

    So the last digit of every sum over faces is the same whatever the order they came in.
    """
    a, b, c = columns(triangles)
    second, third = (b < a) & (b < c), (c < a) & (c < b)
    turned = (
        np.where(second, b, np.where(third, c, a)),
        np.where(second, c, np.where(third, a, b)),
        np.where(second, a, np.where(third, b, c)),
    )
    if count < 2**KEY_BITS:
        # Numbers are sorted several times as fast as their order is found.
        key = np.sort(_face_key(*turned))
        below = 2**KEY_BITS - 1
        turned = (key >> 2 * KEY_BITS, (key >> KEY_BITS) & below, key & below)
    else:
        order = np.lexsort(turned[::-1])
        turned = tuple(corner[order] for corner in turned)
    return np.stack(turned, axis=1)


def _face_key(a: Indices, b: Indices, c: Indices) -> Indices:
    """One number for each face of three vertices below 2^KEY_BITS, (m,)."""
    return (a << 2 * KEY_BITS) | (b << KEY_BITS) | c
