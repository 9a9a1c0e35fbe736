# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluated meshes out of Blender, curvature attributes into it."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ... import ids
from ...core.curvature.field import Options
from ...core.curvature.summary import VARYING
from ...core.curvature.topology import edge_lengths
from ...core.curvature.tri_mesh import TriMesh
from ...core.errors import MeshError

if TYPE_CHECKING:
    from numpy.typing import NDArray

# Bumped when the same mesh would give another curvature.
ESTIMATOR_VERSION = 3
ORIGIN_ATTRIBUTE = ".cdrf_origin"


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

    def size_relative_to(self, other: Shape) -> float | None:
        """Return how many times as large this is, or None if it is not the same shape scaled."""
        factor = float(np.trace(self.metric) / np.trace(other.metric))
        same = self.local_fingerprint == other.local_fingerprint and np.allclose(
            self.metric, factor * other.metric, rtol=0.0, atol=1e-5 * np.trace(self.metric)
        )
        return factor**0.5 if same else None


def linear_part(item: bpy.types.Object) -> NDArray[np.float64]:
    """Scale, rotation and shear of an object, (3, 3)."""
    return np.array(item.matrix_world, dtype=np.float64)[:3, :3]


def positions(mesh: bpy.types.Mesh) -> NDArray[np.float32]:
    """Vertex positions, (n, 3) float32, as Blender stores them."""
    flat = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    if len(flat):
        mesh.attributes["position"].data.foreach_get("vector", flat)
    return flat.reshape(-1, 3)


def corner_vertices(mesh: bpy.types.Mesh) -> NDArray[np.int32]:
    """Vertex of each face corner: with the face sizes, the topology."""
    corners = np.empty(len(mesh.loops), dtype=np.int32)
    if len(corners):
        mesh.attributes[".corner_vert"].data.foreach_get("value", corners)
    return corners


def _triangles(mesh: bpy.types.Mesh) -> NDArray[np.int32]:
    """Vertices of the triangles that a mesh is drawn with, (3m,)."""
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


def read_shape(item: bpy.types.Object, depsgraph: bpy.types.Depsgraph, options: Options) -> Shape:
    """Read an object's evaluated surface in world size.

    Raises:
        MeshError: It has no faces, or its scale is zero along an axis.
    """
    linear = linear_part(item)
    size = float(np.linalg.norm(linear))
    if not (np.isfinite(size) and abs(np.linalg.det(linear)) > 1e-12 * size**3 > 0.0):
        raise MeshError(
            f"'{item.name}' has a scale of zero along an axis; give it a size (N panel > Scale)."
        )
    evaluated = item.evaluated_get(depsgraph)
    if not evaluated.is_evaluated:
        raise MeshError(f"'{item.name}' is hidden with its collection: show that and try again.")
    mesh = evaluated.to_mesh()
    try:
        if mesh is None or not len(mesh.polygons):
            raise MeshError(
                f"'{item.name}' has no faces to shade"
                + (" after its modifiers." if len(item.data.polygons) else "; add some first.")
            )
        local, triangles = positions(mesh), _triangles(mesh)
    finally:
        evaluated.to_mesh_clear()
    local_fingerprint = _digest(local.tobytes(), triangles.tobytes())
    faces = triangles.reshape(-1, 3)
    if np.linalg.det(linear) < 0.0:
        faces = faces[:, ::-1]  # a mirrored object keeps its outside
    metric = linear.T @ linear
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
    return Shape(TriMesh.from_arrays(world, faces), fingerprint, local_fingerprint, metric)


@contextmanager
def evaluable(
    items: Iterable[bpy.types.Object],
    view_layer: bpy.types.ViewLayer,
    depsgraph: bpy.types.Depsgraph,
) -> Iterator[None]:
    """Show hidden objects inside the `with` block: Blender does not evaluate what it hides."""
    hidden = [
        (item, item.hide_viewport, item.hide_get(view_layer=view_layer))
        for item in items
        if item.hide_viewport or item.hide_get(view_layer=view_layer)
    ]
    for item, *_ in hidden:
        item.hide_viewport = False
        item.hide_set(False, view_layer=view_layer)
    try:
        if hidden:
            depsgraph.update()
        yield
    finally:
        for item, everywhere, here in hidden:
            item.hide_set(here, view_layer=view_layer)
            item.hide_viewport = everywhere


