# SPDX-License-Identifier: GPL-3.0-or-later
"""The evaluated surface of an object: its shape in world units, and what tells it from another."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...core.curvature.field import Options
from ...core.curvature.topology import edge_lengths
from ...core.curvature.tri_mesh import TriMesh
from ...core.errors import MeshError

if TYPE_CHECKING:
    from numpy.typing import NDArray

# Bumped when the same mesh would give another curvature.
ESTIMATOR_VERSION = 3


# Entries of a (3, 3) matrix, row by row, in xx, xy, xz, yy, yz, zz.
_SYMMETRIC = (0, 1, 2, 1, 3, 4, 2, 4, 5)


@dataclass(frozen=True)
class Shape:
    """What the curvature of an object depends on: its evaluated surface, in world units."""

    mesh: TriMesh
    """Evaluated positions times the object's world scale, rotation and shear; not its location."""
    fingerprint: str
    """Hash of all of it; equal fingerprints have equal curvature."""
    local_fingerprint: str
    """Hash of the evaluated surface before the object's transform."""
    metric: NDArray[np.float64]
    """M^T M of the transform, (3, 3): equal for objects that differ by a rotation only."""
    axes: NDArray[np.float64]
    """The object's axes in the world, (3, 3) by columns: M without its scale and shear."""

    def in_object_axes(self, tensors: NDArray[np.float64]) -> NDArray[np.float64]:
        """Turn symmetric tensors from the world's axes into the object's.

        Args:
            tensors: (n, 6) xx, xy, xz, yy, yz, zz.

        Returns:
            The same of A^T S A.
        """
        matrix = tensors[:, _SYMMETRIC].reshape(-1, 3, 3)
        turned = self.axes.T @ matrix @ self.axes
        rows, columns = np.triu_indices(3)
        return np.asarray(turned[:, rows, columns])

    def size_relative_to(self, other: Shape) -> float | None:
        """Return how many times as large this is, or None if it is not the same shape scaled."""
        factor = float(np.trace(self.metric) / np.trace(other.metric))
        same = self.local_fingerprint == other.local_fingerprint and np.allclose(
            self.metric, factor * other.metric, rtol=0.0, atol=1e-5 * np.trace(self.metric)
        )
        return factor**0.5 if same else None


def linear_part(placed: bpy.types.Object) -> NDArray[np.float64]:
    """Return scale, rotation and shear of an object or instance, (3, 3)."""
    return np.array(placed.matrix_world, dtype=np.float64)[:3, :3]


