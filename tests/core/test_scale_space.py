# SPDX-License-Identifier: GPL-3.0-or-later
"""Curvature at diffusion lengths: the same shape has the same, however it is divided or noisy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree
from small_meshes import plane
from surfaces import ellipsoid, noisy, torus

from cdrf_addon.core.curvature.field import curvature_steps
from cdrf_addon.core.curvature.scale_space import LEVEL_RATIO, LEVELS, KappaLevels, level_steps
from cdrf_addon.core.curvature.tri_mesh import TriMesh
from cdrf_addon.core.progress import run_steps

# Difference between the shortest levels of 2,000 and 60,000 vertices, in units of the mean kappa:
# the coarse mesh's own error of curvature, some percent.
RESOLUTION = 0.06
# Of the diffused levels of a scan with noise of 5 % of an edge, in the same unit.
NOISE = 0.2


def levels_of(vertices: np.ndarray, faces: np.ndarray) -> KappaLevels:
    return run_steps(
        level_steps(run_steps(curvature_steps(TriMesh.from_arrays(vertices, faces))))
    ).kappa


@pytest.mark.smoke
def test_lengths_follow_the_size() -> None:
    surface = torus(2_000)
    one = levels_of(surface.vertices, surface.triangles)
    other = levels_of(surface.vertices * 1e-3, surface.triangles)
    area = 4.0 * np.pi**2 * 0.4
    assert one.shortest[0] == pytest.approx(np.sqrt(area) / LEVEL_RATIO**LEVELS, rel=0.01)
    assert other.shortest == pytest.approx(one.shortest * 1e-3, rel=1e-9)
    assert other.values == pytest.approx(one.values * 1e3, rel=1e-6)


@pytest.mark.parametrize("make", [torus, ellipsoid])
def test_the_same_shape_has_the_same_levels_at_any_resolution(make) -> None:
    few, many = make(2_000), make(60_000)
    coarse = levels_of(few.vertices, few.triangles)
    fine = levels_of(many.vertices, many.triangles)
    at = cKDTree(many.vertices).query(few.vertices)[1]
    scale = fine.values.mean()
    for level in range(LEVELS):
        apart = coarse.values[:, level] - fine.values[at, level]
        assert np.sqrt((apart**2).mean()) <= RESOLUTION * scale, level
    assert coarse.shortest[0] == pytest.approx(fine.shortest[0], rel=0.01)


@pytest.mark.smoke
def test_between_the_levels() -> None:
    levels = KappaLevels(np.array([[4.0, 3.0, 1.0, 0.5]]), np.array([0.1]))
    middle = 0.1 * np.sqrt(LEVEL_RATIO)
    lengths = (0.0, 0.05, 0.1, middle, 0.1 * LEVEL_RATIO, 0.1 * LEVEL_RATIO**3, 1e9)
    found = [float(levels.at(length)[0]) for length in lengths]
    assert found == pytest.approx([4.0, 4.0, 4.0, 3.5, 3.0, 0.5, 0.5])


def test_noise_averages_out() -> None:
    clean = torus(40_000)
    scan = noisy(clean, 0.05, np.random.default_rng(4))
    mesh = TriMesh.from_arrays(scan.vertices, scan.triangles)
    measured = run_steps(curvature_steps(mesh))
    levels = run_steps(level_steps(measured)).kappa
    exact = levels_of(clean.vertices, clean.triangles).values
    raw = np.abs(measured.on_source().kappa - clean.kappa)
    scale = clean.kappa.mean()
    # Vertices moved by 5 % of an edge: kappa itself means nothing any more ...
    assert np.sqrt((raw**2).mean()) >= 0.9 * scale
    # ... but over 4 and more edges it does.
    for level in range(1, LEVELS):
        apart = levels.values[:, level] - exact[:, level]
        assert np.sqrt((apart**2).mean()) <= NOISE * scale


def test_other_components_and_stray_vertices_do_not_matter() -> None:
    surface = torus(3_000)
    alone = levels_of(surface.vertices * 0.1, surface.triangles)
    floor, faces = plane(60)
    both = levels_of(
        np.concatenate((surface.vertices * 0.1, floor + 5.0)),
        np.concatenate((surface.triangles, faces + len(surface.vertices))),
    )
    count = len(surface.vertices)
    assert both.shortest[:count] == pytest.approx(alone.shortest, rel=1e-9)
    assert both.values[:count] == pytest.approx(alone.values, rel=1e-3)
    flown = surface.vertices * 0.1
    flown[17] *= 1e4
    stray = levels_of(flown, surface.triangles)
    assert stray.shortest[0] == pytest.approx(alone.shortest[0], rel=0.15)
