# SPDX-License-Identifier: GPL-3.0-or-later
"""Curvature as attributes of a mesh: carried back through its modifiers, written and removed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ... import ids
from ...core.curvature.estimators.tensor import PARTS
from ...core.curvature.scale_space import LEVELS
from ...core.curvature.summary import VARYING
from .surface import positions

if TYPE_CHECKING:
    from numpy.typing import NDArray

ORIGIN_ATTRIBUTE = ".cdrf_origin"
# Columns of principal curvatures, levels, means and shape operator; two more follow.
_WIDTHS = (4, LEVELS, LEVELS, PARTS)
_COLUMNS = sum(_WIDTHS) + 2
# Of the shape operator's entries: those that one vector holds, and those of the other.
_DIAGONAL, _MIXED = (0, 3, 5), (4, 2, 1)


def round_shape(mean: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the shape operator of a surface that bends alike in all directions, (n, PARTS).

    It has a part along the normal too, which nothing reads.
    """
    shape = np.zeros((len(mean), PARTS), dtype=np.float32)
    shape[:, _DIAGONAL] = mean[:, None]
    return shape


@dataclass(frozen=True)
class VertexCurvature:
    """Curvature at the vertices of a mesh as its attributes hold it; float32, n rows each."""

    principal: NDArray[np.float32]
    """(n, 4) kappa, k1, k2 and signed mean curvature, 1/unit."""
    levels: NDArray[np.float32]
    """(n, LEVELS) kappa at the diffusion lengths, 1/unit."""
    means: NDArray[np.float32]
    """(n, LEVELS) signed mean curvature at the same lengths, 1/unit."""
    shape: NDArray[np.float32]
    """(n, PARTS) the shape operator in the object's axes: xx, xy, xz, yy, yz, zz, 1/unit."""
    shortest: NDArray[np.float32]
    """(n,) the shortest of these lengths, in world units."""
    filled: NDArray[np.float32]
    """(n,) 1 where the neighbours' curvature stands in; a part of 1 where vertices were merged."""

    @classmethod
    def flat(cls, count: int) -> VertexCurvature:
        """Return no curvature at that many vertices."""
        return cls._of_columns(np.zeros((count, _COLUMNS), dtype=np.float32))

    @classmethod
    def constant(cls, count: int, values: tuple[float, ...]) -> VertexCurvature:
        """Return one curvature at that many vertices: kappa, k1, k2 and signed mean."""
        principal = np.tile(np.array(values, dtype=np.float32), (count, 1))
        levels = np.repeat(principal[:, :1], LEVELS, axis=1)
        means = np.repeat(principal[:, 3:], LEVELS, axis=1)
        ones = np.ones(count, dtype=np.float32)
        shape = round_shape(principal[:, 3])
        return cls(principal, levels, means, shape, ones, np.zeros_like(ones))

    @classmethod
    def _of_columns(cls, columns: NDArray[np.float32]) -> VertexCurvature:
        principal, levels, means, shape, rest = np.split(columns, np.cumsum(_WIDTHS), axis=1)
        return cls(principal, levels, means, shape, rest[:, 0], rest[:, 1])

    def on_original_vertices(
        self, obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph
    ) -> tuple[VertexCurvature, int]:
        """Carry it from an object's evaluated vertices to its own; see `to_original_vertices`."""
        columns = np.column_stack(
            (self.principal, self.levels, self.means, self.shape, self.shortest, self.filled)
        )
        carried, lost = to_original_vertices(obj, depsgraph, columns)
        return self._of_columns(carried), lost


@contextmanager
def evaluated_origins(
    obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph
) -> Iterator[NDArray[np.int64]]:
    """Yield for each evaluated vertex which original vertex it is, -1 where it is a new one.

    Modifiers blend attributes, so a vertex is an original one where all of a random code arrives
    unblended. The code lies on the mesh only inside the `with` block.
    """
    mesh = obj.data
    count = len(mesh.vertices)
    code = np.random.default_rng(20111106).random((count, 3), dtype=np.float32)
    attribute = mesh.attributes.new(ORIGIN_ATTRIBUTE, "FLOAT_VECTOR", "POINT")
    name = attribute.name
    try:
        attribute.data.foreach_set("vector", code.ravel())
        mesh.update_tag()
        depsgraph.update()
        evaluated = obj.evaluated_get(depsgraph)
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
    obj: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    values: NDArray[np.float32],
) -> tuple[NDArray[np.float32], int]:
    """Carry values at the evaluated vertices to the vertices of the mesh that can be stored on.

    Modifiers that only move vertices keep their number and order. For the others, each original
    vertex takes the mean over the evaluated vertices it became (a mirror makes two); those that
    did not survive take the value of the nearest evaluated vertex.

    Args:
        obj: A mesh object.
        depsgraph: Its dependency graph.
        values: (number of evaluated vertices, k).

    Returns:
        (number of original vertices, k), and how many had to take the nearest.
    """
    mesh = obj.data
    count = len(mesh.vertices)
    if not obj.modifiers or _only_deforms(obj, len(values)):
        return values, 0
    with evaluated_origins(obj, depsgraph) as origin:
        known = origin >= 0
        total = np.bincount(origin[known], minlength=count)
        carried = np.stack(
            [np.bincount(origin[known], part[known], minlength=count) for part in values.T], 1
        )
    result = (carried / np.maximum(total, 1)[:, None]).astype(np.float32)
    lost = np.flatnonzero(total == 0)
    if len(lost):
        from scipy.spatial import cKDTree

        evaluated = obj.evaluated_get(depsgraph)
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


