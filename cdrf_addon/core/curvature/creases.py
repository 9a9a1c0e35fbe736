# SPDX-License-Identifier: GPL-3.0-or-later
"""Sharp edges: the surface is cut open along them, so that no fit looks across."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .topology import face_normals, shared_edges

if TYPE_CHECKING:
    from .tri_mesh import Indices, Points

# Two faces never meet at this angle: nothing is split.
NO_CREASE = np.pi


@dataclass(frozen=True)
class SplitMesh:
    """A mesh whose vertices on creases have several parts, one for each side."""

    triangles: Indices
    """(m, 3) indices of parts."""
    part_of: Indices
    """(p,) vertex that each part belongs to; the first n parts are the vertices themselves."""


def split_creases(vertices: Points, triangles: Indices, angle: float) -> SplitMesh:
    """Cut the surface open along its sharp edges.

    Args:
        vertices: (n, 3) positions, any unit.
        triangles: (m, 3) consistently wound faces.
        angle: Faces that meet at a sharper angle than this are parted, radians.

    Returns:
        The triangles in terms of the parts.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    normals = face_normals(vertices, triangles)
    unit = normals.scaled / normals.doubled_area
    edges = shared_edges(triangles, len(vertices))
    edges = edges[(unit[:, edges.face] * unit[:, edges.other]).sum(axis=0) >= np.cos(angle)]
    # A corner of a face continues over a smooth edge in the next face's corner at the same vertex.
    following, preceding = (edges.corner + 1) % 3, (edges.other_corner + 1) % 3
    one = np.concatenate((3 * edges.face + edges.corner, 3 * edges.face + following))
    two = np.concatenate((3 * edges.other + preceding, 3 * edges.other + edges.other_corner))
    size = 3 * len(triangles)
    graph = coo_array((np.ones(len(one), dtype=np.int8), (one, two)), (size, size))
    _, fan = connected_components(graph, directed=False)
    # Fans are numbered by first corner; the first fan of a vertex keeps the vertex's number.
    owner = np.zeros(fan.max() + 1, dtype=np.int64)
    owner[fan] = triangles.ravel()
    order = np.argsort(owner, kind="stable")
    first = np.ones(len(order), dtype=bool)
    first[1:] = owner[order][1:] != owner[order][:-1]
    number = np.empty(len(order), dtype=np.int64)
    number[order[first]] = owner[order[first]]
    number[order[~first]] = len(vertices) + np.arange(int((~first).sum()))
    part_of = np.concatenate((np.arange(len(vertices)), owner[order[~first]]))
    return SplitMesh(number[fan].reshape(-1, 3), part_of)
