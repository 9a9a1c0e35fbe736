# SPDX-License-Identifier: GPL-3.0-or-later
"""The look-up tables as images, one for each model in use: float, Non-Color, packed.

A model's key finds its table again; sigma0 is no part of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ... import ids
from ...core.errors import SceneError
from ...core.reflectance.environment import bands_of_table
from ...core.reflectance.lut import DEFAULT_LAYOUT, build_lut
from ...core.reflectance.model import RING, SPHERE, Model, name_of, ring, sphere

LUT_VERSION = 5


@dataclass(frozen=True)
class Table:
    """A model's look-up table and what the shader needs of the model."""

    image: bpy.types.Image
    key: str
    """Model.key."""
    colour: bool
    """Model.colour."""
    moments: tuple[float, float, float]
    """Model.moments."""
    gain: float
    """Model.gain."""


def find_table(key: str) -> Table | None:
    """Return the table of the model with that key, or None if this file has none."""
    for image in bpy.data.images:
        if (
            image.library is None
            and image.get(ids.ROLE_KEY) == ids.ROLE_LUT
            and image.get(ids.VERSION_KEY) == LUT_VERSION
            and image.get(ids.MODEL_KEY) == key
        ):
            red, green, blue = image[ids.MOMENTS_KEY]
            return Table(
                image, key, bool(image[ids.COLOUR_KEY]), (red, green, blue), image[ids.GAIN_KEY]
            )
    return None


def adopt_table(key: str) -> None:
    """Copy a linked file's table of that key into this file, unless the file has its own."""
    if find_table(key) is not None:
        return
    for image in list(bpy.data.images):
        if image.get(ids.ROLE_KEY) == ids.ROLE_LUT and image.get(ids.MODEL_KEY) == key:
            image.copy()
            return


def table_of(key: str) -> Table:
    """Return the table with that key; that of the ring or sphere model is made where missing.

    Raises:
        SceneError: The table of a profile or a measurement was deleted; the text names a remedy.
    """
    found = find_table(key)
    if found is not None:
        return found
    if key not in {RING, SPHERE}:
        raise SceneError(
            f"The reflectance table '{key}' is no longer in this file: choose the material's model "
            "again (CDRF panel > Model)."
        )
    return ensure_table(ring() if key == RING else sphere())


def ensure_table(model: Model) -> Table:
    """Return a model's packed table, built once per file."""
    found = find_table(model.key)
    if found is not None:
        return found
    values = build_lut(model)
    image = packed_image(
        f"{ids.LUT_IMAGE} {name_of(model.key)}", values if model.colour else values[..., None]
    )
    image[ids.ROLE_KEY] = ids.ROLE_LUT
    image[ids.VERSION_KEY] = LUT_VERSION
    image[ids.MODEL_KEY] = model.key
    image[ids.COLOUR_KEY] = model.colour
    image[ids.MOMENTS_KEY] = model.moments
    image[ids.GAIN_KEY] = model.gain
    return Table(image, model.key, model.colour, model.moments, model.gain)


def bands_image(table: Table) -> bpy.types.Image:
    """Return the packed table of a model's band factors, made once from its look-up table."""
    role = f"{ids.ROLE_BANDS} {table.key}"
    for image in bpy.data.images:
        if image.library is None and image.get(ids.ROLE_KEY) == role:
            return image
    width, height = table.image.size
    flat = np.empty(width * height * 4, dtype=np.float32)
    table.image.pixels.foreach_get(flat)
    values = flat.reshape(height, width, 4)[..., :3].astype(np.float64)
    bands = bands_of_table(values, DEFAULT_LAYOUT)
    image = packed_image(f"{ids.BANDS_IMAGE} {name_of(table.key)}", bands)
    image[ids.ROLE_KEY] = role
    # Kept in the file even where nothing uses it: that of a measured table cannot be made again.
    table.image.use_fake_user = True
    return image


def packed_image(name: str, values: NDArray[np.floating]) -> bpy.types.Image:
    """Make a packed float image of numbers, shape (height, width, 3) or (height, width, 1)."""
    height, width = values.shape[:2]
    image = bpy.data.images.new(name, width, height, float_buffer=True, is_data=True)
    # Half precision would cost a factor of four in accuracy (decision 002).
    image.use_half_precision = False
    image.alpha_mode = "CHANNEL_PACKED"
    pixels = np.ones((height, width, 4), dtype=np.float32)
    pixels[..., :3] = values
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()
    return image
