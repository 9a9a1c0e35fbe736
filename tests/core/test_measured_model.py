# SPDX-License-Identifier: GPL-3.0-or-later
"""The measured model on data whose truth is known: limits, smoothing, refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from synthetic_spheres import COSINE, SCALES, SLOPE, synthetic, truth

from cdrf_addon.core.errors import MeasurementError, ParameterError
from cdrf_addon.core.measured.measurement import (
    SphereMeasurement,
)
from cdrf_addon.core.measured.model import MeasuredModel

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def measurement() -> SphereMeasurement:
    return synthetic()


@pytest.fixture(scope="module")
def model(measurement: SphereMeasurement) -> MeasuredModel:
    return MeasuredModel(measurement)


def test_sigma_per_scale_is_that_of_the_sphere_model(model: MeasuredModel) -> None:
    assert model.sigma_per_scale == pytest.approx(SLOPE, rel=0.02)


def test_zero_is_lambert_exactly(model: MeasuredModel) -> None:
    theta = np.linspace(0.0, math.pi, 1001)
    lambert = np.maximum(np.cos(theta), 0.0)
    assert (model.evaluate(theta, 0.0) == lambert[:, None]).all()


@pytest.mark.parametrize("scale", [0.005, 0.03, 0.07, 0.15, 0.4, 1.1, 2.3])
def test_scales_between_rows_are_as_good_as_the_noise(model: MeasuredModel, scale: float) -> None:
    theta = np.arccos(COSINE)
    found = model.evaluate(theta, scale * model.sigma_per_scale)
    error = found - truth(theta, scale)[:, None]
    assert np.sqrt((error**2).mean()) < 1.5e-3
    assert np.abs(error).max() < 8e-3


def test_smoothing_stays_within_the_error(model: MeasuredModel) -> None:
    chi_squared = model.chi_squared()
    assert chi_squared.max() < 1.6
    assert np.median(chi_squared) == pytest.approx(1.0, abs=0.15)


def test_smoothing_is_worth_it(measurement: SphereMeasurement, model: MeasuredModel) -> None:
    theta = measurement.theta
    exact = truth(theta[None, :], SCALES[:, None])[:, None, :]
    smooth = np.array([[curve(theta) for curve in row] for row in model.curves])
    before = np.sqrt(((measurement.values - exact) ** 2).mean())
    assert np.sqrt(((smooth - exact) ** 2).mean()) < 0.7 * before


def test_the_terminator_stays_sharp(model: MeasuredModel) -> None:
    """Where light ends, the first row rises as fast as the data do, not as a smoothed edge."""
    scale = float(SCALES[0])
    theta = math.pi / 2.0 + np.linspace(-0.05, 0.05, 101)
    found = model.curves[0][0](theta)
    assert np.abs(found - truth(theta, scale)).max() < 2e-3


@pytest.mark.parametrize(
    "sigma", [0.0, 1e-12, 1e-6, 1e-3, 0.01, 0.1, 1.0, 3.0, 1e3, 1e12, math.inf]
)
def test_finite_and_never_negative(model: MeasuredModel, sigma: float) -> None:
    theta = np.linspace(-7.0, 7.0, 1001)
    found = model.evaluate(theta, sigma)
    assert np.isfinite(found).all()
    assert found.min() >= 0.0
    assert np.abs(found - model.evaluate(-theta, sigma)).max() < 1e-12


def test_nothing_changes_beyond_the_last_row(model: MeasuredModel) -> None:
    theta = np.linspace(0.0, math.pi, 100)
    last = float(SCALES[-1]) * model.sigma_per_scale
    assert model.evaluate(theta, math.inf) == pytest.approx(model.evaluate(theta, last), abs=1e-12)


def test_sigma_makes_no_jumps(model: MeasuredModel) -> None:
    """Half a percent of sigma changes no value by more than 2 %, but for the step at Lambert."""
    sigma = model.sigma_per_scale * SCALES[0] * 1.005 ** np.arange(1400)
    found = model.evaluate(np.linspace(0.0, math.pi, 181)[None, :], sigma[:, None])
    assert np.abs(np.diff(found, axis=0)).max() < 0.02


def test_channels_scale_with_their_radius(measurement: SphereMeasurement) -> None:
    ratio = (1.0, 0.35, 0.1)
    coloured = MeasuredModel(measurement, ratio)
    plain = MeasuredModel(measurement, sigma_per_scale=coloured.sigma_per_scale)
    theta = np.linspace(0.0, math.pi, 91)
    found = coloured.evaluate(theta, 0.7)
    for channel, part in enumerate(ratio):
        there = plain.evaluate(theta, 0.7 * part)[:, channel]
        assert found[:, channel] == pytest.approx(there, abs=1e-12)


def test_only_the_ratio_of_the_radii_counts(measurement: SphereMeasurement) -> None:
    one = MeasuredModel(measurement, (2e-3, 1e-3, 0.0), sigma_per_scale=2.0)
    other = MeasuredModel(measurement, (1.0, 0.5, 0.0), sigma_per_scale=2.0)
    theta = np.linspace(0.0, math.pi, 50)
    assert (one.evaluate(theta, 0.5) == other.evaluate(theta, 0.5)).all()
    assert (one.evaluate(theta, math.inf)[:, 2] == np.maximum(np.cos(theta), 0.0)).all()


def test_shapes_broadcast(model: MeasuredModel) -> None:
    assert model.evaluate(0.3, 0.1).shape == (3,)
    assert model.evaluate(np.zeros((1, 5)), np.zeros((4, 1))).shape == (4, 5, 3)


def test_energy_is_that_of_the_truth(measurement: SphereMeasurement, model: MeasuredModel) -> None:
    expected = 1.0 + 0.1 * np.tanh(4.0 * SCALES)
    assert model.energy() == pytest.approx(np.repeat(expected[:, None], 3, 1), abs=0.01)
    assert measurement.energy() == pytest.approx(model.energy(), abs=0.02)


@pytest.mark.parametrize(("theta", "sigma"), [(math.nan, 0.1), (math.inf, 0.1), (0.1, math.nan)])
def test_refuses_what_is_no_number(model: MeasuredModel, theta: float, sigma: float) -> None:
    with pytest.raises(ParameterError):
        model.evaluate(theta, sigma)


def test_refuses_a_negative_width(model: MeasuredModel) -> None:
    with pytest.raises(ParameterError):
        model.evaluate(0.1, -0.1)


@pytest.mark.parametrize(
    "radius", [(0.0, 0.0, 0.0), (1.0, -1.0, 0.0), (math.nan, 1.0, 1.0), (1.0,)]
)
def test_refuses_radii(measurement: SphereMeasurement, radius: tuple[float, ...]) -> None:
    with pytest.raises(MeasurementError):
        MeasuredModel(measurement, radius)
