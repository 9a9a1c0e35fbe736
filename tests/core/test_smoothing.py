# SPDX-License-Identifier: GPL-3.0-or-later
"""Smoothing across the rows of a measured table: what it keeps, and where it ends."""

import numpy as np
import pytest

from cdrf_addon.core.measured.smoothing import smooth_rows


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
