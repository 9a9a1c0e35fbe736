# SPDX-License-Identifier: GPL-3.0-or-later
"""A stage for bare mesh files: import, camera and light."""

from __future__ import annotations

import math
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

from ..compat import EEVEE, ensure_node_tree
from ..core.errors import SceneError

MESH_IMPORTERS = {
    ".obj": lambda path: bpy.ops.wm.obj_import(filepath=path),
    ".ply": lambda path: bpy.ops.wm.ply_import(filepath=path),
    ".stl": lambda path: bpy.ops.wm.stl_import(filepath=path),
    ".glb": lambda path: bpy.ops.import_scene.gltf(filepath=path),
    ".gltf": lambda path: bpy.ops.import_scene.gltf(filepath=path),
}
FIELD_OF_VIEW = math.radians(30.0)
MARGIN = 1.08
# Key from the side, where the terminator crosses the form, and a faint rim; radians, W/m^2.
KEY = ((math.radians(62.0), 0.0, math.radians(68.0)), 4.0)
RIM = ((math.radians(75.0), 0.0, math.radians(-150.0)), 1.2)


def import_mesh(path: Path, scale: float, subdivisions: int) -> list[bpy.types.Object]:
    """Import a mesh file into an empty scene, smooth, scaled and subdivided.

    Args:
        path: A file with one of the suffixes of MESH_IMPORTERS.
        scale: Factor on its size.
        subdivisions: Smooth subdivisions; each makes four faces of one.

    Returns:
        Its mesh objects.

    Raises:
        SceneError: The file cannot be read or holds no mesh.
    """
    importer = MESH_IMPORTERS.get(path.suffix.lower())
    if importer is None:
        raise SceneError(f"{path.name}: {path.suffix} files are not supported.")
    try:
        importer(str(path))
    except RuntimeError as error:
        raise SceneError(f"{path.name} cannot be read: {str(error).strip()}") from error
    meshes = [obj for obj in bpy.context.scene.objects if obj.type == "MESH"]
    if not any(len(obj.data.polygons) for obj in meshes):
        raise SceneError(f"{path.name} holds no mesh with faces.")
    roots = [obj for obj in bpy.context.scene.objects if obj.parent is None]
    for root in roots:
        root.scale *= scale
        root.location *= scale
    for obj in meshes:
        obj.data.shade_smooth()
        if subdivisions:
            _subdivide(obj, subdivisions)
    bpy.context.view_layer.update()
    return meshes


def _subdivide(obj: bpy.types.Object, levels: int) -> None:
    """Subdivide for good, so that curvature is stored at the vertices that are rendered."""
    modifier = obj.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = modifier.render_levels = levels
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = bpy.data.meshes.new_from_object(evaluated)
    obj.modifiers.remove(modifier)
    obj.data = mesh


def light_and_frame(meshes: list[bpy.types.Object]) -> None:
    """Give the scene a camera that shows all of the meshes from the front, and two suns."""
    scene = bpy.context.scene
    corners = [obj.matrix_world @ Vector(corner) for obj in meshes for corner in obj.bound_box]
    points = np.array(corners)
    centre = (points.min(axis=0) + points.max(axis=0)) / 2.0
    size = float(np.ptp(points, axis=0)[[0, 2]].max())
    depth = float(np.ptp(points, axis=0)[1])
    distance = MARGIN * size / 2.0 / math.tan(FIELD_OF_VIEW / 2.0) + depth / 2.0
    camera = bpy.data.cameras.new("Camera")
    camera.angle = FIELD_OF_VIEW
    camera.clip_start, camera.clip_end = distance / 1000.0, distance * 10.0
    eye = bpy.data.objects.new("Camera", camera)
    eye.location = (centre[0], centre[1] - distance, centre[2])
    eye.rotation_euler = (math.pi / 2.0, 0.0, 0.0)
    scene.collection.objects.link(eye)
    scene.camera = eye
    for name, (rotation, energy) in (("Key", KEY), ("Rim", RIM)):
        light = bpy.data.lights.new(name, "SUN")
        light.energy = energy
        sun = bpy.data.objects.new(name, light)
        sun.rotation_euler = rotation
        scene.collection.objects.link(sun)
    world = bpy.data.worlds.new("Black")
    ensure_node_tree(world).nodes["Background"].inputs["Strength"].default_value = 0.0
    scene.world = world
    scene.render.engine = EEVEE
    scene.view_settings.view_transform = "Standard"
    bpy.context.view_layer.update()
