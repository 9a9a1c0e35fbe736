# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh as arrays: which shapes are refused, and which types are converted."""

import numpy as np
import pytest
from small_meshes import icosphere, plane

from cdrf_addon.core.curvature.clean import clean
from cdrf_addon.core.curvature.tri_mesh import TriMesh
from cdrf_addon.core.errors import MeshError


def test_a_quad_mesh_with_the_vertices_of_a_triangle_mesh_is_refused() -> None:
    # libigl itself takes four columns without a word and computes garbage.
    vertices, _ = plane(4)
    with pytest.raises(MeshError, match="shape"):
        TriMesh.from_arrays(vertices, [(0, 4, 5, 1), (1, 5, 6, 2)])


def test_other_types_are_converted() -> None:
    vertices, faces = icosphere(1)
    mesh = TriMesh.from_arrays(
        np.asfortranarray(vertices.astype(np.float32)), faces.astype(np.uint32).tolist()
    )
    assert mesh.vertices.dtype == np.float64
    assert mesh.triangles.dtype == np.int64
    assert mesh.vertices.flags.c_contiguous
    assert len(clean(mesh).triangles) == len(faces)
