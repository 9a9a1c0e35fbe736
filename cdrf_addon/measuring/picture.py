# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of a fit: a PNG beside the .blend, an image packed in it, and on the screen."""

from __future__ import annotations

from pathlib import Path

import bpy

from .. import ids
from ..core.measured.material_fit import MaterialFit
from ..core.measured.model import MeasuredModel
from .figure import draw_fit
from .plot import open_in_blender


def picture_path(material: bpy.types.Material, folder: Path) -> Path:
    """Return a material's PNG: beside the .blend, or in a folder while that is not saved."""
    name = f"cdrf_fit_{bpy.path.clean_name(material.name)}.png"
    return Path(bpy.path.abspath("//")) / name if bpy.data.is_saved else folder / name


def make_picture(model: MeasuredModel, fit: MaterialFit, scale: float, path: Path) -> None:
    """Draw a fit, write the PNG and load it into the file.

    Args:
        model: The measured model.
        fit: Fits to the same measurement.
        scale: Of the sphere to show; see `draw_fit`.
        path: The PNG.

    Raises:
        OSError: The file cannot be written.
    """
    draw_fit(model, fit, path, scale)
    open_in_blender(path, ids.FIT_IMAGE)


def show_picture(context: bpy.types.Context) -> None:
    """Show the picture in an open image editor, else in a new window."""
    image = bpy.data.images.get(ids.FIT_IMAGE)
    if image is None or context.window is None or bpy.app.background:
        return
    areas = [area for window in context.window_manager.windows for area in window.screen.areas]
    area = next((area for area in areas if area.type == "IMAGE_EDITOR"), None)
    if area is None:
        before = set(context.window_manager.windows)
        bpy.ops.wm.window_new()
        opened = [window for window in context.window_manager.windows if window not in before]
        if not opened:
            return
        area = opened[0].screen.areas[0]
        area.type = "IMAGE_EDITOR"
    area.spaces.active.image = image
    region = next(region for region in area.regions if region.type == "WINDOW")
    window = next(w for w in context.window_manager.windows if area in w.screen.areas[:])
    with context.temp_override(window=window, area=area, region=region):
        bpy.ops.image.view_all(fit_view=True)
