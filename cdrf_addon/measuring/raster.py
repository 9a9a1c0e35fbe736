# SPDX-License-Identifier: GPL-3.0-or-later
"""Antialiased lines and discs in an array of pixels: Blender ships no plotting library."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

Colour = tuple[float, float, float]


class Raster:
    """A picture of (height, width, 3) display values in [0, 1], row 0 at the bottom.

    Coordinates are pixels from the lower left corner, the centre of the first pixel at 0.5.
    """

    def __init__(self, width: int, height: int, colour: Colour = (1.0, 1.0, 1.0)) -> None:
        self.pixels: Array = np.empty((height, width, 3))
        self.pixels[:] = colour

    def _blend(self, rows: slice, columns: slice, cover: Array, colour: Colour) -> None:
        area = self.pixels[rows, columns]
        area += cover[..., None] * (np.asarray(colour) - area)

    def rectangle(self, box: tuple[float, float, float, float], colour: Colour) -> None:
        """Fill left, bottom, right, top, rounded to whole pixels."""
        left, bottom, right, top = (round(edge) for edge in box)
        self.pixels[max(bottom, 0) : top, max(left, 0) : right] = colour

    def line(
        self,
        points: ArrayLike,
        colour: Colour,
        width: float = 1.5,
        *,
        dash: Sequence[float] = (),
        clip: tuple[float, float, float, float] | None = None,
    ) -> None:
        """Draw a line through (n, 2) points.

        Args:
            points: Corners, pixels.
            colour: Display values.
            width: Pixels.
            dash: Lengths drawn and left out, in turn, pixels.
            clip: Left, bottom, right, top; nothing is drawn outside.
        """
        corners = np.asarray(points, dtype=np.float64)
        for part in _dashes(corners, dash) if dash else [corners]:
            self._stroke(part, colour, width, clip)

    def _stroke(
        self,
        corners: Array,
        colour: Colour,
        width: float,
        clip: tuple[float, float, float, float] | None,
    ) -> None:
        height, across = self.pixels.shape[:2]
        box = clip or (0.0, 0.0, float(across), float(height))
        # One mask for the whole line, so that joints are not blended twice.
        low = np.maximum(np.floor(corners.min(axis=0) - width - 1.0), np.floor(box[:2]))
        high = np.minimum(np.ceil(corners.max(axis=0) + width + 1.0), np.ceil(box[2:]))
        left, bottom = (max(int(value), 0) for value in low)
        right, top = min(int(high[0]), across), min(int(high[1]), height)
        if right <= left or top <= bottom:
            return
        mask = np.zeros((top - bottom, right - left))
        for start, end in itertools.pairwise(corners):
            _cover(mask, start - (left, bottom), end - (left, bottom), width)
        self._blend(slice(bottom, top), slice(left, right), mask, colour)

    def disc(self, x: float, y: float, radius: float, colour: Colour) -> None:
        """Draw a filled disc."""
        self.line([(x, y), (x, y)], colour, 2.0 * radius)


def _cover(mask: Array, start: Array, end: Array, width: float) -> None:
    """Raise a mask to the part of each pixel that a segment with round ends covers."""
    height, across = mask.shape
    reach = width / 2.0 + 1.0
    left = max(math.floor(min(start[0], end[0]) - reach), 0)
    right = min(math.ceil(max(start[0], end[0]) + reach), across)
    bottom = max(math.floor(min(start[1], end[1]) - reach), 0)
    top = min(math.ceil(max(start[1], end[1]) + reach), height)
    if right <= left or top <= bottom:
        return
    x = np.arange(left, right) + 0.5 - start[0]
    y = (np.arange(bottom, top) + 0.5 - start[1])[:, None]
    along = end - start
    square = float(along @ along)
    place = np.clip((x * along[0] + y * along[1]) / square, 0.0, 1.0) if square else 0.0
    distance = np.hypot(x - place * along[0], y - place * along[1])
    area = mask[bottom:top, left:right]
    np.maximum(area, np.clip(width / 2.0 + 0.5 - distance, 0.0, 1.0), out=area)


def _dashes(corners: Array, dash: Sequence[float]) -> list[Array]:
    """Cut a line into the dashes that are drawn."""
    lengths = np.hypot(*np.diff(corners, axis=0).T)
    walked = np.concatenate(([0.0], np.cumsum(lengths)))
    parts, place, number = [], 0.0, 0
    while place < walked[-1]:
        end = min(place + dash[number % len(dash)], walked[-1])
        if number % 2 == 0:
            inside = corners[(walked > place) & (walked < end)]
            ends = [
                [np.interp(at, walked, corners[:, axis]) for axis in (0, 1)] for at in (place, end)
            ]
            parts.append(np.vstack((ends[0], inside, ends[1])))
        place, number = end, number + 1
    return parts
