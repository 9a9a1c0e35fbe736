# SPDX-License-Identifier: GPL-3.0-or-later
"""Clean a triangle mesh for the estimators: weld, filter, orient, normalise and sort it.

libigl crashes, hangs or returns silent zeros on what artists call a normal mesh (loose vertices,
doubled faces, seams, one vertex at infinity). `clean` returns a copy on which none of that can
happen, reports what it left out, and keeps the way back to the artist's vertices.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..errors import MeshError
from ..progress import run_steps
from .creases import NO_CREASE, split_creases
from .topology import (
    FLATNESS_LIMIT,
    KEY_BITS,
    FaceNormals,
    columns,
    edge_lengths,
    face_key,
    face_normals,
    has_repeats,
    repeated_faces,
)
from .winding import orient

if TYPE_CHECKING:
    from .tri_mesh import Indices, Mask, Points, TriMesh

# A face this many times the median edge belongs to a vertex that has flown off.
EDGE_LIMIT = 1e6


@dataclass
class CleaningReport:
    """Counts of what `clean` left out or changed; all zero on a good mesh."""

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
        counts = [
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
            (
                self.flipped_faces,
                "{} faces point the other way (Mesh > Normals > Recalculate Outside mends it).",
            ),
        ]
        lines = [text.format(f"{count:,}") for count, text in counts if count]
        if self.non_orientable:
            lines.append("The surface has no outside (a Möbius strip); its seam is filled in.")
        return lines


@dataclass(frozen=True)
class CleanMesh:
    """A mesh that every estimator can work on, centred, in units of its median edge."""

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
    seam: Mask
    """(n,) True where neighbouring faces cannot be wound alike (the seam of a Möbius strip)."""
    report: CleaningReport = field(default_factory=CleaningReport)

    @cached_property
    def face_normals(self) -> FaceNormals:
        """Normals of the faces and their areas, in units of `edge`."""
        return face_normals(self.vertices, self.triangles)

    def to_source(self, values: Points, loose: float = 0.0) -> Points:
        """Carry values of the vertices back to the source's; a vertex gets its parts' mean.

        Args:
            values: (n,) values of the clean mesh.
            loose: Value of source vertices that belong to no usable face.

        Returns:
            (N,) values.
        """
        if len(self.part_of) and self.part_of[-1] + 1 < len(self.part_of):
            parts = np.bincount(self.part_of)
            values = np.bincount(self.part_of, values) / parts
        return np.where(self.source >= 0, values[np.maximum(self.source, 0)], loose)


def clean(mesh: TriMesh, crease_angle: float = NO_CREASE) -> CleanMesh:
    """Clean a mesh in one go; see `clean_steps`."""
    return run_steps(clean_steps(mesh, crease_angle))


def clean_steps(mesh: TriMesh, crease_angle: float = NO_CREASE) -> Generator[None, None, CleanMesh]:
    """Weld, filter, orient, normalise and sort a mesh, pausing between the parts of the work.

    The result does not depend on the order of the source's vertices: they are sorted along a
    space-filling curve, which also keeps neighbours together in memory.

    Args:
        mesh: Any mesh; unchanged.
        crease_angle: Split the surface where faces meet at a sharper angle than this, in radians.

    Returns:
        The mesh for the estimators and the way back.

    Raises:
        MeshError: No face is left; the text gives the reason.
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
    welding = weld(vertices)
    report.welded_vertices = int(len(vertices) - len(welding.first))
    yield
    if report.welded_vertices:
        vertices, triangles = vertices[welding.first], welding.group[triangles]
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
    source[finite] = place[welding.group]
    vertices = vertices[order]
    triangles = _canonical_faces(place[triangles], len(vertices))
    yield
    oriented = orient(triangles, len(vertices))
    triangles, seam = oriented.triangles, oriented.seam
    report.flipped_faces, report.non_orientable = oriented.flipped_faces, oriented.non_orientable
    yield
    part_of = np.arange(len(vertices))
    if crease_angle < NO_CREASE:
        split = split_creases(vertices, triangles, crease_angle)
        triangles, part_of = split.triangles, split.part_of
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


@dataclass(frozen=True)
class Welding:
    """Vertices at equal positions, put together in groups."""

    group: Indices
    """(n,) group of each vertex, numbered by first appearance."""
    first: Indices
    """(g,) first vertex of each group."""


def weld(vertices: Points) -> Welding:
    """Merge vertices at exactly equal positions (seams of imported files are exact copies).

    Args:
        vertices: (n, 3) finite or not; a NaN is merged only with one of the same bits.
    """
    bits = columns(vertices + 0.0).view(np.uint64)  # + 0.0 turns -0.0 into 0.0
    # An odd multiplier per axis mixes 192 bits into 64; the comparison below catches a collision.
    with np.errstate(over="ignore"):
        key = bits[0] * np.uint64(0x9E3779B97F4A7C15)
        key ^= (key >> np.uint64(29)) + bits[1] * np.uint64(0xBF58476D1CE4E5B9)
        key ^= (key >> np.uint64(31)) + bits[2] * np.uint64(0x94D049BB133111EB)
    if not has_repeats(key):
        each = np.arange(len(key))
        return Welding(each, each)
    _, first, group = np.unique(key, return_index=True, return_inverse=True)
    if not np.array_equal(bits[:, first[group]], bits):
        _, first, group = np.unique(bits, axis=1, return_index=True, return_inverse=True)
        group = group.reshape(-1)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return Welding(rank[group].astype(np.int64), first[order].astype(np.int64))


def morton_order(vertices: Points) -> Indices:
    """Sort the vertices along a space-filling curve (Morton 1966), (n,).

    Equal cells are ordered by position, so that the order depends on nothing else.
    """
    axes = columns(vertices)
    span = max(float(np.ptp(axes, axis=1).max()), np.finfo(np.float64).tiny)
    code = np.zeros(len(vertices), dtype=np.uint64)
    for axis, values in enumerate(axes):
        cell = ((values - values.min()) * ((2**21 - 1) / span)).astype(np.uint64)
        # Insert two zero bits between every two of the 21 bits.
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


def _drop_non_finite(mesh: TriMesh, finite: Mask, report: CleaningReport) -> tuple[Points, Indices]:
    """Drop the vertices that are not finite, and the faces that use them."""
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


def _used(vertices: Points, triangles: Indices) -> Mask:
    """Return which vertices belong to a face, (n,)."""
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
    good = face_normals(vertices, triangles).doubled_area > FLATNESS_LIMIT * longest**2
    report.degenerate_faces = int((~good).sum())
    return triangles if good.all() else triangles[good]


def _drop_duplicates(triangles: Indices, count: int, report: CleaningReport) -> Indices:
    """Keep one of the faces on the same three of `count` vertices."""
    repeated = repeated_faces(triangles, count)
    report.duplicate_faces = int(repeated.sum())
    return triangles[~repeated] if report.duplicate_faces else triangles


def _canonical_faces(triangles: Indices, count: int) -> Indices:
    """Start each face at its first vertex, winding kept, and sort the faces.

    The last digit of every sum over faces is then the same, whatever order they came in.
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
        key = np.sort(face_key(*turned))
        below = 2**KEY_BITS - 1
        turned = (key >> 2 * KEY_BITS, (key >> KEY_BITS) & below, key & below)
    else:
        order = np.lexsort(turned[::-1])
        turned = tuple(corner[order] for corner in turned)
    return np.stack(turned, axis=1)