def _only_deforms(obj: bpy.types.Object, evaluated_count: int) -> bool:
    return evaluated_count == len(obj.data.vertices) and all(
        modifier.type in DEFORMING or not modifier.show_viewport for modifier in obj.modifiers
    )


_KINDS = {
    ids.CURVATURE_ATTRIBUTE: "FLOAT_COLOR",
    ids.DIFFUSED_ATTRIBUTE: "FLOAT_COLOR",
    ids.MEAN_ATTRIBUTE: "FLOAT_COLOR",
    ids.SHAPE_ATTRIBUTE: "FLOAT_VECTOR",
    ids.SHAPE_MIXED_ATTRIBUTE: "FLOAT_VECTOR",
    ids.LENGTH_ATTRIBUTE: "FLOAT",
}
"""Attributes that a mesh has together, with their types."""
_WALK = (ids.MEAN_ATTRIBUTE, ids.SHAPE_ATTRIBUTE, ids.SHAPE_MIXED_ATTRIBUTE)


def write_curvature(mesh: bpy.types.Mesh, curvature: VertexCurvature) -> None:
    """Store a mesh's curvature, without the marks of `mark_filled`."""
    _write_colours(mesh, ids.CURVATURE_ATTRIBUTE, curvature.principal)
    _write_colours(mesh, ids.DIFFUSED_ATTRIBUTE, curvature.levels)
    _write_colours(mesh, ids.MEAN_ATTRIBUTE, curvature.means)
    _write(mesh, ids.SHAPE_ATTRIBUTE, "FLOAT_VECTOR", "vector", curvature.shape[:, _DIAGONAL])
    _write(mesh, ids.SHAPE_MIXED_ATTRIBUTE, "FLOAT_VECTOR", "vector", curvature.shape[:, _MIXED])
    _write(mesh, ids.LENGTH_ATTRIBUTE, "FLOAT", "value", curvature.shortest)
    mesh.update_tag()


def mark_filled(mesh: bpy.types.Mesh, curvature: VertexCurvature) -> None:
    """Mark the vertices whose curvature comes from their neighbours; no mark, no attribute."""
    filled = curvature.filled > 0.5
    if filled.any():
        _write(mesh, ids.FILLED_ATTRIBUTE, "FLOAT", "value", filled.astype(np.float32))
    elif ids.FILLED_ATTRIBUTE in mesh.attributes:
        mesh.attributes.remove(mesh.attributes[ids.FILLED_ATTRIBUTE])


def _write(
    mesh: bpy.types.Mesh, name: str, kind: str, entry: str, values: NDArray[np.float32]
) -> None:
    """Store values at the points of a mesh.

    Args:
        mesh: Any local mesh.
        name: Of the attribute; one of another type gives way.
        kind: Type of the attribute.
        entry: Blender's name of the value in an element of that type.
        values: One row for each vertex.
    """
    if name in mesh.attributes and not _holds(mesh, name, kind):
        mesh.attributes.remove(mesh.attributes[name])
    if name not in mesh.attributes:
        mesh.attributes.new(name, kind, "POINT")
    numbers = np.ascontiguousarray(values, dtype=np.float32).ravel()
    mesh.attributes[name].data.foreach_set(entry, numbers)


def _write_colours(mesh: bpy.types.Mesh, name: str, values: NDArray[np.float32]) -> None:
    if not _holds(mesh, name, "FLOAT_COLOR"):
        if name in mesh.attributes:
            mesh.attributes.remove(mesh.attributes[name])
        # The first colour attribute of a mesh becomes the one to paint on: leave that as it was.
        active = mesh.color_attributes.active_color_name
        render = mesh.color_attributes.render_color_index
        mesh.attributes.new(name, "FLOAT_COLOR", "POINT")
        if active and render >= 0:
            mesh.color_attributes.active_color_name = active
            mesh.color_attributes.render_color_index = render
    _write(mesh, name, "FLOAT_COLOR", "color", values)


def remove_curvature(mesh: bpy.types.Mesh) -> None:
    """Remove the attributes from a mesh that does not need them."""
    for name in (*_KINDS, ids.FILLED_ATTRIBUTE):
        attribute = mesh.attributes.get(name)
        if attribute is not None:
            mesh.attributes.remove(attribute)
            mesh.update_tag()


def has_curvature(mesh: bpy.types.Mesh) -> bool:
    """Return whether a mesh carries the attributes in the form the shader reads."""
    return all(_holds(mesh, name, kind) for name, kind in _KINDS.items() if name not in _WALK)


def has_walk_curvature(mesh: bpy.types.Mesh) -> bool:
    """Return whether a mesh carries what view dependence reads too; older files do not."""
    return has_curvature(mesh) and all(_holds(mesh, name, _KINDS[name]) for name in _WALK)


def is_measured(mesh: bpy.types.Mesh) -> bool:
    """Return whether a mesh carries what was measured of it."""
    known = mesh.cdrf
    return bool(known.fingerprint) and (known.kind != VARYING or has_curvature(mesh))


def _holds(mesh: bpy.types.Mesh, name: str, kind: str) -> bool:
    attribute = mesh.attributes.get(name)
    return attribute is not None and attribute.data_type == kind and attribute.domain == "POINT"
