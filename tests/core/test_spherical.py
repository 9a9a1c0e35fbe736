# SPDX-License-Identifier: GPL-3.0-or-later
"""Which meshes are taken for spherical, and the exact curvature that they get."""

import numpy as np
import pytest
from small_meshes import ellipsoid, icosphere, plane, torus, uv_sphere

from cdrf_addon.core.curvature.spherical import curvature_if_spherical
from cdrf_addon.core.curvature.tri_mesh import TriMesh

pytestmark = pytest.mark.smoke


@pytest.mark.parametrize("radius", [1e-3, 1.0, 250.0])
def test_a_sphere_of_any_size_and_place_gets_one_over_r(radius: float) -> None:
    for vertices, faces in (icosphere(2), uv_sphere(32, 16)):
        placed = radius * (vertices + np.array((3.0, -2.0, 1.0)))
        found = curvature_if_spherical(TriMesh.from_arrays(placed, faces))
        assert found is not None
        assert found.k1 == pytest.approx(np.full(len(vertices), 1.0 / radius), rel=1e-12)
        assert np.array_equal(found.k1, found.k2)
        assert not found.filled.any()


def test_part_of_a_sphere_counts_and_loose_vertices_are_flat() -> None:
    vertices, faces = icosphere(3)
    cap = faces[(vertices[faces][..., 2] > 0.2).all(axis=1)]
    found = curvature_if_spherical(TriMesh.from_arrays(vertices, cap))
    assert found is not None
    used = np.isin(np.arange(len(vertices)), cap)
    assert found.k1 == pytest.approx(np.where(used, 1.0, 0.0), rel=1e-12)


def test_a_sphere_seen_from_inside_is_negative() -> None:
    vertices, faces = icosphere(2)
    found = curvature_if_spherical(TriMesh.from_arrays(vertices, faces[:, ::-1]))
    assert found is not None
    assert found.k2 == pytest.approx(np.full(len(vertices), -1.0), rel=1e-12)


def test_other_meshes_are_not_spherical() -> None:
    bumpy, faces = icosphere(4)
    bumpy = bumpy.copy()
    bumpy[100] *= 1.01
    others = [plane(), ellipsoid(3, irregular=False)[:2], torus(4, irregular=False)[:2]]
    for vertices, triangles in (*others, (bumpy, faces)):
        assert curvature_if_spherical(TriMesh.from_arrays(vertices, triangles)) is None