def coordinate_noise(mesh: TriMesh) -> float:
    """Curvature that the rounding of float32 positions alone may feign: rounding / edge^2."""
    some = mesh.triangles[:: max(1, len(mesh.triangles) // 10_000)]
    largest = float(np.median(np.abs(mesh.vertices[some[:, 0]]).max(axis=1)))
    edge = float(np.median(edge_lengths(mesh.vertices, some)))
    return largest * float(np.finfo(np.float32).eps) / edge**2 if edge > 0.0 else 0.0


@contextmanager
def evaluated_origins(
    item: bpy.types.Object, depsgraph: bpy.types.Depsgraph
) -> Iterator[NDArray[np.int64]]:
    """Tell for each evaluated vertex which original vertex it is, -1 where it is a new one.

    Modifiers blend attributes, so a vertex is an original one where all of a random code arrives
    unblended. The code lies on the mesh only inside the `with` block.
    """
    mesh = item.data
    count = len(mesh.vertices)
    code = np.random.default_rng(20111106).random((count, 3), dtype=np.float32)
    attribute = mesh.attributes.new(ORIGIN_ATTRIBUTE, "FLOAT_VECTOR", "POINT")
    name = attribute.name
    try:
        attribute.data.foreach_set("vector", code.ravel())
        mesh.update_tag()
        depsgraph.update()
        evaluated = item.evaluated_get(depsgraph)
        result = evaluated.to_mesh()
        try:
            arrived = np.zeros((len(result.vertices), 3), dtype=np.float32)
            carried = result.attributes.get(name)
            if carried is not None and carried.domain == "POINT":
                carried.data.foreach_get("vector", arrived.ravel())
        finally:
            evaluated.to_mesh_clear()
        origin = np.full(len(arrived), -1, dtype=np.int64)
        if arrived.any():
            from scipy.spatial import cKDTree

            distance, nearest = cKDTree(code).query(arrived, distance_upper_bound=1e-6)
            origin = np.where(np.isfinite(distance), nearest, -1).astype(np.int64)
        yield origin
    finally:
        mesh.attributes.remove(mesh.attributes[name])
        mesh.update_tag()


def to_original_vertices(
    item: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    values: NDArray[np.float32],
) -> tuple[NDArray[np.float32], int]:
    """Carry values at the evaluated vertices to the vertices of the mesh that can be stored on.

    Modifiers that only move vertices keep their number and order. For the others, each original
    vertex takes the mean over the evaluated vertices it became (a mirror makes two); those that
    did not survive take the value of the nearest evaluated vertex.

    Args:
        item: The object.
        depsgraph: Its dependency graph.
        values: (number of evaluated vertices, k).

    Returns:
        (number of original vertices, k), and how many had to take the nearest.
    """
    mesh = item.data
    count = len(mesh.vertices)
    if not item.modifiers or _only_deforms(item, len(values)):
        return values, 0
    with evaluated_origins(item, depsgraph) as origin:
        known = origin >= 0
        total = np.bincount(origin[known], minlength=count)
        carried = np.stack(
            [np.bincount(origin[known], part[known], minlength=count) for part in values.T], 1
        )
    result = (carried / np.maximum(total, 1)[:, None]).astype(np.float32)
    lost = np.flatnonzero(total == 0)
    if len(lost):
        from scipy.spatial import cKDTree

        evaluated = item.evaluated_get(depsgraph)
        shape = evaluated.to_mesh()
        try:
            where = positions(shape)
        finally:
            evaluated.to_mesh_clear()
        result[lost] = values[cKDTree(where).query(positions(mesh)[lost])[1]]
    return result, len(lost)


# Modifiers that neither add, remove nor reorder vertices.
DEFORMING = {
    *("ARMATURE", "CAST", "CURVE", "DISPLACE", "HOOK", "LAPLACIANDEFORM", "LATTICE"),
    *("MESH_DEFORM", "SHRINKWRAP", "SIMPLE_DEFORM", "SMOOTH", "CORRECTIVE_SMOOTH"),
    *("LAPLACIANSMOOTH", "SURFACE_DEFORM", "WARP", "WAVE", "CLOTH", "COLLISION", "SOFT_BODY"),
    *("MESH_CACHE", "DATA_TRANSFER", "NORMAL_EDIT", "WEIGHTED_NORMAL", "UV_PROJECT", "UV_WARP"),
    *("VERTEX_WEIGHT_EDIT", "VERTEX_WEIGHT_MIX", "VERTEX_WEIGHT_PROXIMITY", "MESH_SEQUENCE_CACHE"),
}


def _only_deforms(item: bpy.types.Object, evaluated_count: int) -> bool:
    return evaluated_count == len(item.data.vertices) and all(
        modifier.type in DEFORMING or not modifier.show_viewport for modifier in item.modifiers
    )


_COLOURS = (ids.CURVATURE_ATTRIBUTE, ids.DIFFUSED_ATTRIBUTE)


def write_curvature(
    mesh: bpy.types.Mesh,
    principal: NDArray[np.float32],
    levels: NDArray[np.float32],
    finest: NDArray[np.float32],
) -> None:
    """Store a mesh's curvature.

    Args:
        mesh: The mesh.
        principal: (n, 4) kappa, k1, k2, signed mean.
        levels: (n, 4) kappa at four diffusion lengths.
        finest: (n,) the shortest of those lengths, in world units.
    """
    _write_colours(mesh, ids.CURVATURE_ATTRIBUTE, principal)
    _write_colours(mesh, ids.DIFFUSED_ATTRIBUTE, levels)
    _write_floats(mesh, ids.LENGTH_ATTRIBUTE, finest)
    mesh.update_tag()


def mark_filled(mesh: bpy.types.Mesh, filled: NDArray[np.bool_]) -> None:
    """Mark the vertices whose curvature comes from their neighbours; no mark, no attribute."""
    if filled.any():
        _write_floats(mesh, ids.FILLED_ATTRIBUTE, filled.astype(np.float32))
    elif ids.FILLED_ATTRIBUTE in mesh.attributes:
        mesh.attributes.remove(mesh.attributes[ids.FILLED_ATTRIBUTE])


def _write_floats(mesh: bpy.types.Mesh, name: str, values: NDArray[np.float32]) -> None:
    if name in mesh.attributes and not _holds(mesh, name, "FLOAT"):
        mesh.attributes.remove(mesh.attributes[name])
    if name not in mesh.attributes:
        mesh.attributes.new(name, "FLOAT", "POINT")
    mesh.attributes[name].data.foreach_set("value", np.ascontiguousarray(values))


def _write_colours(mesh: bpy.types.Mesh, name: str, values: NDArray[np.float32]) -> None:
    if name in mesh.attributes and not _holds(mesh, name, "FLOAT_COLOR"):
        mesh.attributes.remove(mesh.attributes[name])
    if name not in mesh.attributes:
        # The first colour attribute of a mesh becomes the one to paint on: leave that as it was.
        active = mesh.color_attributes.active_color_name
        render = mesh.color_attributes.render_color_index
        mesh.attributes.new(name, "FLOAT_COLOR", "POINT")
        if active and render >= 0:
            mesh.color_attributes.active_color_name = active
            mesh.color_attributes.render_color_index = render
    colours = np.ascontiguousarray(values, dtype=np.float32).ravel()
    mesh.attributes[name].data.foreach_set("color", colours)


def remove_curvature(mesh: bpy.types.Mesh) -> None:
    """Take the attributes off a mesh that does not need them."""
    for name in (*_COLOURS, ids.LENGTH_ATTRIBUTE, ids.FILLED_ATTRIBUTE):
        attribute = mesh.attributes.get(name)
        if attribute is not None:
            mesh.attributes.remove(attribute)
            mesh.update_tag()


def has_curvature(mesh: bpy.types.Mesh) -> bool:
    """Tell whether a mesh carries the attributes in the form the shader reads."""
    return _holds(mesh, ids.LENGTH_ATTRIBUTE, "FLOAT") and all(
        _holds(mesh, name, "FLOAT_COLOR") for name in _COLOURS
    )


def is_measured(mesh: bpy.types.Mesh) -> bool:
    """Tell whether a mesh carries what was measured of it."""
    known = mesh.cdrf
    return bool(known.fingerprint) and (known.kind != VARYING or has_curvature(mesh))


def _holds(mesh: bpy.types.Mesh, name: str, kind: str) -> bool:
    attribute = mesh.attributes.get(name)
    return attribute is not None and attribute.data_type == kind and attribute.domain == "POINT"
