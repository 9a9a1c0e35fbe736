# SPDX-License-Identifier: GPL-3.0-or-later
"""What to measure: the material, the spheres, and how many paths Cycles traces."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import asdict, dataclass, replace

import bpy

from ..compat import walk_method
from ..core.errors import MeasurementError

VERSION = 4
"""Part of the cache's key: raise it when the worker measures something else."""
RANDOM_WALK = "RANDOM_WALK"
# The first scale leaves nothing but Lambert's shape; beyond the last nothing changes any more.
# Until 4.5, and in what 5.x calls legacy, the same radius scatters about a tenth as far.
FIRST_SCALE, ROWS, ROWS_PER_OCTAVE = 2.0**-8, 22, 2
OLD_REACH = 8.0


@dataclass(frozen=True)
class Quality:
    """How finely spheres are sampled.

    Attributes:
        pixels: Across and down each sphere.
        samples: Paths through a pixel in a pass, for a white material.
        passes: Renders that differ by their seed alone; their scatter is the Monte Carlo error.
    """

    pixels: tuple[int, int]
    samples: int
    passes: int


QUALITIES = {
    "preview": Quality((64, 12), 8, 4),
    "default": Quality((80, 20), 30, 8),
    "fine": Quality((96, 24), 64, 8),
}
DEFAULT_QUALITY = "default"


@dataclass(frozen=True)
class Views:
    """What a measurement renders.

    Attributes:
        pixels: Across and down each sphere.
        elevations: Angle of the light from the picture's plane, a view each, radians.
        passes: Renders of each view.
    """

    pixels: tuple[int, int]
    elevations: tuple[float, ...]
    passes: int


@dataclass(frozen=True)
class Request:
    """What to measure.

    Attributes:
        albedo: Colour of the red, green and blue channel, each in (0, 1].
        quality: One of QUALITIES.
        seed: Any whole number from 0.
        scales: radius * scale * kappa of the spheres, ascending; empty takes the rows of a table.
        radius: Factors on the scale per channel; equal ones make a table, others a check.
        elevation: Angle of the light from the picture's plane towards the camera, radians.
        all_views: Look from all sides in place of one, and pool the pixels of equal N.L: Cycles'
            random walk does not look the same from everywhere.
        method: The subsurface method, as Blender's node names it.

    Raises:
        MeasurementError: An attribute is out of its range.
    """

    albedo: tuple[float, float, float]
    quality: str = DEFAULT_QUALITY
    seed: int = 0
    scales: tuple[float, ...] = ()
    radius: tuple[float, float, float] = (1.0, 1.0, 1.0)
    elevation: float = 0.0
    all_views: bool = False
    method: str = RANDOM_WALK

    def __post_init__(self) -> None:
        if not all(0.0 < value <= 1.0 for value in self.albedo):
            raise MeasurementError("Each channel of the colour must be above 0 and at most 1.")
        if not all(0.0 < value < 1e6 for value in self.radius):
            raise MeasurementError("Each channel of the radius must be a positive number.")
        if self.quality not in QUALITIES:
            raise MeasurementError(f"The quality must be one of {', '.join(QUALITIES)}.")
        if not 0 <= self.seed < 2**31:
            raise MeasurementError("The seed must be a whole number from 0 to 2147483647.")
        rising = all(b > a for a, b in zip(self.scales, self.scales[1:], strict=False))
        if self.scales and not (rising and self.scales[0] > 0.0 and self.scales[-1] < 1e6):
            raise MeasurementError("The scales must be positive and rise.")

    def complete(self) -> Request:
        """Fill in the rows of a table where no scales are given."""
        if self.scales:
            return self
        old = walk_method(self.method) == "RANDOM_WALK_LEGACY"
        first = FIRST_SCALE * (OLD_REACH if old else 1.0)
        rows = tuple(first * 2.0 ** (row / ROWS_PER_OCTAVE) for row in range(ROWS))
        return replace(self, scales=rows)

    def samples(self) -> int:
        """Return the paths through a pixel in a pass: more where the albedo is low, paths short."""
        return round(QUALITIES[self.quality].samples * (2.0 - sum(self.albedo) / 3.0) ** 1.1)

    def views(self) -> Views:
        """Return the pixels, the directions of the light and the passes of each."""
        quality = QUALITIES[self.quality]
        if not self.all_views:
            return Views(quality.pixels, (self.elevation,), quality.passes)
        across, down = quality.pixels
        side = max(round(math.sqrt(across * down)), 8)
        count = max(quality.passes // 2, 2)
        # Equal parts of the sphere of directions from which one may look.
        elevations = tuple(math.asin((2 * view + 1) / count - 1.0) for view in range(count))
        return Views((side, side), elevations, 2)

    def key(self) -> str:
        """Return a hash of everything that decides the result."""
        quality = asdict(QUALITIES[self.quality])
        # Colours come in double precision from a command line and in single from a panel.
        albedo = [float(f"{part:.6g}") for part in self.albedo]
        request = asdict(self.complete()) | {"albedo": albedo}
        facts = [VERSION, bpy.app.version_string, request, quality]
        text = json.dumps(facts, sort_keys=True)
        return hashlib.blake2b(text.encode(), digest_size=12).hexdigest()
