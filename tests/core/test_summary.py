# SPDX-License-Identifier: GPL-3.0-or-later
"""What a mesh's curvature amounts to: surfaces known to be flat, of one curvature, or of many."""

import math

import numpy as np
import pytest
from small_meshes import grid_triangles, icosphere, plane

from cdrf_addon.core.curvature.field import CurvatureField, principal_curvatures
from cdrf_addon.core.curvature.summary import CONSTANT, FLAT, VARYING, CurvatureSummary, summarise
from cdrf_addon.core.curvature.tri_mesh import TriMesh

pytestmark = pytest.mark.smoke

TOLERANCE = {
    # The fit's bias on an icosphere, worst vertex (tests/core/test_field.py), rounded up.
    "subdivision 4": 7e-3,
    "subdivision 5": 2e-3,
    # A cylinder of 128 segments: 0.25 % of 1 / r measured in k1 at its open ends, 0.23 % in kappa.
    "cylinder": 4e-3,
    # 24 segments around the small circle: the fit is 6.3 % high there.
    "torus": 7.5e-2,
    # The same mesh at another scale: rounding of the fit.
    "scale": 1e-11,
}
SCALES = [1e-300, 1e-200, 1e-38, 1e-6, 1.0, 1e6, 1e38, 1e200, 1e300]


def summary_of(vertices: np.ndarray, faces: np.ndarray) -> CurvatureSummary:
    mesh = TriMesh.from_arrays(vertices, faces)
    result = summarise(mesh, principal_curvatures(mesh))
    assert 0.0 <= result.low <= result.median <= result.high
    assert np.isfinite((result.low, result.high, *result.mean_values)).all()
    return result


def tube(rows: int, columns: int, *, length: float) -> tuple[np.ndarray, np.ndarray]:
    """A cylinder of radius 1 without caps, wound outwards."""
    around, along = (axis.ravel() for axis in np.indices((rows, columns)).astype(np.float64))
    around *= 2.0 * math.pi / rows
    along *= length / (columns - 1)
    vertices = np.stack((np.cos(around), np.sin(around), along), 1)
    return vertices, grid_triangles(rows, columns, wrap=(True, False))


def doughnut() -> tuple[np.ndarray, np.ndarray]:
    """A torus of radii 1 and 0.3."""
    u, v = (axis.ravel() for axis in np.indices((64, 24)).astype(np.float64))
    u, v = u * 2.0 * math.pi / 64.0, v * 2.0 * math.pi / 24.0
    out = 1.0 + 0.3 * np.cos(v)
    vertices = np.stack((out * np.cos(u), out * np.sin(u), 0.3 * np.sin(v)), 1)
    return vertices, grid_triangles(64, 24, wrap=(True, True))


def turned(vertices: np.ndarray) -> np.ndarray:
    turn, _ = np.linalg.qr(np.random.default_rng(23).normal(size=(3, 3)))
    return vertices @ turn


@pytest.mark.parametrize("scale", SCALES)
def test_a_plane_is_flat(scale: float) -> None:
    vertices, faces = plane()
    assert summary_of(vertices * scale, faces).kind == FLAT
    assert summary_of(turned(vertices) * scale, faces).kind == FLAT


def test_a_plane_stored_in_float32_is_flat() -> None:
    vertices, faces = plane(60)
    assert summary_of(turned(vertices).astype(np.float32), faces).kind == FLAT


def test_a_plane_with_one_vertex_flown_off_is_flat() -> None:
    vertices, faces = plane()
    far = np.vstack((vertices, (0.0, 0.0, 1e12)))
    assert summary_of(far, np.vstack((faces, (0, 1, len(vertices))))).kind == FLAT


def test_a_slight_bend_is_not_flat() -> None:
    vertices, faces = plane()
    # A sagitta of 0.5 % of the width: kappa times the width is 0.04.
    bent = vertices.copy()
    bent[:, 2] = 0.005 * 19.0 * (2.0 * vertices[:, 0] / 19.0 - 1.0) ** 2
    result = summary_of(bent, faces)
    assert result.kind != FLAT
    # z = h (2 x / w - 1)^2 has k1 = 8 h / w^2, and kappa is that over sqrt(2).
    assert result.median == pytest.approx(8.0 * 0.005 / 19.0 / math.sqrt(2.0), rel=0.01)


@pytest.mark.parametrize("subdivisions", [4, 5])
@pytest.mark.parametrize("radius", [1e-3, 1.0, 250.0])
def test_a_sphere_has_one_curvature(subdivisions: int, radius: float) -> None:
    vertices, faces = icosphere(subdivisions)
    result = summary_of(radius * vertices + 3.0 * radius, faces)
    assert result.kind == CONSTANT
    allowed = TOLERANCE[f"subdivision {subdivisions}"]
    assert np.asarray(result.mean_values) * radius == pytest.approx(np.ones(4), abs=allowed)
    assert result.low * radius == pytest.approx(1.0, abs=allowed)
    assert result.high * radius == pytest.approx(1.0, abs=allowed)