def axes_of(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the orthogonal factor of a linear part's polar decomposition, (3, 3)."""
    left, _, right = np.linalg.svd(linear)
    return np.asarray(left @ right)


def metric_of(placed: bpy.types.Object) -> NDArray[np.float64]:
    """Return M^T M of the linear part M, (3, 3): equal for places that differ by a rotation."""
    linear = linear_part(placed)
    return linear.T @ linear


def positions(mesh: bpy.types.Mesh) -> NDArray[np.float32]:
    """Return vertex positions, (n, 3) float32, as Blender stores them."""
    flat = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    if len(flat):
        mesh.attributes["position"].data.foreach_get("vector", flat)
    return flat.reshape(-1, 3)


def corner_vertices(mesh: bpy.types.Mesh) -> NDArray[np.int32]:
    """Return the vertex of each face corner, (corners,): with the face sizes, the topology."""
    corners = np.empty(len(mesh.loops), dtype=np.int32)
    if len(corners):
        mesh.attributes[".corner_vert"].data.foreach_get("value", corners)
    return corners


def _triangles(mesh: bpy.types.Mesh) -> NDArray[np.int32]:
    """Return the vertices of the triangles that a mesh is drawn with, (3m,)."""
    if len(mesh.loops) == 3 * len(mesh.polygons):
        return corner_vertices(mesh)  # ten times as fast
    mesh.calc_loop_triangles()
    triangles = np.empty(3 * len(mesh.loop_triangles), dtype=np.int32)
    mesh.loop_triangles.foreach_get("vertices", triangles)
    return triangles


def _digest(*parts: bytes) -> str:
    digest = hashlib.blake2b(digest_size=16)
    for part in parts:
        digest.update(len(part).to_bytes(8, "little"))
        digest.update(part)
    return digest.hexdigest()


def base_fingerprint(mesh: bpy.types.Mesh) -> str:
    """Hash positions and topology of a mesh before modifiers."""
    return _digest(positions(mesh).tobytes(), corner_vertices(mesh).tobytes())


def read_shape(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, options: Options) -> Shape:
    """Read an object's evaluated surface in world size.

    Args:
        obj: A mesh object, not hidden (see `evaluable`).
        depsgraph: Its dependency graph.
        options: How its curvature will be measured; part of the fingerprint.

    Raises:
        MeshError: It has no faces, or its scale is zero along an axis.
    """
    linear = linear_part(obj)
    size = float(np.linalg.norm(linear))
    if not (np.isfinite(size) and abs(np.linalg.det(linear)) > 1e-12 * size**3 > 0.0):
        raise MeshError(
            f"'{obj.name}' has a scale of zero along an axis; give it a size (N panel > Scale)."
        )
    evaluated = obj.evaluated_get(depsgraph)
    if not evaluated.is_evaluated:
        raise MeshError(f"'{obj.name}' is hidden with its collection: show that and try again.")
    mesh = evaluated.to_mesh()
    try:
        if mesh is None or not len(mesh.polygons):
            raise MeshError(
                f"'{obj.name}' has no faces to shade"
                + (" after its modifiers." if len(obj.data.polygons) else "; add some first.")
            )
        local, triangles = positions(mesh), _triangles(mesh)
    finally:
        evaluated.to_mesh_clear()
    local_fingerprint = _digest(local.tobytes(), triangles.tobytes())
    faces = triangles.reshape(-1, 3)
    if np.linalg.det(linear) < 0.0:
        faces = faces[:, ::-1]  # a mirrored object keeps its outside
    metric = metric_of(obj)
    # Rounded, so that turning an object, which changes the last digits, recomputes nothing.
    rounded = np.round(metric / np.trace(metric), 6) + 0.0
    square = float(f"{np.trace(metric):.6g}")
    fingerprint = _digest(
        local_fingerprint.encode(),
        rounded.tobytes(),
        repr((square, options.method, options.radius, ESTIMATOR_VERSION)).encode(),
        f"{options.crease_angle:.5g}".encode(),
    )
    with np.errstate(invalid="ignore", over="ignore"):
        world = local.astype(np.float64) @ linear.T
    placed = TriMesh.from_arrays(world, faces)
    return Shape(placed, fingerprint, local_fingerprint, metric, axes_of(linear))


@contextmanager
def evaluable(
    objects: Iterable[bpy.types.Object],
    view_layer: bpy.types.ViewLayer,
    depsgraph: bpy.types.Depsgraph,
) -> Iterator[None]:
    """Show hidden objects inside the `with` block: Blender does not evaluate what it hides.

    Args:
        objects: Hidden ones among them are hidden again after the block.
        view_layer: Where they may be hidden.
        depsgraph: Brought up to date if anything was hidden.
    """
    hidden = [
        (obj, obj.hide_viewport, obj.hide_get(view_layer=view_layer))
        for obj in objects
        if obj.hide_viewport or obj.hide_get(view_layer=view_layer)
    ]
    for obj, *_ in hidden:
        obj.hide_viewport = False
        obj.hide_set(False, view_layer=view_layer)
    try:
        if hidden:
            depsgraph.update()
        yield
    finally:
        for obj, everywhere, here in hidden:
            obj.hide_set(here, view_layer=view_layer)
            obj.hide_viewport = everywhere


def coordinate_noise(mesh: TriMesh) -> float:
    """Return the curvature that rounding of positions may feign: rounding / edge^2, 1/unit."""
    some = mesh.triangles[:: max(1, len(mesh.triangles) // 10_000)]
    largest = float(np.median(np.abs(mesh.vertices[some[:, 0]]).max(axis=1)))
    edge = float(np.median(edge_lengths(mesh.vertices, some)))
    return largest * float(np.finfo(np.float32).eps) / edge**2 if edge > 0.0 else 0.0
