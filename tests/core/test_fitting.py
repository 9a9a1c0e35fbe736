# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits of one model to one sphere recover the width and gain that made the data."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cdrf_addon.core.measured.fitting import MODELS, ModelFitter
from cdrf_addon.core.measured.measurement import equator_weights
from cdrf_addon.core.reflectance.ring_model import ring_reflectance

SEED = 20111106
COSINE = np.linspace(-0.96, 0.96, 72)
THETA = np.arccos(COSINE)


@pytest.mark.parametrize("name", list(MODELS))
@pytest.mark.parametrize("sigma", [0.003, 0.02, 0.1, 0.4, 1.0])
def test_exact_data_give_back_width_and_gain(name: str, sigma: float) -> None:
    fitter = ModelFitter(name, THETA, equator_weights(THETA))
    fixed = fitter.fit(MODELS[name](THETA, sigma))
    free = fitter.fit(0.8 * MODELS[name](THETA, sigma), None)
    # A width below the distance of the angles hardly shows in the data.
    assert fixed.sigma == pytest.approx(sigma, rel=1e-3, abs=2e-4)
    assert free.sigma == pytest.approx(sigma, rel=1e-3, abs=2e-4)
    assert free.gain == pytest.approx(0.8, rel=1e-4)
    assert fixed.gain == 1.0
    assert max(fixed.rms, free.rms) < 1e-5


@pytest.mark.parametrize("name", list(MODELS))
def test_noisy_data_give_it_back_within_their_error(name: str) -> None:
    rng = np.random.default_rng(SEED)
    fitter = ModelFitter(name, THETA, np.ones_like(THETA))
    noise = 2e-3
    exact = MODELS[name](THETA, 0.3)
    slope = (MODELS[name](THETA, 0.301) - exact) / 1e-3
    expected = noise / math.sqrt(float(slope @ slope))
    found = [fitter.fit(exact + rng.normal(0.0, noise, len(THETA))) for _ in range(40)]
    widths = np.array([fit.sigma for fit in found])
    assert abs(widths.mean() - 0.3) < 4.0 * expected / math.sqrt(40)
    assert widths.std() == pytest.approx(expected, rel=0.35)
    assert np.mean([fit.rms for fit in found]) == pytest.approx(noise, rel=0.05)


def test_lambert_is_recognised() -> None:
    fit = ModelFitter("ring", THETA, equator_weights(THETA)).fit(np.maximum(COSINE, 0.0))
    assert fit.sigma < 1e-3
    assert fit.rms < 1e-4


def test_the_paper_curve_is_fitted_where_it_is_not_the_truth() -> None:
    """A sphere's curve fitted by the ring: worse than by itself, better than Lambert."""
    weights = equator_weights(THETA)
    values = MODELS["sphere"](THETA, 0.4)
    ring = ModelFitter("ring", THETA, weights).fit(values)
    lambert = math.sqrt(float((ring_reflectance(THETA, 0.0) - values) ** 2 @ weights))
    assert 1e-3 < ring.rms < 0.7 * lambert
