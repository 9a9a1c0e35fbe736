# SPDX-License-Identifier: GPL-3.0-or-later
"""The measured model on data whose truth is known: limits, smoothing, files, refusals."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from cdrf_addon.core.errors import MeasurementError, ParameterError
from cdrf_addon.core.measured.measurement import (
    SphereMeasurement,
    bin_pixels,
    equator_weights,
    load,
    pool,
    save,
    solid_angle_weights,
)
from cdrf_addon.core.measured.model import MeasuredModel
from cdrf_addon.core.measured.smoothing import smooth_rows
from cdrf_addon.core.reflectance.sphere_model import sphere_reflectance

Array = NDArray[np.float64]
SEED = 20111106
# sigma = 2 s, as a sphere of albedo 0.8 has it, and a gain that grows with the scale.
SLOPE = 2.0
SCALES = 2.0 ** np.arange(-8.0, 3.0, 0.5)
COSINE = np.linspace(-0.96, 0.96, 72)


def truth(theta: Array, scale: Array | float) -> Array:
    gain = 1.0 + 0.1 * np.tanh(4.0 * np.asarray(scale))
    return np.asarray(gain * sphere_reflectance(theta, SLOPE * np.asarray(scale)))


def synthetic(noise: float = 1e-3, seed: int = SEED) -> SphereMeasurement:
    rng = np.random.default_rng(seed)
    exact = truth(np.arccos(COSINE)[None, :], SCALES[:, None])
    errors = noise * (0.2 + np.maximum(COSINE, 0.0))
    values = exact[:, None, :] + rng.normal(size=(len(SCALES), 3, len(COSINE))) * errors
    return SphereMeasurement(
        np.array([0.8, 0.5, 0.3]), SCALES, COSINE, values, np.broadcast_to(errors, values.shape)
    )


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


def test_a_file_gives_back_what_was_saved(measurement: SphereMeasurement, tmp_path: Path) -> None:
    written = replace(measurement, samples=64, seed=7, blender="5.2.3 LTS", elevation=0.25)
    save(tmp_path / "deep" / "spheres.npz", written)
    found = load(tmp_path / "deep" / "spheres.npz")
    for name, value in vars(written).items():
        assert np.array_equal(getattr(found, name), value), name
    assert type(found.seed) is int
    assert list((tmp_path / "deep").iterdir()) == [tmp_path / "deep" / "spheres.npz"]


def test_foreign_and_broken_files_are_refused(
    measurement: SphereMeasurement, tmp_path: Path
) -> None:
    good = tmp_path / "good.npz"
    save(good, measurement)
    np.savez(tmp_path / "foreign.npz", values=np.zeros(3))
    np.savez(tmp_path / "pickle.npz", magic=np.array({"a": 1}, dtype=object))
    (tmp_path / "cut.npz").write_bytes(good.read_bytes()[:2000])
    (tmp_path / "text.npz").write_text("no measurement")
    (tmp_path / "empty.npz").write_bytes(b"")
    for name in ("foreign", "pickle", "cut", "text", "empty", "absent"):
        with pytest.raises(MeasurementError, match=name):
            load(tmp_path / f"{name}.npz")
    with np.load(good) as file:
        content = dict(file)
    np.savez(good, **content | {"format": np.array(99)})
    with pytest.raises(MeasurementError, match="format 99"):
        load(good)


@pytest.mark.parametrize(
    "change",
    [
        {"values": np.full((22, 3, 72), math.nan)},
        {"values": np.zeros((22, 3, 71))},
        {"errors": np.full((22, 3, 72), -1.0)},
        {"scales": SCALES[::-1]},
        {"cosine": COSINE * 2.0},
        {"albedo": np.array([0.8, 0.0, 0.5])},
    ],
)
def test_impossible_measurements_are_refused(
    measurement: SphereMeasurement, change: dict[str, Array]
) -> None:
    with pytest.raises(MeasurementError):
        replace(measurement, **change)  # type: ignore[arg-type]


def test_pixels_are_pooled_with_their_error() -> None:
    """Independent pixels of known noise: the bins' means scatter as their errors say."""
    rng = np.random.default_rng(SEED)
    passes = 8
    cosine = np.repeat(np.linspace(-0.9, 0.9, 40), 15)
    draws = rng.normal(0.5, 0.2, (passes, 3, len(cosine), 3))
    numbers = bin_pixels(cosine)
    assert (np.bincount(numbers) == 15).all()
    there, values, errors = pool(cosine, draws.sum(0), (draws**2).sum(0), passes, numbers)
    assert there == pytest.approx(np.linspace(-0.9, 0.9, 40))
    assert errors == pytest.approx(0.2 / math.sqrt(15 * passes), rel=0.4)
    assert (((values - 0.5) / errors) ** 2).mean() == pytest.approx(1.0, abs=0.15)


def test_scattered_pixels_are_binned_by_angle() -> None:
    rng = np.random.default_rng(SEED)
    cosine = np.sort(rng.uniform(-0.97, 0.97, 1500))
    numbers = bin_pixels(cosine)
    assert (np.diff(numbers) >= 0).all()
    assert np.bincount(numbers).min() >= 3


def test_weights_are_a_mean() -> None:
    theta = np.arccos(COSINE)
    for weights in (equator_weights(theta), solid_angle_weights(theta)):
        assert weights.sum() == pytest.approx(1.0)
        assert (weights > 0.0).all()
    # The mean of max(cos, 0) over the sphere.
    assert solid_angle_weights(theta) @ np.maximum(COSINE, 0.0) == pytest.approx(0.25, abs=1e-3)


def test_smoothing_across_rows_keeps_cubics_and_takes_noise() -> None:
    rng = np.random.default_rng(20111106)
    place = np.log(2.0) * np.arange(22) / 2.0
    loose = np.full((22, 3), 100.0)
    cubic = np.stack([np.polyval(factors, place) for factors in rng.normal(size=(3, 4))], axis=1)
    kept = smooth_rows(place, cubic[..., None], loose)[..., 0]
    assert np.abs(kept - cubic).max() <= 1e-9 * np.abs(cubic).max()
    noise = rng.normal(size=(22, 3, 400))
    left = smooth_rows(place, noise, loose)[3:-3].std()
    # The middle weight of a seven-row cubic, 7 / 21 (Savitzky and Golay 1964).
    assert left**2 == pytest.approx(1.0 / 3.0, rel=0.05)
    few = rng.normal(size=(4, 3, 5))
    assert np.abs(smooth_rows(place[:4], few, loose[:4]) - few).max() <= 1e-12


def test_smoothing_across_rows_ends_at_the_noise() -> None:
    rng = np.random.default_rng(20111106)
    place = np.log(2.0) * np.arange(22) / 2.0
    rows = rng.normal(size=(22, 3, 400))
    moved = smooth_rows(place, rows, np.full((22, 3), 0.01)) - rows
    assert np.sqrt((moved**2).mean(axis=-1)).max() <= 0.01 * (1.0 + 1e-9)
