# SPDX-License-Identifier: GPL-3.0-or-later
"""Measurements of spheres: files, refusals, pooled pixels, weights."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from synthetic_spheres import COSINE, SCALES, SEED, Array, synthetic

from cdrf_addon.core.errors import MeasurementError
from cdrf_addon.core.measured.measurement import (
    SphereMeasurement,
    bin_pixels,
    equator_weights,
    load,
    pool,
    save,
    solid_angle_weights,
)


@pytest.fixture(scope="module")
def measurement() -> SphereMeasurement:
    return synthetic()


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
    pooled = pool(cosine, draws.sum(0), (draws**2).sum(0), passes, numbers)
    assert pooled.cosine == pytest.approx(np.linspace(-0.9, 0.9, 40))
    assert pooled.errors == pytest.approx(0.2 / math.sqrt(15 * passes), rel=0.4)
    assert (((pooled.values - 0.5) / pooled.errors) ** 2).mean() == pytest.approx(1.0, abs=0.15)


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
