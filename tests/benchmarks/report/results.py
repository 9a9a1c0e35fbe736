# SPDX-License-Identifier: GPL-3.0-or-later
"""Raw results of all stages as the pages need them, and how numbers are written there."""

from __future__ import annotations

from collections.abc import Sequence

from ..common.timing import spread
from .matrix import measured_cells
from .settings import Settings
from .timing import base_of, ratios

DASH = "–"
FEW = 5


def with_spread(values: Sequence[float], digits: int = 2) -> str:
    """Median (10 % to 90 %; of fewer than five values, least to most)."""
    if not values:
        return DASH
    middle, low, high = spread(values)
    if len(values) < FEW:
        low, high = min(values), max(values)
    if len(values) == 1:
        return f"{middle:.{digits}f} (one run)"
    return f"{middle:.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


class Results:
    """What all stages have measured so far."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.errors = settings.read("errors")
        self.timing = settings.read("timing")
        self.paper = settings.read("paper")
        self.stability = settings.read("stability")
        self.cells = measured_cells(settings)

    def image(self, name: str, text: str) -> list[str]:
        """A picture, if it was drawn."""
        return [f"![{text}](report/{name})", ""] if (self.settings.pictures / name).exists() else []

    def ratio(
        self, part: str, name: str, point: str, clock: str = "wall", base: str = ""
    ) -> list[float]:
        """Times of a contender over those of what it is compared with, round by round."""
        rows = self.timing.get(part, {}).get("rows", {})
        one, other = (rows.get(key, {}).get(point) for key in (name, base or base_of(name)))
        return ratios(one, other, clock) if one and other else []
