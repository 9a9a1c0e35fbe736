# SPDX-License-Identifier: GPL-3.0-or-later
"""Winding: neighbouring faces are turned so that all show the same side."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .topology import edge_pairs, half_edges, runs_twice

if TYPE_CHECKING:
    from .tri_mesh import Indices, Mask


@dataclass(frozen=True)
class OrientedMesh:
    """Faces that are wound alike wherever that is possible."""

    triangles: Indices
    """(m, 3) vertex indices."""
    seam: Mask
    """(n,) True at edges whose faces cannot be wound alike (the seam of a Möbius strip)."""
    flipped_faces: int = 0
    """How many faces were turned round."""
    non_orientable: bool = False
    """Whether a component has no outside."""


def orient(triangles: Indices, vertex_count: int) -> OrientedMesh:
    """Wind neighbouring faces alike; the larger part of each component keeps its side.

    Consistency is two-colouring the graph of faces: each face is in it twice, as it is and
    flipped, joined to its neighbours so that only consistent windings meet. A face that meets its
    own mirror image lies on a surface without an outside.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    seam = np.zeros(vertex_count, dtype=bool)
    if not runs_twice(triangles, vertex_count):
        return OrientedMesh(triangles, seam)
    count = len(triangles)
    tail, head = half_edges(triangles)
    # Only edges of exactly two faces determine a winding.
    edge, twin = edge_pairs(triangles, vertex_count)
    one, other, alike = edge // 3, twin // 3, tail[edge] == tail[twin]
    if not alike.any():
        return OrientedMesh(triangles, seam)

    mirror = np.where(alike, count, 0)
    rows = np.concatenate((one, one + count))
    columns = np.concatenate((other + mirror, other + count - mirror))
    graph = coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), (2 * count, 2 * count))
    _, label = connected_components(graph, directed=False)
    as_is, flipped = label[:count], label[count:]
    non_orientable = bool((as_is == flipped).any())
    # Of a component and its mirror image, take the one that holds more faces as they are.
    kept = np.bincount(as_is, minlength=int(label.max()) + 1)
    flip = (kept[flipped] > kept[as_is]) | ((kept[flipped] == kept[as_is]) & (flipped < as_is))
    flip &= as_is != flipped
    # Edges that are still alike after that have no consistent winding at all.
    torn = edge[alike ^ flip[one] ^ flip[other]]
    seam[tail[torn]] = seam[head[torn]] = True
    turned = np.where(flip[:, None], triangles[:, ::-1], triangles)
    return OrientedMesh(turned, seam, int(flip.sum()), non_orientable)
