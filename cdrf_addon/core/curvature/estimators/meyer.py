# SPDX-License-Identifier: GPL-3.0-or-later
"""Discrete differential-geometry operators of Meyer et al. 2003, the paper's reference 10.

Mean curvature from the cotangent Laplacian of the positions, Gaussian curvature from the angle
defect, both over the mixed Voronoi area. Exact in the limit on regular meshes only, and undefined
at a boundary.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import TYPE_CHECKING

import numpy as np

from ..topology import vertex_normals
from .estimate import Estimate
from .libigl import import_igl

if TYPE_CHECKING:
    from ..clean import CleanMesh


def meyer_steps(mesh: CleanMesh) -> Generator[float, None, Estimate]:
    """Estimate at every inner vertex, yielding the part done.

    Args:
        mesh: A clean mesh, in units of its median edge.

    Returns:
        Principal curvatures per unit of the clean mesh.
    """
    igl = import_igl()
    yield 0.1
    vertices, triangles = mesh.vertices, mesh.triangles
    count = len(vertices)
    area = igl.massmatrix(vertices, triangles, igl.MASSMATRIX_TYPE_VORONOI).diagonal()
    yield 0.3
    # Laplace-Beltrami of the position is -2 H N.
    curvature_normal = -(igl.cotmatrix(vertices, triangles) @ vertices) / (2.0 * area[:, None])
    yield 0.6
    gaussian = igl.gaussian_curvature(vertices, triangles) / area
    normals = vertex_normals(mesh.face_normals, triangles, count)
    mean = np.sqrt((curvature_normal**2).sum(axis=1))
    mean = np.where((curvature_normal * normals.unit).sum(axis=1) < 0.0, -mean, mean)
    split = np.sqrt(np.maximum(mean**2 - gaussian, 0.0))
    inner = np.ones(count, dtype=bool)
    inner[igl.boundary_facets(triangles)[0].ravel()] = False
    yield 1.0
    return Estimate(mean + split, mean - split, inner & normals.sound & ~mesh.seam)
