# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits of a whole measurement recover the slopes that made the data, and report them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cdrf_addon.core.errors import MeasurementError
from cdrf_addon.core.measured.fitting import MODELS
from cdrf_addon.core.measured.material_fit import (
    WEIGHTINGS,
    fit_material,
    proportional,
    sigma0_at,
    sigma_per_scale,
)
from cdrf_addon.core.measured.measurement import SphereMeasurement

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


def test_the_sentences_name_channel_and_model() -> None:
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
