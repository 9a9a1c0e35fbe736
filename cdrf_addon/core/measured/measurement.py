# SPDX-License-Identifier: GPL-3.0-or-later
"""What was measured on path-traced spheres, with the Monte-Carlo error beside it, and its file.

Everything here is in float64 and free of Blender. Values are radiance / (albedo * irradiance / pi),
so that Lambert is max(cos theta, 0); they may exceed 1, as a small translucent body collects light
from all sides.
"""

from __future__ import annotations

import math
import tokenize
import zipfile
import zlib
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import MeasurementError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

MAGIC = "cdrf sphere measurement"
FORMAT = 2
# What numpy and zipfile raise on files that are damaged or none of theirs.
DAMAGED = (
    *(OSError, ValueError, EOFError, AttributeError, TypeError, KeyError, NotImplementedError),
    *(RuntimeError, SyntaxError, zipfile.BadZipFile, zlib.error, tokenize.TokenError),
)
# No body sends out so many times what an opaque one does.
MOST_VALUE = 100.0
# Bins of theta in radians, where the pixels are not in columns of equal N.L.
BIN = math.radians(3.0)
LEAST_PIXELS = 3
# Where hardly any path finds the light, a few passes see no scatter at all; no error is below this.
LEAST_ERROR = 1e-5


@dataclass(frozen=True)
class SphereMeasurement:
    """Radiance of unit spheres that differ in the scale of their scatter radius.

    Channels do not mix in Cycles: each column c of `values` holds for any material whose channel
    has the albedo `albedo[c]` and the scatter distance radius * scale / r on a sphere of radius r.

    Attributes:
        albedo: (3,) colour of the material, in (0, 1].
        scales: (S,) radius * scale * kappa of each sphere, ascending, positive.
        cosine: (B,) N.L of each bin, ascending, in [-1, 1].
        values: (S, 3, B) radiance / (albedo * irradiance / pi).
        errors: (S, 3, B) standard error of the values, from the scatter between passes.
        samples: Paths through each pixel, all passes together.
        seed: Seed of the first pass.
        blender: Version that rendered.
        method: Subsurface method of the node, as Blender names it.
        elevation: Angle of the light from the picture's plane towards the camera, radians.
        all_views: True if the spheres were seen from all sides and their pixels put together.
    """

    albedo: Array
    scales: Array
    cosine: Array
    values: Array
    errors: Array
    samples: int = 0
    seed: int = 0
    blender: str = ""
    method: str = "RANDOM_WALK"
    elevation: float = 0.0
    all_views: bool = False

    def __post_init__(self) -> None:
        for name in ("albedo", "scales", "cosine", "values", "errors"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=np.float64))
        shape = (len(self.scales), 3, len(self.cosine))
        arrays = (self.albedo, self.scales, self.cosine, self.values, self.errors)
        right = self.albedo.shape == (3,) and self.values.shape == self.errors.shape == shape
        if not right or shape[0] < 2 or shape[2] < 8:
            raise MeasurementError("The measurement's arrays do not fit together; measure again.")
        if not all(np.isfinite(array).all() for array in arrays) or (self.errors < 0.0).any():
            raise MeasurementError("The measurement holds NaN or infinity; measure again.")
        if np.abs(self.values).max() > MOST_VALUE or self.values.mean() < 0.0:
            raise MeasurementError("The measurement holds impossible values; measure again.")
        if (np.diff(self.scales) <= 0.0).any() or self.scales[0] <= 0.0:
            raise MeasurementError("The measurement's scales do not rise; measure again.")
        if (np.diff(self.cosine) <= 0.0).any() or np.abs(self.cosine).max() > 1.0:
            raise MeasurementError("The measurement's angles do not rise; measure again.")
        if (self.albedo <= 0.0).any() or (self.albedo > 1.0).any():
            raise MeasurementError("The measurement's albedo is not between 0 and 1.")

    @property
    def theta(self) -> Array:
        """Angle between normal and light of each bin, (B,), descending."""
        return np.asarray(np.arccos(self.cosine))

    def energy(self) -> Array:
        """Mean over the sphere relative to Lambert's 1/4, (S, 3): 1 is a material that keeps it."""
        weights = solid_angle_weights(self.theta)
        return np.asarray((self.values * weights).sum(axis=-1) * 4.0)


def solid_angle_weights(theta: Array) -> Array:
    """Weights (B,) with sum 1 of bins at descending angles, by the area they have on the sphere."""
    edges = _edges(theta)
    return np.asarray(np.diff(np.cos(edges)) / 2.0)


