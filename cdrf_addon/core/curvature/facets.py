# SPDX-License-Identifier: GPL-3.0-or-later
"""Detect meshes of flat sides only (planes, boxes, walls): their curvature is 0 everywhere."""

from __future__ import annotations

import math

import numpy as np

from .clean import weld
from .topology import face_normals, runs_twice, shared_edges
from .tri_mesh import TriMesh

# Faces this close to one plane are one flat face; float32 positions of a plane lean less.
FLAT_ANGLE = math.radians(1.0)
# Faces that meet at this angle meet at a corner, not on a coarsely divided round surface.
CORNER_ANGLE = math.radians(59.0)
# Larger meshes are hardly boxes, and the check would take time.
MOST_TRIANGLES = 200_000
# Edges checked first, as most meshes fail on some of them.
SAMPLE = 999


def is_faceted(mesh: TriMesh) -> bool:
    """Return whether every two neighbouring faces lie in one plane or meet at a sharp corner."""
    triangles = mesh.triangles
    if len(triangles) > MOST_TRIANGLES or not np.isfinite(mesh.vertices).all():
        return False
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    welding = weld(mesh.vertices)
    vertices, triangles = mesh.vertices[welding.first], welding.group[triangles]
    with np.errstate(over="ignore", invalid="ignore"):
        normals = face_normals(vertices, triangles)
        area = normals.doubled_area
        if not (area > 0.0).all() or not np.isfinite(area).all():
            return False
        unit = normals.scaled / area
    if runs_twice(triangles, len(vertices)):
        return False  # doubled or flipped faces need cleaning first
    edges = shared_edges(triangles, len(vertices))
    face, other = edges.face, edges.other
    for some in (slice(0, SAMPLE), slice(SAMPLE, None)):
        cosine = (unit[:, face[some]] * unit[:, other[some]]).sum(axis=0)
        round_ = (cosine < math.cos(FLAT_ANGLE)) & (cosine > math.cos(CORNER_ANGLE))
        if round_.any():
            return False
    # A finely divided ball passes so far, as no two neighbours differ by much; but its faces do not
    # all lie in the plane of their side.
    smooth = (unit[:, face] * unit[:, other]).sum(axis=0) > math.cos(CORNER_ANGLE)
    joined = np.ones(int(smooth.sum()), dtype=np.int8), (face[smooth], other[smooth])
    count = len(triangles)
    _, side = connected_components(coo_array(joined, (count, count)), directed=False)
    total = np.stack([np.bincount(side, part) for part in normals.scaled])
    length = np.sqrt((total**2).sum(axis=0))
    if not (length > 0.0).all():
        return False
    mean = total / length
    return bool(((unit * mean[:, side]).sum(axis=0) >= math.cos(FLAT_ANGLE)).all())
