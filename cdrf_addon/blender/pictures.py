# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures: render one to a file, read and write pixels, join two.

Pixels are float32 arrays (height, width, channels), row 0 at the bottom, as Blender stores them:
8-bit pictures are display-referred, float ones linear.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from ..core.errors import SceneError

if TYPE_CHECKING:
    from numpy.typing import NDArray


def render_to(path: Path) -> None:
    """Render the current frame to a file that appears only when it is complete.

    Raises:
        SceneError: No picture was written.
    """
    render = bpy.context.scene.render
    part = _part_of(path)
    former_path, former_overwrite = render.filepath, render.use_overwrite
    render.filepath, render.use_overwrite = str(part), True
    try:
        bpy.ops.render.render(write_still=True)
    finally:
        render.filepath, render.use_overwrite = former_path, former_overwrite
    if not part.exists():
        raise SceneError(f"No picture was written for {path.name}; is the output folder writable?")
    part.replace(path)


def _part_of(path: Path) -> Path:
    """Return where a file is written until it is complete."""
    return path.with_name(f".part-{path.name}")


def pixels_of(image: bpy.types.Image) -> NDArray[np.float32]:
    """Read an image's pixels, (height, width, channels)."""
    width, height = image.size
    flat = np.empty(width * height * image.channels, dtype=np.float32)
    image.pixels.foreach_get(flat)
    return flat.reshape(height, width, image.channels)


def set_pixels(image: bpy.types.Image, pixels: NDArray[np.float32]) -> None:
    """Write an image's pixels, (height, width, channels)."""
    image.pixels.foreach_set(np.ascontiguousarray(pixels, dtype=np.float32).ravel())


@contextmanager
def opened(path: Path, *, as_data: bool = False) -> Iterator[bpy.types.Image]:
    """Load a picture as an image of the file; it is gone after the `with` block.

    Args:
        path: The picture.
        as_data: Take the numbers as they are stored, whatever colours they stand for.
    """
    image = bpy.data.images.load(str(path))
    try:
        if as_data:
            image.colorspace_settings.name = "Non-Color"
        yield image
    finally:
        bpy.data.images.remove(image)


def read_picture(path: Path, *, as_data: bool = False) -> NDArray[np.float32]:
    """Read the pixels of a file, (height, width, channels); see `opened`."""
    with opened(path, as_data=as_data) as image:
        return pixels_of(image)


def linear_from_srgb(values: NDArray[Any]) -> NDArray[Any]:
    """Decode display-referred values to linear ones (IEC 61966-2-1); any shape."""
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def side_by_side(left: Path, right: Path, target: Path) -> None:
    """Join two pictures of one size, left and right; the sources stay.

    Args:
        left: The one picture.
        right: The other.
        target: A .exr is written in float, all else as an 8-bit PNG.
    """
    joined = np.hstack([read_picture(path, as_data=True) for path in (left, right)])
    height, width = joined.shape[:2]
    floating = target.suffix.lower() == ".exr"
    image = bpy.data.images.new("Side by side", width, height, float_buffer=floating, is_data=True)
    set_pixels(image, joined)
    part = _part_of(target)
    image.file_format = "OPEN_EXR" if floating else "PNG"
    image.filepath_raw = str(part)
    image.save()
    bpy.data.images.remove(image)
    part.replace(target)
