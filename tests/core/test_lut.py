# SPDX-License-Identifier: GPL-3.0-or-later
"""The look-up table against the reflectance itself, which has its own tests against mpmath."""

import math

import numpy as np
import pytest

from cdrf_addon.core.errors import ParameterError
from cdrf_addon.core.lut import (
    DEFAULT_LAYOUT,
    SIGMA_MAX,
    LutLayout,
    build_lut,
    cosine_axis,
    sample_lut,
    sigma_axis,
)
from cdrf_addon.core.models import ring
from cdrf_addon.core.reflectance import reflectance

pytestmark = pytest.mark.smoke

TOLERANCE = {
    # Issue 2 allows the shader 1e-4 before the film rounds; the table is all of that.
    "worst": 1e-4,
    # A quarter of the worst: the points below crowd where the error is largest.
    "rms": 2.5e-5,
    # Beyond SIGMA_MAX f is within exp(-12.5) / 2 = 1.87e-6 of the last row; float32 adds 6e-8.
    "beyond": 2e-6,
    # A texture coordinate at a texel centre, in texels: a few roundings of numbers up to 512.
    "centre": 1e-12,
    # Half a unit in the last place of a float32 up to 1.
    "float32": 2.0**-25,
}

LAYOUTS = [DEFAULT_LAYOUT, LutLayout(512, 64), LutLayout(97, 33), LutLayout(12, 2)]


@pytest.fixture(scope="module")
def table() -> np.ndarray:
    return build_lut(ring())


def test_the_table_is_whole(table: np.ndarray) -> None:
    assert table.shape == (DEFAULT_LAYOUT.height, DEFAULT_LAYOUT.width)
    assert table.dtype == np.float32
    assert np.isfinite(table).all()
    assert table.min() >= 0.0
    assert table.max() <= 1.0
    # The first row is Lambert, and rows fade towards 1/pi.
    assert np.abs(table[0] - np.maximum(cosine_axis(), 0.0)).max() <= TOLERANCE["float32"]
    assert np.abs(table[-1] - 1.0 / math.pi).max() <= TOLERANCE["beyond"]


@pytest.mark.parametrize("layout", LAYOUTS, ids=str)
def test_the_ends_of_both_axes_are_texel_centres(layout: LutLayout) -> None:
    for cosine in (1.0, -1.0):
        column = (1.0 - layout.seam_factor * cosine) / 2.0 * layout.width - 0.5
        assert abs(column - round(column)) <= TOLERANCE["centre"]
        assert cosine_axis(layout)[round(column)] == pytest.approx(cosine, abs=1e-14)
        # Either neighbour across the seam holds the same value, so a filter cannot bleed.
        assert cosine_axis(layout)[round(column) - round(cosine)] == cosine
    rows = [layout.row_offset + layout.row_scale * w for w in (0.0, 1.0)]
    assert rows[0] * layout.height - 0.5 == pytest.approx(0.0, abs=TOLERANCE["centre"])
    assert rows[1] * layout.height - 0.5 == pytest.approx(
        layout.height - 1.0, abs=TOLERANCE["centre"]
    )
    assert sigma_axis(layout)[0] == 0.0
    assert sigma_axis(layout)[-1] == SIGMA_MAX


@pytest.mark.parametrize("layout", LAYOUTS, ids=str)
def test_the_ends_are_exact_to_float32(layout: LutLayout) -> None:
    built = build_lut(ring(), layout)
    sigma = sigma_axis(layout)
    for cosine, theta in ((1.0, 0.0), (-1.0, math.pi)):
        got = sample_lut(built, np.full(layout.height, cosine), sigma**2, layout)
        assert np.abs(got - reflectance(theta, sigma)).max() <= TOLERANCE["float32"] + 1e-12
    cosine_texels = cosine_axis(layout)
    for row in (0.0, SIGMA_MAX):
        got = sample_lut(built, cosine_texels, np.full(layout.width, row**2), layout)
        exact = reflectance(np.arccos(cosine_texels), row)
        # arccos near 1 turns one rounding of the cosine into 1e-8 of angle, and f is flat there.
        assert np.abs(got - exact).max() <= TOLERANCE["float32"] + 1e-12


def points() -> tuple[np.ndarray, np.ndarray]:
    """Draw 300,000 pairs of cosine and sigma, most of them where f bends most."""
    rng = np.random.default_rng(20260722)
    count = 50_000
    sign = rng.choice((-1.0, 1.0), count)
    cosine = [
        rng.uniform(-1.0, 1.0, count),
        np.cos(rng.uniform(0.0, math.pi, count)),
        sign * 10.0 ** rng.uniform(-7.0, 0.0, count),  # the terminator
        np.clip(rng.normal(0.0, 0.05, count), -1.0, 1.0),
        sign * (1.0 - 10.0 ** rng.uniform(-9.0, -1.0, count)),  # both poles
        rng.uniform(-1.0, 1.0, count),
    ]
    sigma = [
        rng.uniform(0.0, SIGMA_MAX, count),
        10.0 ** rng.uniform(-6.0, 1.0, count),
        10.0 ** rng.uniform(-6.0, 0.0, count),
        np.abs(rng.normal(0.0, 0.05, count)),
        10.0 ** rng.uniform(-3.0, 1.0, count),
        10.0 ** rng.uniform(math.log10(SIGMA_MAX), 6.0, count),  # beyond the table
    ]
    return np.concatenate(cosine), np.concatenate(sigma)


def test_the_filtered_table_is_the_reflectance(table: np.ndarray) -> None:
    cosine, sigma = points()
    error = sample_lut(table, cosine, sigma**2) - reflectance(np.arccos(cosine), sigma)
    worst = int(np.argmax(np.abs(error)))
    where = f"at cos {cosine[worst]:.4g}, sigma {sigma[worst]:.4g}"
    assert np.abs(error).max() <= TOLERANCE["worst"], where
    assert np.sqrt((error**2).mean()) <= TOLERANCE["rms"]
    beyond = sigma > SIGMA_MAX
    assert beyond.sum() >= 50_000
    edge = sample_lut(table, cosine[beyond], np.full(beyond.sum(), SIGMA_MAX**2))
    assert np.array_equal(sample_lut(table, cosine[beyond], sigma[beyond] ** 2), edge)


def test_no_variance_is_too_large(table: np.ndarray) -> None:
    cosine = np.linspace(-1.0, 1.0, 11)
    for variance in (math.inf, 1e300):
        got = sample_lut(table, cosine, np.full(11, variance))
        assert np.abs(got - 1.0 / math.pi).max() <= TOLERANCE["beyond"]


def test_arguments_are_broadcast(table: np.ndarray) -> None:
    assert sample_lut(table, np.zeros((4, 1)), np.ones(3)).shape == (4, 3)


@pytest.mark.parametrize("size", [(11, 128), (256, 1), (0, 0), (-256, 128), (256, -1)])
def test_a_table_too_small_is_refused_in_a_sentence(size: tuple[int, int]) -> None:
    with pytest.raises(ParameterError, match=r"too small.*\.$"):
        LutLayout(*size)
