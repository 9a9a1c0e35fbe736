# SPDX-License-Identifier: GPL-3.0-or-later
"""Diagrams: axes, curves and text, written as PNG with Blender's own font and image modules."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import blf
import bpy
import imbuf
import numpy as np
from numpy.typing import NDArray

from .raster import Colour, Raster

Array = NDArray[np.float64]

INK: Colour = (0.13, 0.13, 0.15)
FAINT: Colour = (0.87, 0.87, 0.89)
FRAME: Colour = (0.45, 0.45, 0.48)
# How far below a line's middle the baseline of centred text lies, in sizes.
BASELINE = 0.36


@dataclass(frozen=True)
class Text:
    """A line of text.

    Attributes:
        x: Pixels from the left.
        y: Of the baseline, pixels from the bottom.
        text: The line.
        size: Pixels.
        anchor: Part of its width that lies left of x.
        colour: Display values.
    """

    x: float
    y: float
    text: str
    size: float
    anchor: float = 0.0
    colour: Colour = INK


@dataclass
class Picture:
    """A raster, and the text that is drawn on it when the file is written."""

    width: int
    height: int
    texts: list[Text] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.raster = Raster(self.width, self.height)

    def write(
        self, x: float, y: float, text: str, size: float, anchor: float = 0.0, colour: Colour = INK
    ) -> None:
        """Add a line of text, its baseline at y; see `Text`."""
        self.texts.append(Text(x, y, text, size, anchor, colour))

    def save(self, path: Path) -> None:
        """Write the picture as a PNG; no window is needed.

        Raises:
            OSError: The file cannot be written.
        """
        _save_pixels(self.raster.pixels, path)
        picture = imbuf.load(str(path))
        with blf.bind_imbuf(0, picture):
            for text in self.texts:
                blf.size(0, text.size)
                wide, _ = blf.dimensions(0, text.text)
                blf.color(0, *text.colour, 1.0)
                blf.position(0, round(text.x - text.anchor * wide), round(text.y), 0.0)
                blf.draw_buffer(0, text.text)
        imbuf.write(picture, filepath=str(path))
        picture.free()


def _save_pixels(values: Array, path: Path) -> None:
    height, width = values.shape[:2]
    pixels = np.ones((height, width, 4), dtype=np.float32)
    pixels[..., :3] = np.clip(values, 0.0, 1.0)
    image = bpy.data.images.new(path.stem, width, height)
    try:
        image.colorspace_settings.name = "Non-Color"
        image.pixels.foreach_set(pixels.ravel())
        image.filepath_raw = str(path)
        image.file_format = "PNG"
        image.save()
    except RuntimeError as error:
        raise OSError(str(error).strip()) from error
    finally:
        bpy.data.images.remove(image)


def open_in_blender(path: Path, name: str) -> bpy.types.Image:
    """Load a PNG as a packed image of the file; it replaces an earlier one of that name."""
    image = bpy.data.images.load(str(path))
    image.pack()
    if (old := bpy.data.images.get(name)) is not None:
        old.user_remap(image)
        bpy.data.images.remove(old)
    image.name = name
    return image


@dataclass
class Axes:
    """A frame on a picture with linear or logarithmic scales.

    Attributes:
        picture: The picture to draw on.
        box: Left, bottom, right, top, pixels.
        x: Least and greatest value across.
        y: Least and greatest value upwards.
        size: Of the text, pixels.
        logarithmic: Whether both scales are.
    """

    picture: Picture
    box: tuple[float, float, float, float]
    x: tuple[float, float]
    y: tuple[float, float]
    size: float = 15.0
    logarithmic: bool = False

    def place(self, x: Array, y: Array) -> Array:
        """Return the pixels of values, (n, 2)."""
        left, bottom, right, top = self.box
        return np.stack(
            (
                left + (right - left) * self._part(x, self.x),
                bottom + (top - bottom) * self._part(y, self.y),
            ),
            axis=-1,
        )

    def _part(self, values: Array, ends: tuple[float, float]) -> Array:
        low, high = ends
        if self.logarithmic:
            values, low, high = np.log(np.maximum(values, 1e-12)), math.log(low), math.log(high)
        return (values - low) / (high - low)

    def grid(
        self,
        x_marks: Sequence[tuple[float, str]],
        y_marks: Sequence[tuple[float, str]],
        x_name: str = "",
        y_name: str = "",
    ) -> None:
        """Draw the frame, lines at the marks, their labels, and the names of the axes.

        Args:
            x_marks: Value and label of each mark across.
            y_marks: The same upwards.
            x_name: Name of the axis across.
            y_name: Name of the axis upwards.
        """
        left, bottom, right, top = self.box
        raster, size = self.picture.raster, self.size
        for value, text in x_marks:
            x = round(float(self.place(np.array(value), np.array(self.y[0]))[0])) + 0.5
            raster.line([(x, bottom), (x, top)], FAINT, 1.0)
            self.picture.write(x, bottom - 1.35 * size, text, size, 0.5)
        for value, text in y_marks:
            y = round(float(self.place(np.array(self.x[0]), np.array(value))[1])) + 0.5
            raster.line([(left, y), (right, y)], FAINT, 1.0)
            self.picture.write(left - 0.5 * size, y - BASELINE * size, text, size, 1.0)
        frame = [(left, bottom), (right, bottom), (right, top), (left, top), (left, bottom)]
        raster.line([(x + 0.5, y + 0.5) for x, y in frame], FRAME, 1.0)
        if x_name:
            self.picture.write((left + right) / 2.0, bottom - 2.75 * size, x_name, size, 0.5)
        if y_name:
            self.picture.write(left - 2.6 * size, top + 0.6 * size, y_name, size)

    def curve(
        self, x: Array, y: Array, colour: Colour, width: float = 2.0, dash: Sequence[float] = ()
    ) -> None:
        """Draw a curve, clipped to the frame."""
        self.picture.raster.line(self.place(x, y), colour, width, dash=dash, clip=self.box)

    def points(
        self, x: Array, y: Array, errors: Array | None, colour: Colour, radius: float = 2.6
    ) -> None:
        """Draw points with bars of one standard error; leave out those outside the frame."""
        inside = (y >= self.y[0]) & (y <= self.y[1]) & (x >= self.x[0]) & (x <= self.x[1])
        if errors is not None:
            lows, highs = self.place(x, y - errors), self.place(x, y + errors)
            for low, high in zip(lows[inside], highs[inside], strict=True):
                self.picture.raster.line([low, high], colour, 1.2, clip=self.box)
        for px, py in self.place(x, y)[inside]:
            self.picture.raster.disc(float(px), float(py), radius, colour)
