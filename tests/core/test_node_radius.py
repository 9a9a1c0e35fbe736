# SPDX-License-Identifier: GPL-3.0-or-later
"""Sigma0 from Blender's radius: against Burley's profile, Jensen's dipole and the study."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from cdrf_addon.core.scattering.dipole import Medium
from cdrf_addon.core.scattering.node_radius import BURLEY, ETA, LEGACY, SKIN, sigma0_per_radius

pytestmark = pytest.mark.smoke

STUDY = Path(__file__).resolve().parents[2] / "docs" / "results" / "data" / "model_choice.json"
TOLERANCE = {
    # Adaptive quadrature.
    "quadrature": 1e-6,
    # One number per albedo stands for radii of which the largest is five times the smallest.
    "measured": 0.55,
    # What that costs: error of the shading, over that of the best sigma0.
    "cost": 1.08,
}


@pytest.mark.parametrize("albedo", [0.05, 0.5, 0.8, 0.9, 1.0])
def test_burley_is_the_width_of_its_profile(albedo: float) -> None:
    d = 0.25 / math.pi / (1.9 - albedo + 3.5 * (albedo - 0.8) ** 2)

    def moment(power: int) -> float:
        def integrand(r: float) -> float:  # 2 pi r R(r), Christensen and Burley 2015, Eq. 2
            return r**power * (math.exp(-r / d) + math.exp(-r / (3.0 * d))) / (4.0 * d)

        return float(quad(integrand, 0.0, 150.0 * d, epsabs=0.0, limit=200)[0])

    expected = math.sqrt(moment(2) / moment(0) / 2.0)
    assert float(sigma0_per_radius(albedo, BURLEY)) == pytest.approx(
        expected, rel=TOLERANCE["quadrature"]
    )


@pytest.mark.parametrize("single", [0.3, 0.9, 0.99, 0.9999])
def test_the_skin_variant_is_scaled_by_the_dipoles_transport(single: float) -> None:
    medium = Medium(single, 1.0 - single, ETA)
    ratio = sigma0_per_radius(medium.albedo, SKIN) / sigma0_per_radius(medium.albedo)
    expected = math.sqrt(3.0 * (1.0 - single))
    assert float(ratio) == pytest.approx(expected, rel=TOLERANCE["quadrature"])


def test_it_grows_with_the_albedo_and_is_clamped() -> None:
    factors = sigma0_per_radius(np.linspace(0.0, 1.0, 101))
    assert (np.diff(factors) > 0.0).all()
    assert sigma0_per_radius(-1.0) == factors[0]
    assert sigma0_per_radius(7.0) == factors[-1]
    assert np.isfinite(sigma0_per_radius(np.linspace(0.0, 1.0, 11), SKIN)).all()
    assert sigma0_per_radius(0.9, LEGACY) < 0.1 * sigma0_per_radius(0.9)
    assert sigma0_per_radius([0.2, 0.9], "OF THE FUTURE").shape == (2,)


def test_it_is_near_the_best_on_a_path_traced_head() -> None:
    """On failure: ./dev bench model_choice, then core/scattering/node_radius.py."""
    rows = json.loads(STUDY.read_text())["albedos"]
    assert {row["albedo"] for row in rows} >= {0.5, 0.75, 0.9, 0.99}
    for row in rows:
        assert row["error clicked"] <= TOLERANCE["cost"] * row["error best"], row
        if row["albedo"] >= 0.5:  # below, hardly anything scatters, and the best is noise
            off = float(sigma0_per_radius(row["albedo"])) / row["best"] - 1.0
            assert abs(off) <= TOLERANCE["measured"], row
