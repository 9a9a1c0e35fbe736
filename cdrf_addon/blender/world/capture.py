# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders a world alone, all around, and projects it on harmonics.

Cycles renders it: every supported Blender has its panoramic camera, and it needs no graphics card.
256 by 128 pixels take a second or two. A copy is rendered, changed to send what EEVEE takes of it:

* pictures are averaged first, as samples would miss the sun of an HDRI or hit it by chance;
* Light Path nodes answer as for diffuse rays, whatever the world shows to the camera;
* a Sky Texture has no sun disc, as in EEVEE.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np

from ...compat import set_equirectangular, set_still_format
from ...core.errors import SceneError
from ...core.reflectance.environment import Environment, project, reduce_picture
from ..pictures import pixels_of, read_picture

WIDTH, HEIGHT = 256, 128
SAMPLES = 8
# Pictures wider than this are averaged down to it.
PICTURE_WIDTH = 512
DIFFUSE_RAY = "Is Diffuse Ray"


def capture(world: bpy.types.World, background: str, mapping: str = "") -> Environment:
    """Render a world and project it on harmonics.

    Args:
        world: The world; it is not changed.
        background: Name of the Background node whose strength is a factor of its own, or "".
        mapping: Name of the Mapping node whose rotation is left to the shader, or "".

    Raises:
        SceneError: Cycles is switched off, or another render is running.
    """
    with _copy(world) as copy:
        strength = 1.0
        if background:
            socket = copy.node_tree.nodes[background].inputs["Strength"]
            strength, socket.default_value = socket.default_value, 1.0
        if mapping:
            copy.node_tree.nodes[mapping].inputs["Rotation"].default_value = (0.0, 0.0, 0.0)
        with _stage(copy) as scene:
            picture = _render(scene)
    # The threshold applies to the world with its present strength.
    threshold = world.sun_threshold / (strength if strength > 0.0 else 1.0)
    return project(picture, sun_threshold=threshold)


@contextmanager
def _copy(world: bpy.types.World) -> Iterator[bpy.types.World]:
    """Yield a copy of a world with its groups and pictures, prepared; remove it afterwards."""
    made: list[tuple[bpy.types.bpy_prop_collection, bpy.types.ID]] = []
    copy = world.copy()
    copy.animation_data_clear()
    try:
        if copy.node_tree is not None:
            if copy.node_tree.animation_data is not None:
                _freeze(copy.node_tree)
            _prepare(copy.node_tree, made)
        yield copy
    finally:
        bpy.data.worlds.remove(copy)
        for owner, data in made:
            owner.remove(data)


def _freeze(tree: bpy.types.ShaderNodeTree) -> None:
    """Keep the values of this frame and drop their animation."""
    tree.animation_data_clear()


def _prepare(
    tree: bpy.types.ShaderNodeTree,
    made: list[tuple[bpy.types.bpy_prop_collection, bpy.types.ID]],
) -> None:
    """Change a copied tree to send what EEVEE takes of it.

    Args:
        tree: Of a copied world, or a copied group in it.
        made: Takes what is created, and the collection to remove it from.
    """
    for node in list(tree.nodes):
        if node.type == "GROUP" and node.node_tree is not None:
            node.node_tree = node.node_tree.copy()
            made.append((bpy.data.node_groups, node.node_tree))
            _prepare(node.node_tree, made)
        elif node.type == "LIGHT_PATH":
            _as_diffuse(tree, node)
        elif node.type == "TEX_SKY" and hasattr(node, "sun_disc"):
            node.sun_disc = False
        elif node.type == "OUTPUT_WORLD":
            for link in list(node.inputs["Volume"].links):
                tree.links.remove(link)
        elif node.type == "TEX_ENVIRONMENT" and node.projection == "EQUIRECTANGULAR":
            reduced = _reduced(node.image)
            if reduced is not None:
                node.image = reduced
                made.append((bpy.data.images, reduced))


