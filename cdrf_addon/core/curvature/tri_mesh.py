# SPDX-License-Identifier: GPL-3.0-or-later
"""A triangle mesh as two arrays, exactly as Blender hands it over, and the types of such arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..errors import MeshError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Points = NDArray[np.float64]
    Indices = NDArray[np.int64]
    Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class TriMesh:
    """A triangle mesh as plain arrays; nothing but their shapes is checked.

    Raises:
        MeshError: The arrays do not have the shape of a mesh.
    """

    vertices: Points
    """(n, 3) positions, float64, any unit of length."""
    triangles: Indices
    """(m, 3) vertex indices, int64."""

    def __post_init__(self) -> None:
        if self.vertices.ndim != 2 or self.vertices.shape[1] != 3:
            raise MeshError(f"Vertices must have the shape (n, 3), not {self.vertices.shape}.")
        if self.triangles.ndim != 2 or self.triangles.shape[1] != 3:
            raise MeshError(f"Triangles must have the shape (m, 3), not {self.triangles.shape}.")
        if self.triangles.size and not (
            self.triangles.min() >= 0 and self.triangles.max() < len(self.vertices)
        ):
            raise MeshError(
                f"A triangle names a vertex that does not exist (there are {len(self.vertices)})."
            )

    @classmethod
    def from_arrays(cls, vertices: ArrayLike, triangles: ArrayLike) -> TriMesh:
        """Convert anything array-like to float64 vertices and int64 triangles."""
        return cls(
            np.ascontiguousarray(vertices, dtype=np.float64),
            np.ascontiguousarray(triangles, dtype=np.int64),
        )
