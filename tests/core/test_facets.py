# SPDX-License-Identifier: GPL-3.0-or-later
"""Which meshes are made of flat faces only."""

from __future__ import annotations

import numpy as np
import pytest
from small_meshes import icosphere, moebius, plane

from cdrf_addon.core.curvature.facets import is_faceted
from cdrf_addon.core.curvature.tri_mesh import TriMesh

CORNERS = np.indices((2, 2, 2)).reshape(3, 8).T * 2.0 - 1.0
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
BOX = np.array([half for a, b, c, d in QUADS for half in ((a, b, c), (a, c, d))])


def turned(vertices: np.ndarray) -> np.ndarray:
    rotation, _ = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))
    return (vertices @ rotation * 3.0 + 7.0).astype(np.float32).astype(np.float64)


@pytest.mark.smoke
def test_planes_and_boxes_are() -> None:
    assert is_faceted(TriMesh.from_arrays(*plane(20)))
    assert is_faceted(TriMesh.from_arrays(CORNERS, BOX))
    assert is_faceted(TriMesh.from_arrays(turned(CORNERS), BOX))
    vertices, faces = plane(20)
    assert is_faceted(TriMesh.from_arrays(turned(vertices), faces))
    # Unwelded: a corner of each face for itself, as glTF has it.
    assert is_faceted(
        TriMesh.from_arrays(CORNERS[BOX].reshape(-1, 3), np.arange(36).reshape(-1, 3))
    )


@pytest.mark.smoke
@pytest.mark.parametrize("level", [1, 3, 6])
def test_balls_are_not_however_fine(level: int) -> None:
    assert not is_faceted(TriMesh.from_arrays(*icosphere(level)))


def test_doubled_and_flipped_faces_do_not_make_a_ball_flat() -> None:
    vertices, faces = icosphere(3)
    flipped = faces.copy()
    flipped[::2] = flipped[::2, ::-1]
    for other in (np.concatenate((faces, faces)), np.concatenate((faces, faces[:, ::-1])), flipped):
        assert not is_faceted(TriMesh.from_arrays(vertices, other))


def test_gentle_waves_and_twisted_strips_are_not() -> None:
    vertices, faces = plane(40)
    waves = vertices.copy()
    waves[:, 2] = 0.2 * np.sin(waves[:, 0] / 6.0)
    assert not is_faceted(TriMesh.from_arrays(waves, faces))
    assert not is_faceted(TriMesh.from_arrays(*moebius()))


@pytest.mark.smoke
def test_bad_meshes_are_left_to_those_who_can_tell() -> None:
    vertices, faces = plane(5)
    broken = vertices.copy()
    broken[3] = np.nan
    assert not is_faceted(TriMesh.from_arrays(broken, faces))
    assert not is_faceted(TriMesh.from_arrays(vertices * 0.0, faces))
    assert not is_faceted(TriMesh.from_arrays(vertices * 1e300, faces))
