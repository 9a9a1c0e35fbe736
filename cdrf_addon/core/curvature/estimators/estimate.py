# SPDX-License-Identifier: GPL-3.0-or-later
"""The result of an estimator, and the faces that a fit over rings can use."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..clean import CleanMesh
    from ..tri_mesh import Indices, Mask, Points

# A neighbourhood grows with the square of the valence, and so do time and memory.
VALENCE_LIMIT = 256


@dataclass(frozen=True)
class Estimate:
    """Principal curvatures at the vertices of a clean mesh, per unit of that mesh."""

    k1: Points
    """(n,) the larger; positive where the surface bulges outwards."""
    k2: Points
    """(n,) the smaller."""
    good: Mask
    """(n,) False where the estimator has no result; k1 and k2 are arbitrary there."""

    @classmethod
    def empty(cls, count: int) -> Estimate:
        """Return an estimate of `count` vertices that has no result yet."""
        return cls(np.zeros(count), np.zeros(count), np.zeros(count, dtype=bool))

    def put(self, rows: slice | Indices, part: Estimate) -> None:
        """Fill in some of the vertices."""
        self.k1[rows], self.k2[rows], self.good[rows] = part.k1, part.k2, part.good


def fittable_faces(mesh: CleanMesh) -> Mask:
    """Return which faces a fit over rings can use, (m,), and count the hubs in the mesh's report.

    Excluded are the faces at vertices that join too many edges, and those along the seam of a
    surface without an outside.
    """
    hub = np.bincount(mesh.triangles.ravel(), minlength=len(mesh.vertices)) > VALENCE_LIMIT
    mesh.report.hub_vertices = int(hub.sum())
    return np.asarray(~(hub | mesh.seam)[mesh.triangles].any(axis=1))
