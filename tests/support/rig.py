# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene in which nothing blurs a measurement, and exact read-back of its pixels."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray
from pixels import read_pixels

from cdrf_addon import compat, ids

RESOLUTION = 96
SPLIT = 256.0
"""A value is emitted as floor and fraction of SPLIT times itself: the film is half float."""


class Rig:
    """An orthographic camera on the -Y side, black world, one sample, Raw 32-bit EXR."""

    def __init__(self, ortho_scale: float = 2.1) -> None:
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        self.scene = bpy.context.scene
        world = bpy.data.worlds.new("Black")
        background = compat.ensure_node_tree(world).nodes["Background"]
        background.inputs["Strength"].default_value = 0.0
        self.scene.world = world
        camera = bpy.data.cameras.new("Camera")
        camera.type = "ORTHO"
        camera.ortho_scale = ortho_scale
        self.camera = self.link(camera, (0.0, -10.0, 0.0), (np.pi / 2, 0.0, 0.0))
        self.scene.camera = self.camera
        render = self.scene.render
        render.engine = compat.EEVEE
        render.resolution_x = render.resolution_y = RESOLUTION
        render.film_transparent = True
        render.filter_size = 0.0
        render.use_high_quality_normals = True
        render.image_settings.file_format = "OPEN_EXR"
        render.image_settings.color_depth = "32"
        self.scene.view_settings.view_transform = "Raw"
        self.scene.eevee.taa_render_samples = 1

    def link(
        self,
        data: bpy.types.ID | None,
        location: tuple[float, float, float] = (0.0, 0.0, 0.0),
        rotation: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> bpy.types.Object:
        """Add an object to the scene."""
        obj = bpy.data.objects.new(data.name if data else "Empty", data)
        obj.location, obj.rotation_euler = location, rotation
        self.scene.collection.objects.link(obj)
        return obj

    def light(self, kind: str, *, name: str = "", **settings: Any) -> bpy.types.Object:
        """Add a light; `location` and `rotation` place it, the rest is set on the light."""
        place = {key: settings.pop(key) for key in ("location", "rotation") if key in settings}
        light = bpy.data.lights.new(name or kind.title(), kind)
        light.use_shadow = False
        for key, value in settings.items():
            setattr(light, key, value)
        return self.link(light, **place)

    def sphere(self, radius: float = 1.0, subdivisions: int = 5) -> bpy.types.Object:
        """Add a smooth icosphere and select it alone."""
        bpy.ops.mesh.primitive_ico_sphere_add(radius=radius, subdivisions=subdivisions)
        bpy.ops.object.shade_smooth()
        return bpy.context.object

    def render(self) -> NDArray[np.float64]:
        """Render the frame as it is; (height, width, 4), row 0 at the bottom."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "frame.exr"
            self.scene.render.filepath = str(path)
            bpy.ops.render.render(write_still=True)
            return read_pixels(path)

    def render_exact(
        self, obj: bpy.types.Object, socket: str, low: float, high: float
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Render a colour or vector to about 1e-6 of its range, past the half-float film.

        Args:
            obj: The object whose first material is replaced meanwhile.
            socket: "Normal", "Position" (of the geometry) or "Shader" (of its material).
            low: Lower end of the values.
            high: Upper end of the values.

        Returns:
            (height, width, 3) values, and the pixels the object covers wholly.
        """
        kept = obj.data.materials[0] if obj.data.materials else None
        parts = []
        for operation in ("FLOOR", "FRACTION"):
            material = (
                kept.copy() if kept and socket == "Shader" else bpy.data.materials.new("Probe")
            )
            tree = compat.ensure_node_tree(material)
            source = _source(tree, socket)
            scale = SPLIT / (high - low)
            shifted = tree.nodes.new("ShaderNodeVectorMath")
            shifted.operation = "MULTIPLY_ADD"
            tree.links.new(source, shifted.inputs[0])
            shifted.inputs[1].default_value = (scale,) * 3
            shifted.inputs[2].default_value = (-low * scale,) * 3
            part = tree.nodes.new("ShaderNodeVectorMath")
            part.operation = operation
            tree.links.new(shifted.outputs["Vector"], part.inputs[0])
            emission = tree.nodes.new("ShaderNodeEmission")
            tree.links.new(part.outputs["Vector"], emission.inputs["Color"])
            for output in [n for n in tree.nodes if n.type == "OUTPUT_MATERIAL"]:
                tree.nodes.remove(output)
            output = tree.nodes.new("ShaderNodeOutputMaterial")
            tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])
            if obj.data.materials:
                obj.data.materials[0] = material
            else:
                obj.data.materials.append(material)
            parts.append(self.render())
            obj.data.materials[0] = kept
            bpy.data.materials.remove(material)
        if kept is None:
            obj.data.materials.clear()
        covered = parts[0][..., 3] > 0.999
        return (parts[0] + parts[1])[..., :3] / SPLIT * (high - low) + low, covered

    def normals(self, obj: bpy.types.Object) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Normals the shader sees, unit length, and the pixels the object covers."""
        # A little beyond 1, so that rounding never reaches the next integer of the floor.
        normals, covered = self.render_exact(obj, "Normal", -1.01, 1.01)
        length = np.linalg.norm(normals, axis=-1, keepdims=True)
        return normals / np.where(length > 0.0, length, 1.0), covered


def _source(tree: bpy.types.ShaderNodeTree, socket: str) -> bpy.types.NodeSocket:
    if socket != "Shader":
        return tree.nodes.new("ShaderNodeNewGeometry").outputs[socket]
    output = tree.get_output_node("EEVEE")
    shader = output.inputs["Surface"].links[0].from_socket
    colour = tree.nodes.new("ShaderNodeShaderToRGB")
    tree.links.new(shader, colour.inputs["Shader"])
    return colour.outputs["Color"]


def diffuse_material(colour: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> bpy.types.Material:
    """Make a material of Blender's own Diffuse BSDF."""
    material = bpy.data.materials.new("Diffuse")
    tree = compat.ensure_node_tree(material)
    tree.nodes.clear()
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (*colour, 1.0)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(diffuse.outputs["BSDF"], output.inputs["Surface"])
    return material


def cdrf_node(obj: bpy.types.Object) -> bpy.types.ShaderNode:
    """The CDRF node of an object's first material."""
    return obj.data.materials[0].node_tree.nodes[ids.NODE]
