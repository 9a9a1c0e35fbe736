# SPDX-License-Identifier: GPL-3.0-or-later
"""The look-up table against the models themselves, which have their own tests against mpmath."""

import math

import numpy as np
import pytest

from cdrf_addon.core.errors import ParameterError
from cdrf_addon.core.reflectance.lut import (
    DEFAULT_LAYOUT,
    SIGMA_MAX,
    LutLayout,
    build_lut,
    cosine_axis,
    sample_lut,
    sigma_axis,
)
from cdrf_addon.core.reflectance.model import PROFILE, RING, SPHERE, Model, ring, sphere
from cdrf_addon.core.reflectance.profile import profile

pytestmark = pytest.mark.smoke

# Issue 2 allows the shader 1e-4 before the film rounds; the table is all of that. Ring and sphere
# are at their worst between texels near the terminator at sigma 0.04; of the skin's Gaussians only
# some are at once.
WORST = {RING: 7.5e-5, SPHERE: 7.5e-5, PROFILE: 6.5e-5}
# The points below crowd where the error is largest.
RMS = {RING: 2e-5, SPHERE: 2e-5, PROFILE: 2e-5}
# A sphere lit from the camera, the worst of all sigma: what tests/support/tolerances.py allows.
ON_A_SPHERE = 3e-5
# From SIGMA_MAX on the table holds its last row: the ring is within exp(-12.5) / 2 = 1.87e-6 of its
# limit there, the sphere within exp(-25) / 2; float32 adds 3e-8.
BEYOND = {RING: 2e-6, SPHERE: 4e-8}
TOLERANCE = {
    # A texture coordinate at a texel centre, in texels: a few roundings of numbers up to 512.
    "centre": 1e-12,
    # Half a unit in the last place of a float32 up to 1.
    "float32": 2.0**-25,
    # Rounding of the models themselves; arccos near 1 makes 1e-8 of angle, where f is flat.
    "float64": 1e-12,
    # Between the columns of one row, where blue still bends: 1/8 of f'' over a texel.
    "last row": 4e-5,
}

LAYOUTS = [DEFAULT_LAYOUT, LutLayout(512, 64), LutLayout(97, 33), LutLayout(12, 2)]


MODELS = {model.kind: model for model in (ring(), sphere(), profile())}


@pytest.fixture(scope="module", params=MODELS)
def model(request: pytest.FixtureRequest) -> Model:
    return MODELS[request.param]


@pytest.fixture(scope="module")
def table(model: Model) -> np.ndarray:
    return build_lut(model)


def test_the_table_is_whole(model: Model, table: np.ndarray) -> None:
    channels = (3,) if model.colour else ()
    assert table.shape == (DEFAULT_LAYOUT.height, DEFAULT_LAYOUT.width, *channels)
    assert table.dtype == np.float32
    assert np.isfinite(table).all()
    assert table.min() >= 0.0
    assert table.max() <= 1.0
    # The first row is Lambert, whatever the model; darker to the right, row by row.
    lambert = np.maximum(cosine_axis(), 0.0).reshape(-1, *(1 for _ in channels))
    assert np.abs(table[0] - lambert).max() <= 2 * TOLERANCE["float32"]
    assert np.diff(table, axis=1).max() <= 2 * TOLERANCE["float32"]


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
def test_the_ends_are_exact_to_float32(model: Model, layout: LutLayout) -> None:
    built = build_lut(model, layout)
    sigma = sigma_axis(layout)
    bound = TOLERANCE["float32"] + TOLERANCE["float64"]
    for cosine, theta in ((1.0, 0.0), (-1.0, math.pi)):
        got = sample_lut(built, np.full(layout.height, cosine), sigma**2, layout)
        assert np.abs(got - model.evaluate(theta, sigma)).max() <= bound
    cosine_texels = cosine_axis(layout)
    for row in (0.0, SIGMA_MAX):
        got = sample_lut(built, cosine_texels, np.full(layout.width, row**2), layout)
        exact = model.evaluate(np.arccos(cosine_texels), row)
        assert np.abs(got - exact).max() <= bound


