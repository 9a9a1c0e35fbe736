# SPDX-License-Identifier: GPL-3.0-or-later
"""Path-trace a grid of unit spheres and sum their pixels: the child process of `measure_steps`.

    blender --background --factory-startup --python worker.py -- order.json
    python worker.py order.json           (with bpy as a module)

It imports nothing of ours, so that only Blender and NumPy have to be found. The order is JSON
(see `process.write_order`); the answer is an .npz with, for every sphere of radius 1,

    cosine   (P,)       N.L of each pixel's centre, by the sphere's equation
    total    (S, P, 3)  sum over the passes of radiance / (albedo * irradiance / pi)
    square   (S, P, 3)  sum over the passes of its square

where the pixels of every direction of the light follow one another. Passes of one direction differ
by their seed alone, so their scatter is the Monte Carlo error.
"""

from __future__ import annotations

import json
import math
import os
import sys
import threading
import traceback
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

Array = NDArray[np.float64]

PROGRESS = "CDRF-PROGRESS"
"""First word of a line of progress; `process.PROGRESS` is the same."""
# Width of a sphere's cell, in radii.
PITCH = 2.1
# How far out a pixel may be, in radii: nearer to the outline Cycles loses paths whose refracted
# direction misses the facet (15 % at 0.984, 40 % at 0.996), which is no scattering.
RIM = 0.96
SUBDIVISIONS = 7


def report(part: float, text: str) -> None:
    """Report progress to the parent process: the part done, from 0 to 1, and what is being done."""
    print(PROGRESS, f"{part:.4f}", text, flush=True)


def towards_light(elevation: float) -> Array:
    """Return the direction to the sun, (3,); at elevation 0 it is +X; the camera looks along -Z."""
    return np.array([math.cos(elevation), 0.0, math.sin(elevation)])


def pixel_normals(across: int, down: int) -> tuple[NDArray[np.int64], Array]:
    """Return the pixels of a cell that see its sphere, flat indices (P,), and its normals (P, 3).

    With the light along X, all pixels of a column have the same N.L. Each stands for another
    direction from which that N.L is seen, so columns are many and rows are few.
    """
    x = PITCH * ((np.arange(across) + 0.5) / across - 0.5)
    y = PITCH * ((np.arange(down) + 0.5) / down - 0.5)
    x, y = np.meshgrid(x, y)
    inside = np.hypot(x, y) < RIM
    x, y = x[inside], y[inside]
    return np.flatnonzero(inside), np.stack((x, y, np.sqrt(1.0 - x**2 - y**2)), axis=1)


def new_node_tree(owner: Any) -> Any:
    """Return an empty node tree of a material or world; 4.5 makes it only on request."""
    if owner.node_tree is None:
        owner.use_nodes = True
    owner.node_tree.nodes.clear()
    return owner.node_tree


def make_material(order: dict[str, Any]) -> bpy.types.Material:
    """Make the material that all spheres share; its scale is the alpha of the object's colour."""
    material = bpy.data.materials.new("Sphere")
    tree = new_node_tree(material)
    scatter = tree.nodes.new("ShaderNodeSubsurfaceScattering")
    scatter.falloff = order["method"]
    scatter.inputs["Color"].default_value = (*order["albedo"], 1.0)
    scatter.inputs["Radius"].default_value = order["radius"]
    scale = tree.nodes.new("ShaderNodeObjectInfo")
    tree.links.new(scale.outputs["Alpha"], scatter.inputs["Scale"])
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(scatter.outputs["BSSRDF"], output.inputs["Surface"])
    return material


def make_spheres(order: dict[str, Any], columns: int, rows: int) -> None:
    """Put unit spheres that share one mesh in a grid, row after row from the bottom."""
    bpy.ops.mesh.primitive_ico_sphere_add(radius=1.0, subdivisions=SUBDIVISIONS)
    first = bpy.context.object
    first.data.shade_smooth()
    first.data.materials.append(make_material(order))
    for number, scale in enumerate(order["scales"]):
        obj = first.copy() if number else first
        if number:
            bpy.context.scene.collection.objects.link(obj)
        row, column = divmod(number, columns)
        obj.location = (PITCH * (column - (columns - 1) / 2), PITCH * (row - (rows - 1) / 2), 0.0)
        obj.color = (1.0, 1.0, 1.0, scale)


