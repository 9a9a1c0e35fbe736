# SPDX-License-Identifier: GPL-3.0-or-later
"""Images made of arrays, and pictures written as small PNGs; rows are from the bottom up."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from .arrays import Array


def image_of(name: str, pixels: NDArray[np.floating], *, data: bool = False) -> bpy.types.Image:
    """Make a float image of (height, width, 4) pixels; `data` is not colour-managed."""
    height, width, _ = pixels.shape
    image = bpy.data.images.new(name, width, height, float_buffer=True, is_data=data)
    image.pixels.foreach_set(pixels.astype(np.float32).ravel())
    return image


def lightened(picture: Array) -> Array:
    """Raise linear radiance to the power of 1 / 2.2, for the eye, (height, width, 3)."""
    return np.asarray(np.clip(picture[..., :3], 0.0, 1.0) ** (1.0 / 2.2))


def side_by_side(pictures: Sequence[Array]) -> Array:
    """Join pictures in a row, lightened for the eye."""
    return np.concatenate([lightened(picture) for picture in pictures], axis=1)


def save_picture(picture: Array, path: Path) -> None:
    """Write display values, (height, width, 3), as a small PNG."""
    height, width, _ = picture.shape
    image = bpy.data.images.new("Picture", width, height)
    image.pixels.foreach_set(np.dstack((picture, np.ones((height, width)))).astype("f4").ravel())
    scene = bpy.context.scene
    scene.view_settings.view_transform = "Standard"  # as it is: the picture's values are sRGB
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "PNG", "RGB", "8"
    settings.compression = 100
    image.save_render(str(path), scene=scene)
    bpy.data.images.remove(image)