def points() -> tuple[np.ndarray, np.ndarray]:
    """Draw 130,000 pairs of cosine and sigma, most of them where f bends most."""
    rng = np.random.default_rng(20260722)
    count = 20_000
    sign = rng.choice((-1.0, 1.0), count)
    cosine = [
        rng.uniform(-1.0, 1.0, count),
        np.cos(rng.uniform(0.0, math.pi, count)),
        sign * 10.0 ** rng.uniform(-7.0, 0.0, count),  # the terminator
        np.clip(rng.normal(0.0, 0.05, count), -1.0, 1.0),
        sign * (1.0 - 10.0 ** rng.uniform(-9.0, -1.0, count)),  # both poles
        rng.choice((-1.0, 1.0), count // 2),  # and nothing but them
        rng.uniform(-1.0, 1.0, count),
    ]
    sigma = [
        rng.uniform(0.0, SIGMA_MAX, count),
        10.0 ** rng.uniform(-6.0, math.log10(SIGMA_MAX), count),
        10.0 ** rng.uniform(-6.0, 0.0, count),
        np.abs(rng.normal(0.0, 0.05, count)),
        10.0 ** rng.uniform(-3.0, math.log10(SIGMA_MAX), count),
        10.0 ** rng.uniform(-2.0, math.log10(SIGMA_MAX), count // 2),
        10.0 ** rng.uniform(math.log10(SIGMA_MAX), 6.0, count),  # beyond the table
    ]
    return np.concatenate(cosine), np.concatenate(sigma)


def test_the_filtered_table_is_the_model(model: Model, table: np.ndarray) -> None:
    cosine, sigma = points()
    # From SIGMA_MAX on the table is to hold its last row, whether or not the model does.
    exact = model.evaluate(np.arccos(cosine), np.minimum(sigma, SIGMA_MAX))
    error = sample_lut(table, cosine, sigma**2) - exact
    worst = np.unravel_index(np.argmax(np.abs(error)), error.shape)
    where = f"at cos {cosine[worst[0]]:.4g}, sigma {sigma[worst[0]]:.4g}"
    rms = np.sqrt((error**2).mean(axis=0)).max()
    print(f"{model.kind}: worst {np.abs(error).max():.2e} {where}, RMS {rms:.2e}")
    assert np.abs(error).max() <= WORST[model.kind], where
    assert rms <= RMS[model.kind]
    beyond = sigma > SIGMA_MAX
    assert beyond.sum() >= 20_000
    edge = sample_lut(table, cosine[beyond], np.full(beyond.sum(), SIGMA_MAX**2))
    assert np.array_equal(sample_lut(table, cosine[beyond], sigma[beyond] ** 2), edge)


def test_no_sigma_is_too_far_off_on_a_sphere(model: Model, table: np.ndarray) -> None:
    # Lit from the camera, a sphere shows the cosine c on an area in proportion to c dc.
    cosine = np.sqrt((np.arange(1_500) + 0.5) / 1_500)
    sigma = np.geomspace(1e-3, SIGMA_MAX, 300)[:, None]
    error = sample_lut(table, cosine, sigma**2) - model.evaluate(np.arccos(cosine), sigma)
    assert np.sqrt((error**2).mean(axis=1)).max() <= ON_A_SPHERE


@pytest.mark.parametrize("model", [RING, SPHERE], indirect=True)
def test_beyond_the_table_the_model_has_reached_its_limit(model: Model, table: np.ndarray) -> None:
    cosine = np.linspace(-1.0, 1.0, 1_001)
    sigma = np.array([SIGMA_MAX, 6.0, 10.0, 1e3, 1e150])[:, None]
    error = sample_lut(table, cosine, sigma**2) - model.evaluate(np.arccos(cosine), sigma)
    assert np.abs(error).max() <= BEYOND[model.kind]


def test_a_profile_ends_where_its_widest_channel_does() -> None:
    # Red has an RMS width of SIGMA_MAX there; what the narrow Gaussians would still do is left out
    # (decision 002), so that the table need not reach fifteen times as far.
    skin = build_lut(profile())
    cosine = np.linspace(-1.0, 1.0, 1_001)
    exact = profile().evaluate(np.arccos(cosine), SIGMA_MAX)
    for variance in (SIGMA_MAX**2, 1e4, math.inf):
        got = sample_lut(skin, cosine, np.full(1_001, variance))
        assert np.abs(got - exact).max() <= TOLERANCE["last row"]


def test_no_variance_is_too_large(model: Model, table: np.ndarray) -> None:
    cosine = np.linspace(-1.0, 1.0, 11)
    last = sample_lut(table, cosine, np.full(11, SIGMA_MAX**2))
    for variance in (math.inf, 1e300):
        assert np.array_equal(sample_lut(table, cosine, np.full(11, variance)), last)


def test_arguments_are_broadcast(table: np.ndarray) -> None:
    assert sample_lut(table, np.zeros((4, 1)), np.ones(3)).shape[:2] == (4, 3)


@pytest.mark.parametrize("size", [(11, 128), (256, 1), (0, 0), (-256, 128), (256, -1)])
def test_a_table_too_small_is_refused_in_a_sentence(size: tuple[int, int]) -> None:
    with pytest.raises(ParameterError, match=r"too small.*\.$"):
        LutLayout(*size)
