# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits recover what made the data, and say what they found."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cdrf_addon.core.errors import MeasurementError
from cdrf_addon.core.measured.fitting import MODELS, ModelFitter
from cdrf_addon.core.measured.material_fit import (
    WEIGHTINGS,
    fit_material,
    proportional,
    sigma0_at,
    sigma_per_scale,
)
from cdrf_addon.core.measured.measurement import SphereMeasurement, equator_weights
from cdrf_addon.core.reflectance.ring_model import reflectance

SEED = 20111106
COSINE = np.linspace(-0.96, 0.96, 72)
THETA = np.arccos(COSINE)
SCALES = 2.0 ** np.arange(-8.0, 3.0, 0.5)
SLOPES = (3.0, 1.5, 0.9)


def saturating(scale: float | np.ndarray, slope: float) -> np.ndarray:
    return 0.6 * np.tanh(slope * np.asarray(scale) / 0.6)


def synthetic(model: str, noise: float = 5e-4) -> SphereMeasurement:
    rng = np.random.default_rng(SEED)
    values = np.array(
        [[MODELS[model](THETA, saturating(s, slope)) for slope in SLOPES] for s in SCALES]
    )
    noisy = values + rng.normal(0.0, noise, values.shape)
    errors = np.full_like(values, noise)
    return SphereMeasurement(np.array([0.9, 0.7, 0.5]), SCALES, COSINE, noisy, errors)


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


@pytest.mark.parametrize("weighting", list(WEIGHTINGS))
@pytest.mark.parametrize("name", list(MODELS))
def test_a_material_gives_back_its_slopes(name: str, weighting: str) -> None:
    fit = fit_material(synthetic(name), weighting)
    assert fit.weighting == weighting
    for channel, slope in zip(fit.channels, SLOPES, strict=True):
        assert channel.sigma0[name] == pytest.approx(slope, rel=0.03)
        # 0.6 tanh(x / 0.6) is 10 % below x at x = 0.34: rows are half an octave apart.
        end = 0.34 / slope
        assert end / 1.5 < channel.proportional_to[name] < end * 1.3
        best = [fit.rms for fit in channel.free[name]]
        assert max(best) < 8e-4
        assert channel.lambert[-1] > 20.0 * best[-1]


def test_the_sentences_name_what_they_speak_of() -> None:
    lines = fit_material(synthetic("sphere")).sentences()
    assert len(lines) == 6
    assert lines[1].startswith("Red (albedo 0.9), sphere: σ0 is ")
    assert "scatter radii" in lines[1]


def test_sigma_per_scale_takes_the_named_channel() -> None:
    measurement = synthetic("sphere")
    for channel, slope in enumerate(SLOPES):
        assert sigma_per_scale(measurement, channel) == pytest.approx(slope, rel=0.03)


def test_proportional_everywhere_is_infinite() -> None:
    scales = np.geomspace(0.01, 1.0, 9)
    slope, end = proportional(scales, 0.3 * scales)
    assert slope == pytest.approx(0.3)
    assert end == math.inf


def test_too_few_small_spheres_are_refused() -> None:
    with pytest.raises(MeasurementError, match="finer quality"):
        proportional(np.array([1.0, 2.0, 4.0]), np.array([0.5, 0.55, 0.6]))


def test_the_paper_curve_is_fitted_where_it_is_not_the_truth() -> None:
    """A sphere's curve fitted by the ring: worse than by itself, better than Lambert."""
    weights = equator_weights(THETA)
    values = MODELS["sphere"](THETA, 0.4)
    ring = ModelFitter("ring", THETA, weights).fit(values)
    lambert = math.sqrt(float((reflectance(THETA, 0.0) - values) ** 2 @ weights))
    assert 1e-3 < ring.rms < 0.7 * lambert


def test_sigma0_at_a_curvature_follows_saturation() -> None:
    fit = fit_material(synthetic("sphere"))
    radius = (1.0, 0.5, 0.25)
    slopes = [slope * own for slope, own in zip(SLOPES, radius, strict=True)]
    assert sigma0_at(fit, "sphere", radius, 0.0) == pytest.approx(slopes, rel=0.03)
    assert sigma0_at(fit, "sphere", radius, 1e-4) == pytest.approx(slopes, rel=0.03)
    for kappa in (0.2, 1.0, 3.0):
        expected = [float(saturating(own * kappa, slope)) / kappa
                    for slope, own in zip(SLOPES, radius, strict=True)]  # fmt: skip
        assert sigma0_at(fit, "sphere", radius, kappa) == pytest.approx(expected, rel=0.03)