def test_the_inside_of_a_sphere_has_one_negative_curvature() -> None:
    vertices, faces = icosphere(4)
    result = summary_of(vertices, faces[:, ::-1])
    assert result.kind == CONSTANT
    kappa, k1, k2, mean = result.mean_values
    allowed = TOLERANCE["subdivision 4"]
    assert (kappa, k1, k2, mean) == pytest.approx((1.0, -1.0, -1.0, -1.0), abs=allowed)


def test_loose_vertices_do_not_count() -> None:
    vertices, faces = icosphere(4)
    loose = np.vstack((vertices, np.full((900, 3), 40.0), np.full((5, 3), math.nan)))
    one, other = summary_of(vertices, faces), summary_of(loose, faces)
    assert other == one


def test_a_cylinder_without_caps_has_one_curvature() -> None:
    result = summary_of(*tube(128, 64, length=3.0))
    assert result.kind == CONSTANT
    kappa, k1, k2, mean = result.mean_values
    allowed = TOLERANCE["cylinder"]
    assert (kappa, k1) == pytest.approx((math.sqrt(0.5), 1.0), abs=allowed)
    assert (k2, mean) == pytest.approx((0.0, 0.5), abs=allowed)


@pytest.mark.parametrize("scale", SCALES)
def test_a_torus_and_an_ellipsoid_vary(scale: float) -> None:
    torus = summary_of(*doughnut())
    ball, faces = icosphere(4)
    egg = ball * (1.0, 1.0, 1.2)
    for mesh, base in ((doughnut(), torus), ((egg, faces), summary_of(egg, faces))):
        scaled = summary_of(mesh[0] * scale, mesh[1])
        assert scaled.kind == base.kind == VARYING
        assert scaled.median * scale == pytest.approx(base.median, rel=TOLERANCE["scale"])
        assert scaled.high * scale == pytest.approx(base.high, rel=TOLERANCE["scale"])
        got = np.asarray(scaled.mean_values) * scale
        assert got == pytest.approx(np.asarray(base.mean_values), rel=TOLERANCE["scale"])


def test_the_range_of_a_torus() -> None:
    torus = summary_of(*doughnut())
    # k1 is 1 / 0.3 everywhere; kappa adds the square of k2, at most 1 / 0.7, on the inside.
    low, high = (math.hypot(1.0 / 0.3, k2) / math.sqrt(2.0) for k2 in (0.0, 1.0 / 0.7))
    assert low <= torus.low <= low * (1.0 + TOLERANCE["torus"])
    assert high <= torus.high <= high * (1.0 + TOLERANCE["torus"])


# --- on fields made by hand ---------------------------------------------------------------------


def by_hand(k1: np.ndarray, k2: np.ndarray) -> CurvatureSummary:
    """Summarise given curvatures on a strip of triangles of unit size."""
    count = len(k1)
    at = np.arange(count)
    vertices = np.stack((at * 0.5, at % 2.0, 0.0 * at), 1)
    faces = np.arange(count - 2)[:, None] + np.arange(3)
    field = CurvatureField(k1, k2, np.zeros(count, dtype=bool))
    return summarise(TriMesh.from_arrays(vertices, faces), field)


def test_one_spike_does_not_move_the_usual_range() -> None:
    kappa = np.full(1000, 2.0)
    kappa[500] = 1e9
    result = by_hand(kappa, kappa)
    assert result.kind == VARYING
    assert (result.low, result.median, result.high) == pytest.approx((2.0, 2.0, 2.0))


def test_the_range_is_the_percentiles() -> None:
    kappa = np.random.default_rng(29).permutation(np.arange(1.0, 1002.0))
    result = by_hand(kappa, kappa)
    assert (result.low, result.median, result.high) == pytest.approx((51.0, 501.0, 951.0))
    assert result.mean_values == pytest.approx((501.0, 501.0, 501.0, 501.0))


def test_the_means_are_in_the_order_of_the_attribute() -> None:
    result = by_hand(np.full(100, 3.0), np.full(100, -1.0))
    assert result.mean_values == pytest.approx((math.sqrt(5.0), 3.0, -1.0, 1.0))
    assert result.kind == CONSTANT


def test_equal_kappa_of_unequal_directions_is_not_constant() -> None:
    # Half a dome (2, 0), half a saddle (sqrt 2, -sqrt 2): kappa is the same, the mean is not.
    k1 = np.repeat((2.0, math.sqrt(2.0)), 50)
    k2 = np.repeat((0.0, -math.sqrt(2.0)), 50)
    assert by_hand(k1, k2).kind == VARYING


@pytest.mark.parametrize(("spread", "kind"), [(0.009, CONSTANT), (0.011, VARYING)])
def test_constant_means_within_half_a_percent(spread: float, kind: str) -> None:
    kappa = np.linspace(1.0 - spread / 2.0, 1.0 + spread / 2.0, 101)
    assert by_hand(kappa, kappa).kind == kind


def test_no_curvature_at_all_is_flat() -> None:
    assert by_hand(np.zeros(50), np.zeros(50)).kind == FLAT