def _as_diffuse(tree: bpy.types.ShaderNodeTree, node: bpy.types.ShaderNode) -> None:
    """Replace the outputs of a Light Path node by constants: a diffuse ray."""
    for output in node.outputs:
        value = float(output.name == DIFFUSE_RAY)
        for link in list(output.links):
            constant = tree.nodes.new("ShaderNodeValue")
            constant.outputs[0].default_value = value
            tree.links.new(constant.outputs[0], link.to_socket)


def _reduced(image: bpy.types.Image | None) -> bpy.types.Image | None:
    """Return a picture averaged to PICTURE_WIDTH; None if it is small enough or cannot be read."""
    if image is None or image.source not in {"FILE", "GENERATED"}:
        return None
    width, height = image.size
    space = image.colorspace_settings.name
    if width <= PICTURE_WIDTH or height < 2 or image.channels < 3:
        return None
    if not image.is_float and space != "sRGB":
        return None
    pixels = np.nan_to_num(pixels_of(image)[..., :3], posinf=65504.0)
    if not image.is_float:
        pixels = np.where(pixels <= 0.04045, pixels / 12.92, ((pixels + 0.055) / 1.055) ** 2.4)
    rows = min(height, PICTURE_WIDTH // 2)
    small = np.ones((rows, PICTURE_WIDTH, 4), dtype=np.float32)
    small[..., :3] = reduce_picture(pixels, rows, PICTURE_WIDTH)
    reduced = bpy.data.images.new(
        f"{image.name} averaged", PICTURE_WIDTH, rows, float_buffer=True, is_data=False
    )
    if image.is_float:
        reduced.colorspace_settings.name = space
    reduced.pixels.foreach_set(small.ravel())
    reduced.update()
    return reduced


@contextmanager
def _stage(world: bpy.types.World) -> Iterator[bpy.types.Scene]:
    """Yield a scene with nothing but a world and a camera that sees all of it."""
    scene = bpy.data.scenes.new("CDRF World")
    camera = bpy.data.cameras.new("CDRF World")
    eye = bpy.data.objects.new("CDRF World", camera)
    try:
        try:
            scene.render.engine = "CYCLES"
        except TypeError as error:
            raise SceneError(
                "The world's light could not be read, as Cycles is switched off: enable Cycles "
                "Render Engine (Edit > Preferences > Add-ons), then Update."
            ) from error
        set_equirectangular(camera)
        eye.rotation_euler = (math.pi / 2.0, 0.0, 0.0)
        scene.collection.objects.link(eye)
        scene.world, scene.camera = world, eye
        _set_up(scene)
        yield scene
    finally:
        bpy.data.objects.remove(eye)
        bpy.data.cameras.remove(camera)
        bpy.data.scenes.remove(scene)


def _set_up(scene: bpy.types.Scene) -> None:
    render, cycles = scene.render, scene.cycles
    cycles.device = "CPU"
    cycles.samples = SAMPLES
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = 0.0
    cycles.pixel_filter_type = "BOX"
    cycles.film_exposure = 1.0
    render.resolution_x, render.resolution_y, render.resolution_percentage = WIDTH, HEIGHT, 100
    render.film_transparent = render.use_compositing = render.use_sequencer = False
    set_still_format(render.image_settings, "OPEN_EXR")
    render.image_settings.color_mode = "RGB"
    render.image_settings.color_depth = "32"


def _render(scene: bpy.types.Scene) -> np.ndarray:
    """Render to a file, so that the artist's last render result stays; (height, width, 3)."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "world.exr"
        scene.render.filepath = str(path)
        try:
            bpy.ops.render.render(write_still=True, scene=scene.name)
        except RuntimeError as error:
            raise SceneError(
                f"The world's light could not be rendered ({str(error).strip()}): wait for other "
                "renders to end, then Update."
            ) from error
        if not path.exists():
            raise SceneError("The world's light could not be rendered: Update to try again.")
        return read_picture(path)[..., :3].astype(np.float64)
