# SPDX-License-Identifier: GPL-3.0-or-later
"""A stage for bare mesh files: import, camera, light, and pictures side by side."""

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
    meshes = [item for item in bpy.context.scene.objects if item.type == "MESH"]
    if not any(len(item.data.polygons) for item in meshes):
        raise SceneError(f"{path.name} holds no mesh with faces.")
    roots = [item for item in bpy.context.scene.objects if item.parent is None]
    for root in roots:
        root.scale *= scale
        root.location *= scale
    for item in meshes:
        item.data.shade_smooth()
        if subdivisions:
            _subdivide(item, subdivisions)
    bpy.context.view_layer.update()
    return meshes


def _subdivide(item: bpy.types.Object, levels: int) -> None:
    """Subdivide for good, so that curvature is stored at the vertices that are rendered."""
    modifier = item.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = modifier.render_levels = levels
    evaluated = item.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = bpy.data.meshes.new_from_object(evaluated)
    item.modifiers.remove(modifier)
    item.data = mesh


def light_and_frame(meshes: list[bpy.types.Object]) -> None:
    """Give the scene a camera that sees all of the meshes from the front, and two suns."""
    scene = bpy.context.scene
    corners = [item.matrix_world @ Vector(corner) for item in meshes for corner in item.bound_box]
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


def render_to(path: Path) -> None:
    """Render the current frame to a file that appears only when it is complete."""
    render = bpy.context.scene.render
    part = path.with_name(f".part-{path.name}")
    kept, overwrite = render.filepath, render.use_overwrite
    render.filepath, render.use_overwrite = str(part), True
    try:
        bpy.ops.render.render(write_still=True)
    finally:
        render.filepath, render.use_overwrite = kept, overwrite
    if not part.exists():
        raise SceneError(f"No picture was written for {path.name}; is the output folder writable?")
    part.replace(path)


def side_by_side(left: Path, right: Path, target: Path) -> None:
    """Join two pictures of one size, left and right; the sources stay."""
    halves = []
    for path in (left, right):
        image = bpy.data.images.load(str(path))
        image.colorspace_settings.name = "Non-Color"
        pixels = np.empty(len(image.pixels), dtype=np.float32)
        image.pixels.foreach_get(pixels)
        halves.append(pixels.reshape(image.size[1], image.size[0], 4))
        bpy.data.images.remove(image)
    joined = np.hstack(halves)
    height, width = joined.shape[:2]
    floating = target.suffix.lower() == ".exr"
    image = bpy.data.images.new("Side by side", width, height, float_buffer=floating, is_data=True)
    image.pixels.foreach_set(np.ascontiguousarray(joined).ravel())
    part = target.with_name(f".part-{target.name}")
    image.file_format = "OPEN_EXR" if floating else "PNG"
    image.filepath_raw = str(part)
    image.save()
    bpy.data.images.remove(image)
    part.replace(target)
