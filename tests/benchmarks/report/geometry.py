# SPDX-License-Identifier: GPL-3.0-or-later
"""What the camera sees of a shape, as arrays, and where a light reaches it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import bpy
import numpy as np

from cdrf_addon.blender.mesh.surface import positions

from ..common.arrays import Array, Mask
from ..common.rays import Hits, cast_camera, near_rim, reached, tree_of, unit
from ..common.shapes import Shape
from .lights import directions


@dataclass(frozen=True)
class Geometry:
    """A shape as arrays, with the point in the middle of every pixel."""

    shape: Shape
    corners: Array | None
    """UV of the triangles' corners, (n, 3, 2), or None."""
    hits: Hits

    @property
    def normal(self) -> Array:
        """Smooth normal at each hit, (p, 3)."""
        return unit(self.hits.interpolate(self.shape, self.shape.normals))

    @cached_property
    def tree(self) -> Any:
        """The shape, ready for rays."""
        return tree_of(self.shape)

    def visible(self, places: Array, normals: Array, light: bpy.types.Object) -> Mask:
        """Return which places on the surface a light's centre reaches, by rays."""
        towards = directions(light, places)
        far = None
        if light.data.type != "SUN":
            far = np.linalg.norm(np.array(light.location) - places, axis=1)
        return reached(self.tree, places, normals, towards, far)

    def near_rim(self) -> Mask:
        """Return which hits are next to a hole."""
        return near_rim(self.shape, self.hits)


def read_geometry(obj: bpy.types.Object, size: int) -> Geometry:
    """Read a mesh object without modifiers, and cast the camera's rays."""
    mesh = obj.data
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    loops = np.empty(3 * count, dtype=np.int32)
    mesh.loop_triangles.foreach_get("loops", loops)
    vertices = np.empty(3 * count, dtype=np.int32)
    mesh.loop_triangles.foreach_get("vertices", vertices)
    normals = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertex_normals.foreach_get("vector", normals)
    corners = None
    if mesh.uv_layers.active is not None:
        uv = np.empty(2 * len(mesh.loops), dtype=np.float32)
        mesh.uv_layers.active.uv.foreach_get("vector", uv)
        corners = uv.reshape(-1, 2)[loops].reshape(-1, 3, 2).astype(np.float64)
    shape = Shape(
        obj.name,
        positions(mesh).reshape(-1, 3).astype(np.float64),
        vertices.reshape(-1, 3).astype(np.int64),
        normals.reshape(-1, 3).astype(np.float64),
    )
    return Geometry(shape, corners, cast_camera(shape, size))
