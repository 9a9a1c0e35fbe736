# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes of the report.

All are as large as those of kappa_choice and stand before the same camera. The head is life size;
every other shape stands for a figurine of 6 cm, so that a scattering of a few millimetres shows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Matrix, Vector

from cdrf_addon.blender.mesh.surface import positions

from ..common.files import MESHES
from ..common.shapes import EXTENT

FIGURINE = 60.0
HEAD = 280.0
"""Height of the head in millimetres (tests/data/README.md)."""


def _smooth(obj: bpy.types.Object, level: int) -> None:
    if level:
        modifier = obj.modifiers.new("Subdivision", "SUBSURF")
        modifier.levels = modifier.render_levels = level


def _sphere(level: int) -> bpy.types.Object:
    bpy.ops.mesh.primitive_uv_sphere_add(segments=24 * 2**level, ring_count=12 * 2**level)
    return bpy.context.object


def _torus(level: int) -> bpy.types.Object:
    bpy.ops.mesh.primitive_torus_add(
        major_segments=24 * 2**level,
        minor_segments=12 * 2**level,
        major_radius=1.0,
        minor_radius=0.42,
        rotation=(math.radians(55.0), math.radians(15.0), 0.0),
    )
    return bpy.context.object


def _suzanne(level: int) -> bpy.types.Object:
    bpy.ops.mesh.primitive_monkey_add(rotation=(0.0, 0.0, math.radians(-20.0)))
    _smooth(bpy.context.object, level)
    return bpy.context.object


def _import(name: str, level: int) -> bpy.types.Object:
    bpy.ops.wm.obj_import(filepath=str(MESHES / name))
    _smooth(bpy.context.object, level)
    return bpy.context.object


def _head(level: int) -> bpy.types.Object:
    return _import("human_head.obj", level)


def _turned_head(level: int) -> bpy.types.Object:
    obj = _import("human_head.obj", level)
    obj.rotation_euler.rotate(Matrix.Rotation(math.radians(40.0), 3, "Z"))
    return obj


def _bunny(level: int) -> bpy.types.Object:
    return _import("stanford_bunny.obj", level)


def _bust(level: int) -> bpy.types.Object:
    """Make the head with eyes, on a chest and a plinth, joined to one surface."""
    import bmesh  # late: only there once bpy is loaded

    obj = _import("human_head.obj", 0)
    bpy.ops.object.transform_apply(location=True, rotation=True, scale=True)
    # A shell that is open anywhere has no inside for the voxels.
    mesh = bmesh.new()
    mesh.from_mesh(obj.data)
    bmesh.ops.holes_fill(mesh, edges=mesh.edges[:], sides=0)
    bmesh.ops.triangulate(mesh, faces=mesh.faces[:])
    mesh.to_mesh(obj.data)
    mesh.free()
    size = obj.dimensions.z
    base = Vector(NECK)
    parts = [obj]
    for side in (-1.0, 1.0):
        parts.append(_ball((EYE_RADIUS,) * 3, Vector((side * EYE[0], *EYE[1:]))))
    for (across, deep, high), below in CHEST:
        place = base - Vector((0.0, 0.0, below * size))
        parts.append(_ball((across * size, deep * size, high * size), place))
    for radius, high, below in PLINTH:
        bpy.ops.mesh.primitive_cylinder_add(vertices=96, radius=radius * size, depth=high * size)
        parts.append(bpy.context.object)
        parts[-1].location = base - Vector((0.0, 0.0, below * size))
    for part in parts:
        part.select_set(True)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.join()
    joined = obj.modifiers.new("Joined", "REMESH")
    joined.mode, joined.voxel_size = "VOXEL", size * 0.048 / 2.0**level
    soft = obj.modifiers.new("Chisel", "SMOOTH")
    soft.factor, soft.iterations = 0.5, 2 + 2 * level
    return obj


NECK = (0.0, -0.18, 5.76)
"""Middle of the hole at the neck, in the units of the file; the sockets are EYE to each side."""
EYE, EYE_RADIUS = (0.32, -1.22, 7.285), 0.17
CHEST = (((0.43, 0.24, 0.3), 0.16), ((0.2, 0.17, 0.2), -0.02))
"""Half-axes of balls under the head, and how far below the neck; parts of the head's height."""
PLINTH = ((0.13, 0.16, 0.5), (0.25, 0.08, 0.6))
"""Radius and height of cylinders, and how far below."""


def _ball(axes: Sequence[float], place: Vector) -> bpy.types.Object:
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, location=place)
    bpy.context.object.scale = axes
    return bpy.context.object


@dataclass(frozen=True)
class Kind:
    """A shape: how it is made, and the height in millimetres that it stands for."""

    make: Callable[[int], bpy.types.Object]
    height: float = FIGURINE


SHAPES = {
    "sphere": Kind(_sphere),
    "torus": Kind(_torus),
    "Suzanne": Kind(_suzanne),
    "head": Kind(_head, HEAD),
    "bunny": Kind(_bunny),
    "bust": Kind(_bust),
    "turned head": Kind(_turned_head),
}


def make_shape(name: str, level: int) -> bpy.types.Object:
    """Build a shape at the origin, EXTENT large, smooth, its modifiers and transform applied."""
    obj = SHAPES[name].make(level)
    bpy.ops.object.select_all(action="DESELECT")
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.convert(target="MESH")
    bpy.ops.object.transform_apply(location=True, rotation=True, scale=True)
    bpy.ops.object.shade_smooth()
    places = positions(obj.data).reshape(-1, 3).astype(np.float64)
    low, high = places.min(axis=0), places.max(axis=0)
    fit = Matrix.Scale(EXTENT / float((high - low).max()), 4)
    obj.data.transform(fit @ Matrix.Translation(-Vector((low + high) / 2.0)))
    obj.data.materials.clear()
    obj.name = name
    return obj
