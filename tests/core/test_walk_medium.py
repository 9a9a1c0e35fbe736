# SPDX-License-Identifier: GPL-3.0-or-later
"""Each subsurface method's medium: figures of Cycles' own, round trips, and the extremes."""

import math

import numpy as np
import pytest

from cdrf_addon.core.errors import ParameterError
from cdrf_addon.core.scattering.node_radius import BURLEY, LEGACY, RANDOM_WALK, SKIN
from cdrf_addon.core.walk.medium import METHODS, chiang, colour_of, medium, van_de_hulst

pytestmark = pytest.mark.smoke

TOLERANCE = {
    # The published coefficients have six figures: white and black miss 0 and 1 by so much.
    "van de hulst": 1e-4,
    # 4.20863^2 is 17.71257, not 17.7126: the root of the quadratic is that much off.
    "round trip": 1e-4,
    "exact": 1e-12,
}
COLOURS = np.array([0.0, 0.01, 0.05, 0.1, 0.34, 0.62, 0.8, 0.9, 0.97, 1.0])


def test_van_de_hulst_runs_from_black_to_white_and_back() -> None:
    s = van_de_hulst(COLOURS)
    assert abs(s[0] - 1.0) <= TOLERANCE["van de hulst"]
    assert abs(s[-1]) <= 2e-3  # of s; 1 - s^2 is off by 3e-6
    assert np.diff(s).max() < 0.0
    assert np.abs(colour_of(1.0 - s**2) - COLOURS)[:-1].max() <= TOLERANCE["round trip"]


def test_chiang_is_van_de_hulst_but_for_light_colours() -> None:
    dark = np.linspace(0.05, 0.7, 30)
    assert np.abs(chiang(dark) - (1.0 - van_de_hulst(dark) ** 2)).max() <= 4e-3
    # It makes up for the walks that are given up: 0.9 walks as 0.938 does.
    assert abs(float(colour_of(chiang(0.9))) - 0.938) <= 1e-3
    assert float(chiang(0.97)) == 0.999999


def test_paths_by_method() -> None:
    radius = 2.0
    assert np.array_equal(medium(RANDOM_WALK, COLOURS, radius).mean_free_path, np.full(10, radius))
    old = medium(LEGACY, COLOURS, radius).mean_free_path
    assert np.abs(old - radius / (4.0 * math.pi)).max() <= TOLERANCE["exact"]
    # A dipole whose albedo is 0.62 has a' = 0.957 or so: sqrt(3 (1 - a')) is a sixth.
    skin = medium(SKIN, COLOURS, radius).mean_free_path
    assert abs(skin[5] / radius - 0.169) <= 1e-3
    assert np.diff(skin).max() <= 0.0


def test_before_5_2_random_walk_was_what_is_legacy_now() -> None:
    before = medium(RANDOM_WALK, COLOURS, 1.0, 0.3, version=(4, 5))
    after = medium(LEGACY, COLOURS, 1.0, 0.3)
    assert before.method == LEGACY
    assert np.array_equal(before.single_scattering, after.single_scattering)
    assert medium(RANDOM_WALK, COLOURS, 1.0, -0.3, version=(4, 5)).anisotropy == 0.0


def test_similarity_keeps_the_colour_of_the_random_walk() -> None:
    for g in (-0.99, -0.5, 0.5, 0.9, 0.99):
        walk = medium(RANDOM_WALK, COLOURS[2:-1], 1.0, g)
        raised = walk.darkening < 1.0
        error = np.abs(walk.equivalent_colour - COLOURS[2:-1])[~raised]
        assert error.max() <= TOLERANCE["round trip"]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("g", [-5.0, -0.99, 0.0, 0.99, 5.0])
@pytest.mark.parametrize("ior", [0.5, 1.01, 3.8, 100.0])
def test_extremes_are_finite(method: str, g: float, ior: float) -> None:
    with np.errstate(all="raise", under="ignore"):
        walk = medium(method, COLOURS, [[0.0], [1e-9], [1e9]], g, 2.0, ior)
    for name in ("single_scattering", "mean_free_path", "first_scattering", "first_free_path"):
        values = getattr(walk, name)
        assert values.shape == (3, 10)
        assert np.isfinite(values).all(), name
        assert (values >= 0.0).all(), name
    assert walk.single_scattering.max() <= 1.0
    assert (walk.darkening <= 1.0).all()
    assert 0.0 <= walk.alpha <= 1.0
    assert walk.view_dependent == (method != BURLEY)


@pytest.mark.parametrize("method", [RANDOM_WALK, SKIN, LEGACY])
def test_lighter_colours_scatter_more(method: str) -> None:
    # The raised albedo of dark media is paid back by the darkening.
    colours = np.linspace(0.0, 1.0, 501)
    walk = medium(method, colours, 1.0)
    assert np.diff(walk.first_scattering * walk.darkening).min() >= 0.0


@pytest.mark.parametrize(
    ("colour", "radius", "g"), [(math.nan, 1.0, 0.0), (0.5, -1.0, 0.0), (0.5, 1.0, math.nan)]
)
def test_nonsense_is_refused_in_a_sentence(colour: float, radius: float, g: float) -> None:
    with pytest.raises(ParameterError, match=r"must be .*\.$"):
        medium(RANDOM_WALK, colour, radius, g)