def make_scene(order: dict[str, Any]) -> bpy.types.Object:
    """Build the scene; return the sun."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    columns = math.ceil(math.sqrt(len(order["scales"])))
    rows = math.ceil(len(order["scales"]) / columns)
    scene.world = bpy.data.worlds.new("Black")
    new_node_tree(scene.world)
    make_spheres(order, columns, rows)
    camera = bpy.data.cameras.new("Camera")
    camera.type = "ORTHO"
    camera.sensor_fit = "HORIZONTAL"
    camera.ortho_scale = PITCH * columns
    scene.camera = bpy.data.objects.new("Camera", camera)
    scene.camera.location = (0.0, 0.0, 10.0)
    scene.collection.objects.link(scene.camera)
    sun = bpy.data.lights.new("Sun", "SUN")
    sun.energy, sun.angle = math.pi, 0.0
    # A convex body casts no shadow on itself: its terminator is where N.L is 0.
    sun.use_shadow = False
    lamp = bpy.data.objects.new("Sun", sun)
    lamp.rotation_mode = "QUATERNION"
    scene.collection.objects.link(lamp)
    set_render(scene, order, columns, rows)
    return lamp


def set_render(scene: bpy.types.Scene, order: dict[str, Any], columns: int, rows: int) -> None:
    """Make each pixel the radiance through its centre, unfiltered, linear and independent."""
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    across, down = order["pixels"]
    render.resolution_x, render.resolution_y = columns * across, rows * down
    render.pixel_aspect_x, render.pixel_aspect_y = 1.0, across / down
    render.resolution_percentage = 100
    render.use_persistent_data = True
    render.film_transparent = True
    settings = render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    scene.view_settings.view_transform = "Raw"
    scene.display_settings.display_device = "sRGB"
    cycles.device = "CPU"
    cycles.samples = order["samples"]
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    # Neighbouring pixels must be independent: their scatter is the standard error of their mean.
    cycles.sampling_pattern = "TABULATED_SOBOL"
    cycles.pixel_filter_type = "BOX"
    cycles.filter_width = 0.01
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.light_sampling_threshold = 0.0
    # No light from surface to surface: only the random walk below it counts.
    cycles.max_bounces = 0


def read_pixels(path: Path) -> Array:
    """Read a picture, (height, width, 3), row 0 at the bottom.

    Raises:
        OSError: The file is not whole.
    """
    image = bpy.data.images.load(str(path))
    width, height = image.size
    if not width * height:
        raise OSError("a picture could not be read back; is the disk full?")
    pixels = np.empty(width * height * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)[..., :3].astype(np.float64)


def cells(picture: Array, count: int, across: int, down: int) -> Array:
    """Cut a picture into its first `count` spheres, (S, down * across, 3)."""
    rows, columns = picture.shape[0] // down, picture.shape[1] // across
    grid = picture.reshape(rows, down, columns, across, 3).swapaxes(1, 2)
    return grid.reshape(rows * columns, down * across, 3)[:count]


def work(order: dict[str, Any]) -> None:
    """Render all passes of an order and write the sums."""
    report(0.0, "Preparing the spheres")
    lamp = make_scene(order)
    scene, (across, down), count = bpy.context.scene, order["pixels"], len(order["scales"])
    seen, normals = pixel_normals(across, down)
    albedo = np.array(order["albedo"], dtype=np.float64)
    elevations, passes = order["elevations"], order["passes"]
    total = np.zeros((len(elevations), count, len(seen), 3))
    square = np.zeros_like(total)
    target = Path(order["answer"])
    frame = target.with_name("pass.exr")
    scene.render.filepath = str(frame)
    renders = len(elevations) * passes
    for number in range(renders):
        report(number / renders, f"Path tracing {count} spheres, pass {number + 1} of {renders}")
        view = number // passes
        direction = Vector(towards_light(elevations[view]))
        lamp.rotation_quaternion = direction.to_track_quat("Z", "Y")
        scene.cycles.seed = (order["seed"] * 1009 + number) % (2**31 - 1)
        bpy.ops.render.render(write_still=True)
        value = cells(read_pixels(frame), count, across, down)[:, seen] / albedo
        total[view] += value
        square[view] += value**2
    np.savez(
        target,
        cosine=np.concatenate([normals @ towards_light(angle) for angle in elevations]),
        total=np.concatenate(total, axis=1),
        square=np.concatenate(square, axis=1),
        blender=np.array(bpy.app.version_string),
    )
    report(1.0, "Path tracing done")


def end_with_parent() -> None:
    """Exit at the end of the parent's pipe, which comes when the parent ends, however it ends."""
    if sys.stdin is not None and not sys.stdin.isatty():
        sys.stdin.read()
        os._exit(1)


def main() -> int:
    """Carry out the order; return the exit code."""
    threading.Thread(target=end_with_parent, daemon=True).start()
    try:
        work(json.loads(Path(sys.argv[-1]).read_text(encoding="utf-8")))
    except Exception:  # noqa: BLE001  (the parent reads the text, whatever it is)
        traceback.print_exc()
        return 1
    return 0


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    sys.stderr.flush()
    # Blender 4.5 as a module now and then hangs in its libraries' destructors.
    os._exit(code)
