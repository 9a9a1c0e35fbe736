# SPDX-License-Identifier: GPL-3.0-or-later
"""The look-up table as an image: float, Non-Color, packed into the .blend."""

from __future__ import annotations

import bpy
import numpy as np

from .. import ids
from ..core.lut import DEFAULT_LAYOUT, build_lut

LUT_VERSION = 1


def ensure_lut_image() -> bpy.types.Image:
    """Return the packed table, built once per file; sigma0 is no part of it."""
    for image in bpy.data.images:
        if (
            image.library is None
            and image.get(ids.ROLE_KEY) == ids.ROLE_LUT
            and image.get(ids.VERSION_KEY) == LUT_VERSION
        ):
            return image
    layout = DEFAULT_LAYOUT
    image = bpy.data.images.new(
        ids.LUT_IMAGE, layout.width, layout.height, float_buffer=True, is_data=True
    )
    # Half precision would cost a factor of four in accuracy (docs/decisions/002-lut-mapping.md).
    image.use_half_precision = False
    image.alpha_mode = "CHANNEL_PACKED"
    pixels = np.ones((layout.height, layout.width, 4), dtype=np.float32)
    pixels[..., :3] = build_lut(layout)[..., None]
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()
    image[ids.ROLE_KEY] = ids.ROLE_LUT
    image[ids.VERSION_KEY] = LUT_VERSION
    return image
