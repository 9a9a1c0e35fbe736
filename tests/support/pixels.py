# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the pixels of images; rows are from the bottom up."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray


def pixels_of(image: bpy.types.Image) -> NDArray[np.float64]:
    """Return the pixels of an image, (height, width, 4)."""
    width, height = image.size
    pixels = np.empty(4 * width * height, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(height, width, 4).astype(np.float64)


def read_pixels(path: Path) -> NDArray[np.float64]:
    """Return the pixels of a picture's file, (height, width, 4)."""
    image = bpy.data.images.load(str(path))
    try:
        return pixels_of(image)
    finally:
        bpy.data.images.remove(image)
