# SPDX-License-Identifier: GPL-3.0-or-later
"""Cleaning a mesh: what is merged, left out, turned round, refused, and the way back."""

import math
import re

import numpy as np
import pytest
from numpy.typing import ArrayLike
from small_meshes import icosphere, moebius, unweld

from cdrf_addon.core.curvature.clean import EDGE_LIMIT, CleanMesh, clean, weld
from cdrf_addon.core.curvature.topology import edge_lengths
from cdrf_addon.core.curvature.tri_mesh import TriMesh
from cdrf_addon.core.errors import MeshError

TOLERANCE = {
    # Normalised coordinates are of size 1 to 100 and see four roundings of 1.1e-16.
    "coordinates": 1e-12,
    # The same mesh at another scale, relative: the scale itself is rounded once.
    "scale": 1e-14,
}


def volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    """Signed volume of a closed mesh: positive if its faces are wound outwards."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)


def windings(faces: np.ndarray) -> np.ndarray:
    """Faces as a set of rows, each turned so that its least vertex comes first."""
    turned = np.stack([np.roll(face, -int(face.argmin())) for face in faces])
    return turned[np.lexsort(turned.T)]


def cleaned(vertices: ArrayLike, faces: ArrayLike) -> CleanMesh:
    """Clean plain arrays, and hold what holds for every clean mesh."""
    mesh = TriMesh.from_arrays(vertices, faces)
    before = mesh.vertices.copy(), mesh.triangles.copy()
    result = clean(mesh)
    assert np.array_equal(mesh.vertices, before[0], equal_nan=True)
    assert np.array_equal(mesh.triangles, before[1])
    assert np.isfinite(result.vertices).all()
    assert np.array_equal(np.unique(result.triangles), np.arange(len(result.vertices)))
    assert result.source.shape == (len(mesh.vertices),)
    assert result.source.min() >= -1
    assert set(result.source[result.source >= 0]) == set(range(len(result.vertices)))
    return result


# --- a good mesh --------------------------------------------------------------------------------


@pytest.mark.smoke
def test_a_good_mesh_is_only_moved_and_scaled() -> None:
    vertices, faces = icosphere(2)
    result = cleaned(3.0 * vertices + (5.0, -7.0, 11.0), faces)
    assert np.array_equal(windings(result.triangles), windings(result.source[faces]))
    assert np.array_equal(np.sort(result.source), np.arange(len(vertices)))
    assert result.report.sentences() == []
    assert result.report.welded_vertices == 0
    assert result.edge == pytest.approx(3.0 * np.median(edge_lengths(vertices, faces)))
    back = result.vertices[result.source]
    back = (back - back[0]) * result.edge
    assert np.abs(back - 3.0 * (vertices - vertices[0])).max() <= TOLERANCE["coordinates"]
    assert np.median(edge_lengths(result.vertices, result.triangles)) == pytest.approx(1.0)


@pytest.mark.smoke
@pytest.mark.parametrize("exponent", [-300, -200, -38, -12, -3, 3, 12, 38, 200, 300])
def test_scale_is_taken_out(exponent: int) -> None:
    vertices, faces = icosphere(1)
    one, other = cleaned(vertices, faces), cleaned(vertices * 10.0**exponent, faces)
    assert np.abs(other.vertices - one.vertices).max() <= TOLERANCE["coordinates"]
    assert other.edge / 10.0**exponent == pytest.approx(one.edge, rel=TOLERANCE["scale"])
    assert np.array_equal(other.triangles, one.triangles)


# --- welding ------------------------------------------------------------------------------------


@pytest.mark.smoke
def test_weld_merges_equal_positions_and_numbers_by_first_appearance() -> None:
    points = np.array([(1.0, 2, 3), (0, 0, 0), (1, 2, 3), (-0.0, 0, -0.0), (1, 2, 4), (0, 0, 0)])
    welding = weld(points)
    assert welding.group.tolist() == [0, 1, 0, 1, 2, 1]
    assert welding.first.tolist() == [0, 1, 4]


def test_weld_merges_nothing_that_differs_in_the_last_bit() -> None:
    base = np.full((4, 3), 1.0)
    for axis in range(3):
        base[axis + 1, axis] = math.nextafter(1.0, 2.0)
    welding = weld(base)
    assert welding.group.tolist() == welding.first.tolist() == [0, 1, 2, 3]
    tiny = np.array([(0.0, 0, 0), (5e-324, 0, 0), (-5e-324, 0, 0)])
    assert weld(tiny).group.tolist() == [0, 1, 2]


def test_weld_keeps_what_is_not_a_number_apart_from_numbers() -> None:
    nan, inf = math.nan, math.inf
    points = np.array([(0.0, 0, 0), (nan, 0, 0), (inf, 0, 0), (-inf, 0, 0), (0, nan, 0)])
    welding = weld(points)
    assert welding.group.tolist() == welding.first.tolist() == [0, 1, 2, 3, 4]
    assert weld(points[[1, 0, 1]]).group.tolist() == [0, 1, 0]


def test_weld_is_not_fooled_by_regular_numbers() -> None:
    # Grids, powers of two and swapped axes are what weak hashes collide on.
    axis = np.concatenate((np.arange(-8.0, 9.0), 2.0 ** np.arange(-20, -3)))
    points = np.stack(np.meshgrid(axis, axis, axis), -1).reshape(-1, 3)
    welding = weld(points)
    assert np.array_equal(welding.group, np.arange(len(points)))
    assert np.array_equal(welding.first, np.arange(len(points)))


def test_weld_takes_no_points() -> None:
    welding = weld(np.zeros((0, 3)))
    assert welding.group.shape == welding.first.shape == (0,)


@pytest.mark.smoke
def test_an_unwelded_copy_cleans_to_the_same_mesh() -> None:
    vertices, faces = icosphere(2)
    loose, corners, original = unweld(vertices, faces)
    one, other = cleaned(vertices, faces), cleaned(loose, corners)
    assert np.array_equal(other.vertices, one.vertices)
    assert np.array_equal(windings(other.triangles), windings(one.triangles))
    assert np.array_equal(other.source, one.source[original])
    assert other.report.welded_vertices == len(loose) - len(vertices)
    assert other.report.sentences() == []


# --- faces that are left out --------------------------------------------------------------------


def test_faces_twice_on_the_same_vertices_are_used_once() -> None:
    vertices, faces = icosphere(1)
    rolled, reversed_ = np.roll(faces[:7], 1, axis=1), faces[7:12, ::-1]
    result = cleaned(vertices, np.concatenate((faces, faces[:5], rolled, reversed_)))
    assert np.array_equal(windings(result.triangles), windings(result.source[faces]))
    assert result.report.duplicate_faces == 17
    assert result.report.sentences() == ["17 faces lie twice on the same vertices; used once."]


def test_faces_without_area_are_left_out() -> None:
    vertices, faces = icosphere(1)
    middle = (vertices[faces[0, 0]] + vertices[faces[0, 1]]) / 2.0
    extra = np.vstack((vertices, middle, vertices[3]))
    at = len(vertices)
    bad = [(2, 2, 5), (4, 4, 4), (faces[0, 0], faces[0, 1], at), (3, at + 1, 9)]
    result = cleaned(extra, np.concatenate((bad, faces)))
    assert result.report.degenerate_faces == 4
    assert np.array_equal(windings(result.source[faces]), windings(result.triangles))
    assert result.source[at] == -1
    assert result.source[at + 1] == result.source[3]
    assert result.report.sentences() == ["4 faces have no area; ignored."]


def test_faces_to_a_vertex_that_has_flown_off_are_left_out() -> None:
    vertices, faces = icosphere(2)
    for far in (10.0 * EDGE_LIMIT, 1e38, 1e300, np.finfo(np.float64).max):
        moved = vertices.copy()
        moved[0] = (far, -far, 0.0)
        result = cleaned(moved, faces)
        touching = (faces == 0).any(axis=1)
        assert result.report.stray_faces == touching.sum() == 5
        assert len(result.triangles) == (~touching).sum()
        assert result.source[0] == -1
        # The rest keeps its unit: one edge in a thousand says nothing about the median.
        assert result.edge == pytest.approx(np.median(edge_lengths(vertices, faces)), rel=0.05)
    near = vertices.copy()
    near[0] *= 1e3
    assert cleaned(near, faces).report.stray_faces == 0


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_vertices_at_infinity_or_nowhere_are_left_out(value: float) -> None:
    vertices, faces = icosphere(2)
    broken = vertices.copy()
    broken[0, 1] = value
    result = cleaned(broken, faces)
    assert result.report.non_finite_vertices == 1
    assert len(result.triangles) == len(faces) - 5
    assert result.source[0] == -1
    assert result.report.sentences() == [
        "1 vertices lie at infinity or nowhere (NaN); ignored.",
    ]


def test_a_vertex_nowhere_is_not_taken_for_one_at_the_origin() -> None:
    vertices, faces = icosphere(2)
    # The artist's origin is on the surface; two loose vertices are nowhere.
    vertices = np.vstack((vertices - vertices[5], np.full((2, 3), math.nan)))
    result = cleaned(vertices, faces)
    assert result.source[-2:].tolist() == [-1, -1]
    assert result.report.welded_vertices == 0


@pytest.mark.smoke
def test_loose_vertices_belong_to_nothing() -> None:
    vertices, faces = icosphere(1)
    loose = np.vstack(((50.0, 0.0, 0.0), vertices, (0.0, 0.0, 90.0), vertices[4]))
    result = cleaned(loose, faces + 1)
    assert result.source[0] == result.source[-2] == -1
    # A loose vertex exactly on the surface is one with the vertex that is there.
    assert result.source[-1] == result.source[5]
    assert len(result.vertices) == len(vertices)


# --- winding ------------------------------------------------------------------------------------


@pytest.mark.smoke
@pytest.mark.parametrize("part", [0.05, 0.3, 0.45])
def test_faces_turned_round_are_turned_back(part: float) -> None:
    vertices, faces = icosphere(3)
    turned = np.random.default_rng(7).random(len(faces)) < part
    result = cleaned(vertices, np.where(turned[:, None], faces[:, ::-1], faces))
    assert result.report.flipped_faces == turned.sum()
    assert not result.report.non_orientable
    assert np.array_equal(windings(result.triangles), windings(result.source[faces]))
    assert volume(result.vertices, result.triangles) > 0.0


def test_half_of_the_faces_turned_round_still_give_one_side() -> None:
    vertices, faces = icosphere(3)
    half = np.arange(len(faces)) % 2 == 0
    result = cleaned(vertices, np.where(half[:, None], faces[:, ::-1], faces))
    whole = abs(volume(result.vertices, result.source[faces]))
    assert abs(volume(result.vertices, result.triangles)) == pytest.approx(whole)
    assert result.report.flipped_faces == len(faces) // 2


def test_each_piece_keeps_the_side_of_most_of_its_faces() -> None:
    vertices, faces = icosphere(2)
    rng = np.random.default_rng(11)
    pieces, wound = [], []
    # Most faces outwards, most inwards, all outwards, all inwards.
    for i, part in enumerate((0.3, 0.7, 0.0, 1.0)):
        turned = rng.random(len(faces)) < part
        pieces.append(vertices + np.array((10.0 * i, 0.0, 0.0)))
        wound.append(np.where(turned[:, None], faces[:, ::-1], faces) + i * len(vertices))
    result = cleaned(np.concatenate(pieces), np.concatenate(wound))
    for i, sign in enumerate((1.0, -1.0, 1.0, -1.0)):
        of_piece = result.triangles[i * len(faces) : (i + 1) * len(faces)]
        centred = result.vertices - result.vertices[of_piece].mean(axis=(0, 1))
        assert volume(centred, of_piece) * sign > 0.0
    assert not result.report.non_orientable


@pytest.mark.smoke
def test_a_moebius_strip_is_told() -> None:
    vertices, faces = moebius()
    result = cleaned(vertices, faces)
    assert result.report.non_orientable
    assert len(result.triangles) == len(faces)
    assert any("Möbius" in line for line in result.report.sentences())
    # A plain band of the same size is no such thing.
    open_band = faces[(faces < 8).sum(axis=1) == 0]
    assert not cleaned(vertices, open_band).report.non_orientable


def test_edges_of_three_faces_say_nothing_about_winding() -> None:
    # Three fins on one edge cannot be wound alike; each stays as it is.
    angles = np.arange(3) * 2.0 * math.pi / 3.0
    fins = np.stack((np.cos(angles), np.sin(angles), np.zeros(3)), 1)
    vertices = np.vstack(((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), fins))
    faces = np.array([(0, 1, 2), (0, 1, 3), (1, 0, 4)])
    result = cleaned(vertices, faces)
    assert np.array_equal(windings(result.triangles), windings(result.source[faces]))
    assert result.report.flipped_faces == 0
    assert not result.report.non_orientable


# --- refusals -----------------------------------------------------------------------------------

TRIANGLE = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
NO_POINTS, NO_FACES = np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)


@pytest.mark.smoke
@pytest.mark.parametrize(
    ("vertices", "faces", "words"),
    [
        (NO_POINTS, NO_FACES, "no vertices"),
        (TRIANGLE, NO_FACES, "no faces"),
        (np.full((3, 3), math.nan), [(0, 1, 2)], "infinity or nowhere"),
        (np.full((3, 3), 4.0), [(0, 1, 2)], "shrink to one point"),
        (np.array([(0.0, 0, 0), (0, 0, 0), (1, 1, 1)]), [(0, 0, 0), (2, 2, 2)], "shrink to points"),
        (TRIANGLE, [(0, 1, 1)], "no area"),
        (np.array([(0.0, 0, 0), (1, 1, 1), (3, 3, 3)]), [(0, 1, 2)], "no area"),
        (TRIANGLE * 1e-310, [(0, 1, 2)], "outside what numbers can hold"),
        (TRIANGLE, [(0, 1, 3)], "does not exist"),
        (TRIANGLE, [(0, 1, -1)], "does not exist"),
        (NO_POINTS, [(0, 1, 2)], "does not exist"),
        (TRIANGLE[:, :2], [(0, 1, 2)], "shape"),
        (TRIANGLE.T[:, :2], [(0, 1, 2)], "shape"),
        (TRIANGLE.ravel(), [(0, 1, 2)], "shape"),
        (TRIANGLE, [(0, 1)], "shape"),
        (TRIANGLE, [(0, 1, 2, 0)], "shape"),
        (TRIANGLE, [0, 1, 2], "shape"),
        ([], [], "shape"),
    ],
)
def test_what_cannot_be_used_is_refused_in_a_sentence(
    vertices: ArrayLike, faces: ArrayLike, words: str
) -> None:
    with pytest.raises(MeshError) as refusal:
        clean(TriMesh.from_arrays(vertices, faces))
    text = str(refusal.value)
    assert words in text
    assert re.fullmatch(r"[A-Z].*\.", text)
