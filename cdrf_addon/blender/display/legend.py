# SPDX-License-Identifier: GPL-3.0-or-later
"""The curvature display with its legend: over the viewport, and as a picture."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import blf
import bpy
import imbuf
import numpy as np

from ... import ids
from ...compat import still_png
from ...core.colour_scale import HOT, SIGNED, Scale, colours, srgb, ticks
from ..pictures import opened, pixels_of, render_to, set_pixels
from ..units import metres_per_unit
from . import curvature
from .curvature import QUANTITIES, SIGNED_QUANTITIES

STEPS = 64
# Smaller pictures have no room for a legend.
LEAST_PIXELS = 96
_handlers: list[Any] = []


@dataclass(frozen=True)
class Legend:
    """What a legend shows, wherever it is drawn."""

    title: str
    scale: Scale
    """Its colours."""
    marks: list[tuple[float, str]]
    """Places from 0 to 1 along the scale, and what is written there."""


def _legend_of(scene: bpy.types.Scene) -> Legend | None:
    """Return a scene's legend; None if it shows no curvature."""
    shown = scene.get(ids.DISPLAY_KEY)
    if shown is None:
        return None
    quantity = shown["quantity"]
    scale = SIGNED if quantity in SIGNED_QUANTITIES else HOT
    marks = ticks(shown["low"], shown["high"], metres_per_unit(scene))
    return Legend(QUANTITIES[quantity][0], scale, marks)


def _draw_viewport() -> None:
    context = bpy.context
    legend = _legend_of(context.scene)
    if legend is None or not context.space_data.overlay.show_overlays:
        return
    import gpu
    from gpu_extras.batch import batch_for_shader

    factor = context.preferences.system.ui_scale
    left, bottom = 70.0 * factor, 60.0 * factor
    width, height = 16.0 * factor, min(220.0 * factor, context.region.height * 0.5)
    steps = np.linspace(0.0, 1.0, STEPS)
    points = [(x, bottom + height * y) for y in steps for x in (left, left + width)]
    shades = np.repeat(
        np.append(srgb(colours(steps, legend.scale)), np.ones((STEPS, 1)), 1), 2, axis=0
    )
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    batch_for_shader(
        shader, "TRI_STRIP", {"pos": points, "color": [tuple(c) for c in shades]}
    ).draw(shader)
    blf.size(0, 12.0 * factor)
    blf.enable(0, blf.SHADOW)
    blf.shadow(0, 3, 0.0, 0.0, 0.0, 0.9)
    blf.color(0, 1.0, 1.0, 1.0, 1.0)
    lines = [
        (left + 1.5 * width, bottom + height * place - 4.0 * factor, text)
        for place, text in legend.marks
    ]
    lines.append((left, bottom + height + 14.0 * factor, legend.title))
    for x, y, text in lines:
        blf.position(0, x, y, 0.0)
        blf.draw(0, text)
    blf.disable(0, blf.SHADOW)


def register() -> None:
    """Draw the legend in every 3D View that shows curvature."""
    if not bpy.app.background:
        _handlers.append(
            bpy.types.SpaceView3D.draw_handler_add(_draw_viewport, (), "WINDOW", "POST_PIXEL")
        )


def unregister() -> None:
    """Undo `register`."""
    while _handlers:
        bpy.types.SpaceView3D.draw_handler_remove(_handlers.pop(), "WINDOW")


def add_to_picture(scene: bpy.types.Scene, path: Path) -> None:
    """Write the legend onto a PNG; needs no window, as Blender's font library sets the text."""
    legend = _legend_of(scene)
    assert legend is not None
    with opened(path, as_data=True) as image:
        width, height = image.size
        if min(width, height) < LEAST_PIXELS:
            return
        size = max(9.0, height / 45.0)
        left, bottom = round(size), round(1.2 * size)
        tall, wide = max(2, round(min(14.0 * size, 0.6 * height))), max(2, round(size))
        pixels = pixels_of(image)
        bar = srgb(colours(np.linspace(0.0, 1.0, tall), legend.scale))
        pixels[bottom : bottom + tall, left : left + wide, :3] = bar[:, None, :]
        pixels[bottom : bottom + tall, left : left + wide, 3] = 1.0
        set_pixels(image, pixels)
        image.filepath_raw = str(path)
        image.file_format = "PNG"
        image.save()
    picture = imbuf.load(str(path))
    blf.size(0, size)
    with blf.bind_imbuf(0, picture):
        lines = [
            (left + 1.5 * wide, bottom + tall * place - 0.35 * size, text)
            for place, text in legend.marks
        ]
        lines.append((left, bottom + tall + 0.6 * size, legend.title))
        for x, y, text in lines:
            # A light text with a dark shadow is legible on any colour.
            for shift, shade in ((1.0, 0.0), (0.0, 1.0)):
                blf.color(0, shade, shade, shade, 1.0)
                blf.position(0, x + shift, y - shift, 0.0)
                blf.draw_buffer(0, text)
    imbuf.write(picture, filepath=str(path))
    picture.free()


def render_curvature(
    scene: bpy.types.Scene,
    materials: dict[bpy.types.Material, list[bpy.types.Mesh]],
    path: Path,
    quantity: str = "KAPPA",
) -> None:
    """Render the current frame's curvature with its legend to a PNG; all settings stay.

    Args:
        scene: The scene.
        materials: The translucent materials, each with the meshes that show it.
        path: The PNG.
        quantity: A key of QUANTITIES.

    Raises:
        SceneError: No picture was written.
    """
    shown = {
        material: meshes
        for material, meshes in materials.items()
        if curvature.shows_curvature(material)
    }
    before = scene.get(ids.DISPLAY_KEY)
    shown_quantity = before["quantity"] if before else quantity
    curvature.show(scene, materials, quantity)
    try:
        with still_png(scene):
            render_to(path)
        add_to_picture(scene, path)
    finally:
        curvature.hide(materials)
        if shown:
            curvature.show(scene, shown, shown_quantity)
