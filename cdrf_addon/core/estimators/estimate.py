# SPDX-License-Identifier: GPL-3.0-or-later
"""What every estimator returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ..mesh import Points


@dataclass(frozen=True)
class Estimate:
    """Principal curvatures at the vertices of a clean mesh, per unit of that mesh."""

    k1: Points
    """(n,) the larger; positive where the surface bulges outwards."""
    k2: Points
    """(n,) the smaller."""
    good: NDArray[np.bool_]
    """(n,) False where the estimator has nothing to say; k1 and k2 are arbitrary there."""

    @classmethod
    def empty(cls, count: int) -> Estimate:
        """Say nothing of `count` vertices yet."""
        return cls(np.zeros(count), np.zeros(count), np.zeros(count, dtype=bool))

    def put(self, rows: slice | NDArray[np.int64], part: Estimate) -> None:
        """Fill in some of the vertices."""
        self.k1[rows], self.k2[rows], self.good[rows] = part.k1, part.k2, part.good
