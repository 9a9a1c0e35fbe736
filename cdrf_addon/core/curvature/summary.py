# SPDX-License-Identifier: GPL-3.0-or-later
"""Summarise the curvature of a whole mesh: flat, constant or varying, and its usual range."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .field import CurvatureField
from .tri_mesh import TriMesh

FLAT, CONSTANT, VARYING = "FLAT", "CONSTANT", "VARYING"

# A mesh whose kappa stays within this of its mean is rendered with one kappa: f changes by less
# than max(sigma df/dsigma) = 0.2 times this, 1e-3 of the peak.
CONSTANT_TOLERANCE = 0.005
# kappa times the mesh's size below which bending is invisible (and float32 noise of a plane).
FLAT_TOLERANCE = 1e-3


@dataclass(frozen=True)
class CurvatureSummary:
    """Curvature of a mesh in a few numbers, 1/unit."""

    kind: str
    """FLAT, CONSTANT or VARYING."""
    low: float
    """5th percentile of kappa."""
    median: float
    """50th percentile of kappa."""
    high: float
    """95th percentile of kappa; the maximum of a real mesh is at a crease, and means little."""
    mean_high: float
    """95th percentile of the absolute mean curvature."""
    mean_values: tuple[float, float, float, float]
    """Means of kappa, k1, k2 and signed mean curvature."""


def summarise(mesh: TriMesh, field: CurvatureField) -> CurvatureSummary:
    """Classify the curvature of a mesh by its values at the vertices that belong to a face."""
    used = np.zeros(len(mesh.vertices), dtype=bool)
    used[mesh.triangles] = True
    used &= np.isfinite(mesh.vertices).all(axis=1)
    kappa = field.kappa[used]
    low, median, high = np.percentile(kappa, (5.0, 50.0, 95.0))
    means = tuple(
        float(values[used].mean()) for values in (field.kappa, field.k1, field.k2, field.mean)
    )
    points = mesh.vertices[used]
    size = float(np.ptp(points, axis=0).max())
    kind = VARYING
    if kappa.max() == 0.0 or kappa.max() * size <= FLAT_TOLERANCE:
        kind = FLAT
    elif kappa.max() - kappa.min() <= 2.0 * CONSTANT_TOLERANCE * kappa.mean():
        # Equal kappa is not enough: k1 and k2 are stored, too, and have to be constant.
        spread = max(np.ptp(field.k1[used]), np.ptp(field.k2[used]))
        if spread <= 4.0 * CONSTANT_TOLERANCE * kappa.mean():
            kind = CONSTANT
    mean_high = float(np.percentile(np.abs(field.mean[used]), 95.0))
    return CurvatureSummary(kind, float(low), float(median), float(high), mean_high, means)  # type: ignore[arg-type]


FLAT_SUMMARY = CurvatureSummary(FLAT, 0.0, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0, 0.0))
"""Of a mesh that is flat everywhere."""
