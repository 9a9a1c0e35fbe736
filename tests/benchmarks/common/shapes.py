# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes of the benchmarks: triangle meshes with Blender's smooth normals, all of one size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import bpy
import igl
import numpy as np
from numpy.typing import NDArray
from rig import Rig

from .arrays import Array

SEED = 20111106
EXTENT = 2.7864
"""Largest extent to which every shape is scaled: the height of the head."""


@dataclass(frozen=True)
class Shape:
    """A triangle mesh with Blender's smooth normals."""

    name: str
    vertices: Array
    triangles: NDArray[np.int64]
    normals: Array

    @cached_property
    def edge(self) -> float:
        """Median length of an edge."""
        corners = self.vertices[self.triangles]
        return float(np.median(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)))

    @property
    def area(self) -> float:
        """Area of the whole surface."""
        return float(igl.doublearea(self.vertices, self.triangles).sum() / 2.0)

    def rim(self) -> Array:
        """Return the vertices on the edges of holes, (n, 3)."""
        loops = igl.boundary_facets(self.triangles)
        edges = loops[0] if isinstance(loops, tuple) else loops
        return self.vertices[np.unique(edges)] if len(edges) else np.empty((0, 3))

    def noisy(self, noise: float) -> Shape:
        """Move the vertices along the normals at random, by a part of the median edge."""
        rng = np.random.default_rng(SEED)
        push = rng.normal(0.0, noise * self.edge, (len(self.vertices), 1))
        moved = self.vertices + push * self.normals
        return Shape(f"{self.name}, noisy", moved, self.triangles, self.normals)


def read_obj(path: Path) -> tuple[Array, list[list[int]]]:
    """Read positions and faces, turned to Blender's Z up, centred, EXTENT large."""
    points, faces = [], []
    for line in path.read_text(encoding="utf-8").splitlines():
        kind, *words = line.split() or [""]
        if kind == "v":
            points.append([float(word) for word in words[:3]])
        elif kind == "f":
            faces.append([int(word.split("/")[0]) - 1 for word in words])
    x, y, z = np.array(points).T
    turned = np.stack((x, -z, y), axis=1)
    low, high = turned.min(axis=0), turned.max(axis=0)
    return (turned - (low + high) / 2.0) * (EXTENT / float((high - low).max())), faces


def to_blender(
    vertices: Array, faces: Sequence[Sequence[int]] | NDArray[np.int64]
) -> bpy.types.Object:
    """Link a smooth mesh to the scene."""
    mesh = bpy.data.meshes.new("Shape")
    mesh.from_pydata(vertices, [], faces)
    mesh.shade_smooth()
    obj = bpy.data.objects.new("Shape", mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def subdivided(name: str, path: Path, level: int) -> Shape:
    """Subdivide by Catmull-Clark and triangulate, as Blender does it."""
    Rig()
    obj = to_blender(*read_obj(path))
    modifier = obj.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = level
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    mesh.calc_loop_triangles()
    places = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get("co", places)
    corners = np.empty(3 * len(mesh.loop_triangles), dtype=np.int32)
    mesh.loop_triangles.foreach_get("vertices", corners)
    vertices = places.reshape(-1, 3).astype(np.float64)
    triangles = corners.reshape(-1, 3).astype(np.int64)
    smooth = to_blender(vertices, triangles).data
    smooth.vertex_normals.foreach_get("vector", places)
    return Shape(name, vertices, triangles, places.reshape(-1, 3).astype(np.float64))


def mesh_of(vertices: Array, triangles: NDArray[np.int64]) -> bpy.types.Mesh:
    """Hand positions, (n, 3), and triangles, (m, 3), to Blender."""
    mesh = bpy.data.meshes.new("Surface")
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", vertices.astype(np.float32).ravel())
    mesh.loops.add(triangles.size)
    mesh.loops.foreach_set("vertex_index", triangles.astype(np.int32).ravel())
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, triangles.size, 3, dtype=np.int32))
    mesh.update()
    return mesh
