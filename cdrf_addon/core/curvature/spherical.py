# SPDX-License-Identifier: GPL-3.0-or-later
"""Detect spherical meshes and give them their exact curvature 1/r, at any resolution.

A quadric fit is 0.5 % high on an icosphere of 2,562 vertices and 3 % on Blender's default UV
sphere; 1/r is exact, and one number serves the whole mesh.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .field import CurvatureField
from .topology import edge_lengths

if TYPE_CHECKING:
    from .tri_mesh import Points, TriMesh

# A bump of height h over one edge e bends by about h / e^2; this much of 1/r is allowed.
BUMP_TOLERANCE = 0.005
# Distance of float32 positions from a sphere, as a part of its radius.
ROUNDING = 1e-6
# Part of the radius at which a face's centre lies at least: the corners of a box lie on a sphere,
# the centres of its faces do not.
INNERMOST = 0.9
# Coordinates beyond this are no mesh that can be measured.
MOST_EXTENT = 1e15
# Faces checked first, as most meshes are no spheres.
SAMPLE = 2_000


def curvature_if_spherical(mesh: TriMesh) -> CurvatureField | None:
    """Return the exact curvature of a mesh whose vertices lie on one sphere, else None.

    Parts of a sphere count, too. k1 = k2 = 1/r, negative if the faces are wound inwards.
    """
    if len(mesh.triangles) > 2 * SAMPLE and not _may_be_sphere(mesh):
        return None
    used = np.zeros(len(mesh.vertices), dtype=bool)
    used[mesh.triangles] = True
    points = mesh.vertices[used]
    if len(points) < 12 or not (np.abs(points) < MOST_EXTENT).all():
        return None
    middle = points.mean(axis=0)
    extent = float(np.ptp(points, axis=0).max())
    if not extent > 1.0 / MOST_EXTENT:
        return None
    scaled = (points - middle) / extent
    fit = _fit_sphere(scaled)
    centre, radius = fit.centre, fit.radius
    if not fit.determined:
        return None
    corners = (mesh.vertices[mesh.triangles] - middle) / extent - centre
    edge = float(np.median(edge_lengths(mesh.vertices, mesh.triangles))) / extent
    tolerance = max(BUMP_TOLERANCE * edge**2 / radius, ROUNDING * radius)
    if np.abs(np.linalg.norm(scaled - centre, axis=1) - radius).max() > tolerance:
        return None
    outwards = corners.mean(axis=1)
    if np.linalg.norm(outwards, axis=1).min() < INNERMOST * radius:
        return None
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outside = (normal * outwards).sum(axis=1).sum() >= 0.0
    value = (1.0 if outside else -1.0) / (radius * extent)
    curvature = np.where(used, value, 0.0)
    filled = np.zeros(len(mesh.vertices), dtype=bool)
    return CurvatureField(curvature, curvature.copy(), filled)


def _may_be_sphere(mesh: TriMesh) -> bool:
    """Return whether some of the faces lie near one sphere, so that the rest is worth a check."""
    some = mesh.triangles[:: len(mesh.triangles) // SAMPLE]
    points = mesh.vertices[some.ravel()]
    if not (np.abs(points) < MOST_EXTENT).all():
        return False
    centred = points - points.mean(axis=0)
    extent = max(float(np.ptp(centred, axis=0).max()), 1.0 / MOST_EXTENT)
    scaled = centred / extent
    fit = _fit_sphere(scaled)
    off = np.abs(np.linalg.norm(scaled - fit.centre, axis=1) - fit.radius)
    # Looser than the full check, as these faces may be larger than most.
    return bool(off.max() <= 0.02 * fit.radius)


@dataclass(frozen=True)
class _SphereFit:
    centre: Points
    """(3,)"""
    radius: float
    determined: bool
    """False where spheres of many radii fit, as on a nearly flat cap."""


def _fit_sphere(points: Points) -> _SphereFit:
    """Fit a sphere to points, (n, 3), by least squares to |v|^2 = 2 c.v + (r^2 - |c|^2)."""
    system = np.column_stack((2.0 * points, np.ones(len(points))))
    solution, _, rank, singular = np.linalg.lstsq(system, (points**2).sum(axis=1), rcond=None)
    centre = solution[:3]
    radius = float(np.sqrt(max(solution[3] + centre @ centre, 0.0)))
    return _SphereFit(centre, radius, bool(rank == 4 and singular[-1] >= 1e-3 * singular[0]))