def equator_weights(theta: Array) -> Array:
    """Weights (B,) with sum 1 of bins at descending angles, uniform in theta, as in the paper.

    The bins next to the poles count as wide as their neighbours are, not as far as to the poles.
    """
    edges = _edges(theta)
    edges[0] = min(math.pi, 2.0 * theta[0] - edges[1])
    edges[-1] = max(0.0, 2.0 * theta[-1] - edges[-2])
    return np.asarray(-np.diff(edges) / (edges[0] - edges[-1]))


def _edges(theta: Array) -> Array:
    middle = (theta[1:] + theta[:-1]) / 2.0
    return np.concatenate(([math.pi], middle, [0.0]))


def bin_pixels(cosine: Array) -> NDArray[np.int64]:
    """Number of the bin of each pixel, (P,); bin 0 has the least N.L, each at least 3 pixels.

    Pixels in columns of equal N.L make a bin each; others are put together by their angle.
    """
    rounded = cosine.round(9)
    if len(np.unique(rounded)) > len(cosine) // 2:
        rounded = -np.round(np.arccos(np.clip(cosine, -1.0, 1.0)) / BIN)
    _, first = np.unique(rounded, return_inverse=True)
    counts = np.bincount(first)
    merged = np.zeros(len(counts), dtype=np.int64)
    number = filled = 0
    for place, count in enumerate(counts):
        merged[place] = number
        filled += int(count)
        if filled >= LEAST_PIXELS and counts[place + 1 :].sum() >= LEAST_PIXELS:
            number, filled = number + 1, 0
    return merged[first]


@dataclass(frozen=True)
class PooledPixels:
    """Means over the pixels of each bin."""

    cosine: Array
    """(B,) mean N.L."""
    values: Array
    """(S, 3, B) radiance / (albedo * irradiance / pi)."""
    errors: Array
    """(S, 3, B) standard error of the values."""


def pool(
    cosine: Array, total: Array, square: Array, passes: int, numbers: NDArray[np.int64]
) -> PooledPixels:
    """Average the pixels of each bin.

    Args:
        cosine: (P,) N.L of the pixels.
        total: (S, P, 3) sums of the values over the passes.
        square: (S, P, 3) sums of their squares over the passes.
        passes: Number of passes, at least 2.
        numbers: (P,) bin of each pixel, from `bin_pixels`.
    """
    count = np.bincount(numbers).astype(np.float64)
    members = np.zeros((len(numbers), len(count)))
    members[np.arange(len(numbers)), numbers] = 1.0
    mean = total / passes
    # Of the mean over the passes; never below zero by rounding.
    variance = np.maximum(square / passes - mean**2, 0.0) / (passes - 1)
    values = np.einsum("spc,pb->scb", mean, members, optimize=True) / count
    # The variance of a pixel changes slowly with its angle; neighbours make its estimate firmer.
    each = np.einsum("spc,pb->scb", variance, members, optimize=True)
    padded = np.concatenate((each[..., :1], each, each[..., -1:]), axis=-1)
    counts = np.concatenate((count[:1], count, count[-1:]))
    each = padded[..., :-2] + padded[..., 1:-1] + padded[..., 2:]
    errors = np.sqrt(each / (counts[:-2] + counts[1:-1] + counts[2:]) / count)
    return PooledPixels(cosine @ members / count, values, np.maximum(errors, LEAST_ERROR))


def save(path: Path, measurement: SphereMeasurement) -> None:
    """Write a measurement as .npz, whole or not at all.

    Raises:
        MeasurementError: The file cannot be written.
    """
    part = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with part.open("wb") as file:
            content: dict[str, Any] = vars(measurement)
            np.savez(file, magic=np.array(MAGIC), format=np.array(FORMAT), **content)
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise MeasurementError(f"{path} cannot be written: {error.strerror}.") from error


def load(path: Path) -> SphereMeasurement:
    """Read a measurement.

    Raises:
        MeasurementError: There is no such file, or it holds something else.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            content = {name: file[name] for name in file.files}
    except FileNotFoundError as error:
        raise MeasurementError(f"{path} does not exist.") from error
    except DAMAGED as error:
        raise MeasurementError(f"{path.name} is no measurement of spheres, or damaged.") from error
    names = {field.name for field in fields(SphereMeasurement)}
    if str(content.pop("magic", "")) != MAGIC or not names <= set(content):
        raise MeasurementError(f"{path.name} is no measurement of spheres.")
    if (version := str(content.pop("format", 0))) != str(FORMAT):
        raise MeasurementError(f"{path.name} has format {version}, not {FORMAT}; measure again.")
    plain = {
        name: value if value.ndim else value.item()
        for name, value in content.items()
        if name in names
    }
    try:
        return SphereMeasurement(**plain)
    except DAMAGED as error:
        raise MeasurementError(f"{path.name} is no measurement of spheres, or damaged.") from error
