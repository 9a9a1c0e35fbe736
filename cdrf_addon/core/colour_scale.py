# SPDX-License-Identifier: GPL-3.0-or-later
"""Colour scales for curvature: hot (the paper's Fig. 3a), and blue to red for signed values."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

Scale = tuple[tuple[float, tuple[float, float, float]], ...]
"""Positions from 0 to 1 and their linear colours, ascending."""

HOT: Scale = (
    (0.0, (0.0, 0.0, 0.0)),
    (1.0 / 3.0, (1.0, 0.0, 0.0)),
    (2.0 / 3.0, (1.0, 1.0, 0.0)),
    (1.0, (1.0, 1.0, 1.0)),
)
# Hollows blue, flat parts grey, bulges red.
SIGNED: Scale = (
    (0.0, (0.0, 0.05, 1.0)),
    (0.5, (0.5, 0.5, 0.5)),
    (1.0, (1.0, 0.05, 0.0)),
)
MARK_COLOUR = (0.0, 0.8, 0.1)
"""Colour of vertices whose curvature comes from their neighbours."""


def colours(part: ArrayLike, scale: Scale) -> NDArray[np.float64]:
    """Return the linear colours, (..., 3), of values from 0 to 1."""
    positions = [position for position, _ in scale]
    values = np.asarray(part, dtype=np.float64)
    return np.stack(
        [np.interp(values, positions, [rgb[axis] for _, rgb in scale]) for axis in range(3)], -1
    )


def srgb(linear: NDArray[Any]) -> NDArray[np.float64]:
    """Encode linear colours as a screen shows them (IEC 61966-2-1)."""
    low = 12.92 * linear
    return np.asarray(np.where(linear <= 0.0031308, low, 1.055 * linear ** (1 / 2.4) - 0.055))


def ticks(low: float, high: float, unit: float) -> list[tuple[float, str]]:
    """Return the labels of a colour scale.

    Args:
        low: Curvature at the scale's beginning, 1/unit.
        high: Curvature at its end, 1/unit.
        unit: Metres in a unit of length.

    Returns:
        Five marks: the place from 0 to 1, and the curvature per metre with the radius it means.
    """
    marks = []
    for place in (0.0, 0.25, 0.5, 0.75, 1.0):
        kappa = (low + place * (high - low)) / unit
        marks.append((place, f"{kappa:.3g} /m{_radius(kappa)}"))
    return marks


def _radius(kappa: float) -> str:
    """Write the radius of a curvature in 1/m."""
    if abs(kappa) < 1e-9:
        return "  flat"
    radius = 1.0 / abs(kappa)
    for size, name in ((1e3, "km"), (1.0, "m"), (1e-2, "cm"), (1e-3, "mm"), (0.0, "um")):
        if radius >= size:
            scale = size or 1e-6
            return f"  r {radius / scale:.3g} {name}"
    return ""
