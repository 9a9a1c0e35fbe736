# SPDX-License-Identifier: GPL-3.0-or-later
"""Cast shadows against Cycles, fingers held over a sphere and a head: docs/results/shadows.md.

    ./dev bench shadows [--dry]       about ten minutes

Reference: Cycles, Random Walk, no light between surfaces. Scatter distances are
those that Make Translucent reads from the same node; nothing is fitted.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray
from rig import Rig

from cdrf_addon import register, unregister
from cdrf_addon.compat import EEVEE, ensure_node_tree

from .common.arrays import Array
from .common.files import IMAGES, MESHES, ROOT, write_page
from .common.machine import machine
from .common.markdown import facts, generated, table
from .common.pictures import save_picture, side_by_side

PIXELS = 128
SAMPLES = 24
CYCLES_SAMPLES = 128
CASES = ("sphere 1", "head 1", "head 2")
PORTRAIT = ("head 1", 0.1)
"""The case whose pictures docs/guide/shadows.md shows by themselves."""
ALBEDO = 0.9
RADII = (1.0, 0.35, 0.2)
SCALES = (0.03, 0.1)
SUN = (0.75, -0.6, 0.45)
SECOND = (-0.7, -0.35, 0.25)
"""Directions towards the sun, and towards a second one where there are two."""


@dataclass
class Scene:
    """A shape under fingers, ready to be rendered."""

    rig: Rig
    obj: bpy.types.Object
    suns: list[bpy.types.Object]
    scatter: bpy.types.ShaderNode


def fingers(rig: Rig, towards: Vector) -> None:
    """Four cylinders side by side between the light and the shape; a hole in the picture."""
    side = towards.cross(Vector((0.0, 0.0, 1.0))).normalized()
    along = side.cross(towards).normalized()
    for number in range(4):
        place = 1.25 * towards + (0.24 * number - 0.36) * along + 0.45 * side
        bpy.ops.mesh.primitive_cylinder_add(radius=0.075, depth=0.9, location=place)
        finger = bpy.context.object
        finger.rotation_euler = side.to_track_quat("Z", "Y").to_euler()
        finger.is_holdout = True


def make(shape: str, directions: Sequence[Sequence[float]]) -> Scene:
    """Build the scene of a shape, two units large."""
    rig = Rig(2.3)
    rig.scene.render.resolution_x = rig.scene.render.resolution_y = PIXELS
    suns = []
    for number, direction in enumerate(directions):
        turn = Vector(direction).to_track_quat("Z", "Y").to_euler()
        energy = math.pi / (number + 1)
        suns.append(rig.light("SUN", energy=energy, angle=0.02, use_shadow=True, rotation=turn))
    bpy.context.view_layer.update()
    fingers(rig, Vector(directions[0]).normalized())
    if shape == "sphere":
        obj = rig.sphere()
    else:
        bpy.ops.wm.obj_import(filepath=str(MESHES / "human_head.obj"))
        obj = bpy.context.object
        obj.modifiers.new("Subdivision", "SUBSURF").levels = 2
        obj.modifiers[0].render_levels = 2
        bpy.ops.object.convert(target="MESH")
        bpy.ops.object.shade_smooth()
        size = max(obj.dimensions)
        obj.scale = [2.1 / size] * 3
        bpy.ops.object.transform_apply(location=False, rotation=True, scale=True)
        bpy.ops.object.origin_set(type="ORIGIN_GEOMETRY", center="BOUNDS")
        obj.location = (0.0, 0.0, 0.0)
    obj.data.materials.clear()
    material = bpy.data.materials.new("Subsurface")
    obj.data.materials.append(material)
    tree = ensure_node_tree(material)
    tree.nodes.clear()
    scatter = tree.nodes.new("ShaderNodeSubsurfaceScattering")
    scatter.falloff = "RANDOM_WALK"
    scatter.inputs["Color"].default_value = (ALBEDO,) * 3 + (1.0,)
    scatter.inputs["Radius"].default_value = RADII
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(scatter.outputs["BSSRDF"], output.inputs["Surface"])
    bpy.ops.object.select_all(action="DESELECT")
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    return Scene(rig, obj, suns, scatter)


def reference(scene: Scene) -> Array:
    """Path-trace the scene."""
    settings = scene.rig.scene
    settings.render.engine = "CYCLES"
    cycles = settings.cycles
    cycles.device, cycles.samples, cycles.seed = "CPU", CYCLES_SAMPLES, 1
    cycles.use_adaptive_sampling = False
    cycles.use_denoising, cycles.denoiser = True, "OPENIMAGEDENOISE"
    cycles.max_bounces = 0
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 0.01
    return scene.rig.render()


def ours(scene: Scene, shadows: str, edges: bool) -> Array:
    """Render with the CDRF, with or without shadows."""
    settings = scene.rig.scene
    settings.render.engine = EEVEE
    settings.eevee.taa_render_samples = SAMPLES
    settings.render.filter_size = 1.5  # without a film filter every sample meets the same noise
    material = scene.obj.data.materials[0]
    material.cdrf.shadow_edges = edges
    material.cdrf.shadows = shadows
    bpy.context.view_layer.update()
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    return scene.rig.render()


def error(picture: Array, wanted: Array, covered: NDArray[np.bool_]) -> str:
    """RMS over pixels of R, G and B."""
    off = (picture - wanted)[covered][:, :3]
    return ", ".join(f"{value:.3f}" for value in np.sqrt((off**2).mean(axis=0)))


def measure(cases: Sequence[str]) -> tuple[list[list[str]], dict[tuple[str, float], Array]]:
    """Measure every case; return the rows of the table and the pictures by case and scale."""
    rows, shown = [], {}
    for case in cases:
        shape, lights = case.split()
        directions = (SUN,) if lights == "1" else (SUN, SECOND)
        for scale in SCALES:
            scene = make(shape, directions)
            scene.scatter.inputs["Scale"].default_value = scale
            wanted = reference(scene)
            choices = (("OFF", False), ("ON", False), ("ON", True))
            pictures = [ours(scene, shadows, edges) for shadows, edges in choices]
            covered = (wanted[..., 3] > 0.999) & (pictures[0][..., 3] > 0.999)
            errors = [error(picture, wanted, covered) for picture in pictures]
            rows.append([shape, lights, f"{scale:g}", *errors])
            print(*rows[-1], sep=" | ", flush=True)
            shown[case, scale] = side_by_side((wanted, *pictures))
    return rows, shown


HEAD = f"""# Cast shadows against path tracing

{generated("shadows")}

RMSE against Cycles (Random Walk, albedo {ALBEDO}, radius (1, 0.35, 0.2) · scale, no light between
surfaces) over the visible surface, of red, green and blue, in units of a white surface facing the
sun. The shapes are two units large; four cylinders are held in the sun's way like the fingers of a
hand. The scatter distances are those the first press of the button reads from the node; nothing is
fitted. A second sun of half the strength comes from the other side.
"""
LEGEND = "Cycles, without shadows, with shadows, with coloured edges"


def main() -> None:
    """Measure, and write the page and its pictures."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--dry", action="store_true", help="print only, write nothing")
    chosen = parser.parse_args()
    register()
    try:
        rows, shown = measure(CASES)
    finally:
        unregister()
    if chosen.dry:
        return
    lines = [HEAD, f"Measured on: {facts(machine())}.", ""]
    head = ["shape", "lights", "scale", "without shadows", "with shadows", "with coloured edges"]
    lines += table(head, rows)
    lines += [f"![{LEGEND}](images/shadows.png)", "", f"{LEGEND}, in the order of the table."]
    write_page("shadows", "\n".join(lines) + "\n")
    save_picture(np.concatenate(list(shown.values())[::-1]), IMAGES / "shadows.png")
    save_picture(
        shown[PORTRAIT].repeat(2, axis=0).repeat(2, axis=1),
        ROOT / "docs" / "guide" / "images" / "shadow_head.png",
    )


if __name__ == "__main__":
    main()
