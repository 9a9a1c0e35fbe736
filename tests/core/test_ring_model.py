# SPDX-License-Identifier: GPL-3.0-or-later
"""The ring model against two references in high precision, and the laws it has to obey.

`by_quadrature` integrates the definition along the real line, `by_series` sums the Fourier series;
neither knows how the code under test evaluates f.
"""

import functools
import math

import mpmath
import numpy as np
import pytest
from references import ANGLES as MANY_ANGLES
from references import SIGMAS as LISTED
from references import reference_error, ring_reference

from cdrf_addon.core.errors import CdrfError, ParameterError
from cdrf_addon.core.reflectance.ring_model import SERIES_FROM, ring_reflectance, series_remainder

pytestmark = pytest.mark.smoke

TOLERANCE = {
    # What issue 2 promises, and a thousandth of it: the docstring of `ring_reflectance` says 1e-12.
    "promised": 1e-9,
    "documented": 1e-12,
    # The references agree far below the rounding of float64.
    "references": 1e-18,
    # sigma = inf: one rounding of 1/pi.
    "limit": 1e-15,
    # Both forms on either side of SERIES_FROM: two float64 sums of a dozen terms up to 1.
    "seam": 1e-14,
    # Laws that hold exactly, seen through the rounding of angles up to 20 pi: 60 eps = 1.4e-14.
    "law": 5e-14,
    # Rounding of f at neighbouring angles where f is flat.
    "monotone": 1e-15,
    # The bound itself is a float64; below 5e-324 it is 0.
    "bound": 1e-12,
    # numpy may take another path through cos and exp for arrays than for scalars.
    "scalar": 4e-16,
}

BELOW, ABOVE = math.nextafter(SERIES_FROM, 0.0), math.nextafter(SERIES_FROM, 1.0)
NARROW = [1e-300, 1e-12, 1e-6, 1e-3, 0.01, 0.03, 0.1, 0.3, 0.49, BELOW]
MIDDLE = [SERIES_FROM, ABOVE, 0.51, 0.7, 1.0, 3.0, 10.0]
WIDE = [1e3, 1e12, 1e200]
HALF = math.pi / 2.0
ANGLES = [0.0, 1e-9, 0.3, 1.0, HALF - 0.1, HALF - 1e-3, HALF - 1e-6, HALF - 1e-12, HALF]
ANGLES += [HALF + 1e-12, HALF + 1e-6, HALF + 1e-3, 1.8, 2.5, 3.0, math.pi - 1e-7, math.pi]


@functools.cache
def by_quadrature(theta: float, sigma: float) -> mpmath.mpf:
    """Integrate max(cos, 0) times the Gaussian over the real line, cut at the cosine's zeros."""
    with mpmath.workdps(30):
        angle, width, reach = mpmath.mpf(theta), mpmath.mpf(sigma), 13  # the tail is below 1e-37
        first = mpmath.ceil((angle - reach * width) / mpmath.pi - 0.5)
        last = mpmath.floor((angle + reach * width) / mpmath.pi - 0.5)
        cuts = {mpmath.mpf(cut) for cut in (-reach, -4, 0, 4, reach)}
        zeros = (mpmath.pi * (int(first) + i + 0.5) for i in range(int(last - first) + 1))
        cuts |= {(angle - zero) / width for zero in zeros}

        def integrand(z: mpmath.mpf) -> mpmath.mpf:
            return max(mpmath.cos(angle - width * z), 0) * mpmath.npdf(z)

        inside = sorted(cut for cut in cuts if -reach <= cut <= reach)
        return mpmath.quad(integrand, inside, method="gauss-legendre")


@functools.cache
def by_series(theta: float, sigma: float) -> mpmath.mpf:
    """Sum the Fourier series of max(cos, 0), each term times the Gaussian's transform."""
    with mpmath.workdps(30):
        angle, width = mpmath.mpf(theta), mpmath.mpf(sigma)
        total = 1 / mpmath.pi + mpmath.exp(-(width**2) / 2) / 2 * mpmath.cos(angle)
        for k in range(1, 25):
            weight = 2 * mpmath.mpf(-1) ** (k + 1) / (mpmath.pi * (4 * k * k - 1))
            total += weight * mpmath.exp(-2 * (k * width) ** 2) * mpmath.cos(2 * k * angle)
        return total


def test_the_two_references_agree() -> None:
    for sigma in (SERIES_FROM, 1.0, 3.0):
        for theta in ANGLES[::4]:
            difference = by_quadrature(theta, sigma) - by_series(theta, sigma)
            assert abs(difference) < TOLERANCE["references"]


@pytest.mark.parametrize("sigma", NARROW + MIDDLE)
def test_the_value_is_the_integral(sigma: float) -> None:
    exact = np.array([float(by_quadrature(theta, sigma)) for theta in ANGLES])
    error = np.abs(ring_reflectance(ANGLES, sigma) - exact).max()
    assert error <= TOLERANCE["promised"]
    assert error <= TOLERANCE["documented"]


@pytest.mark.parametrize("sigma", MIDDLE + WIDE)
def test_the_value_is_the_series(sigma: float) -> None:
    exact = np.array([float(by_series(theta, sigma)) for theta in ANGLES])
    error = np.abs(ring_reflectance(ANGLES, sigma) - exact).max()
    assert error <= TOLERANCE["promised"]
    assert error <= TOLERANCE["documented"]


@pytest.mark.parametrize("sigma", LISTED)
def test_the_value_at_1001_angles(sigma: float, record_property) -> None:
    error = np.abs(ring_reflectance(MANY_ANGLES, sigma) - ring_reference(MANY_ANGLES, sigma)).max()
    record_property("worst error", f"{error:.1e} off")
    assert error <= TOLERANCE["promised"] + reference_error(sigma)


def test_no_blur_is_lambert_to_the_last_bit() -> None:
    theta = np.concatenate((ANGLES, np.linspace(0.0, math.pi, 100_001)))
    assert np.abs(ring_reflectance(theta, 0.0) - np.maximum(np.cos(theta), 0.0)).max() == 0.0


def test_endless_blur_is_one_over_pi() -> None:
    theta = np.linspace(-10.0, 10.0, 1001)
    for sigma in (math.inf, 1e12, 1e300, np.finfo(np.float64).max):
        assert np.abs(ring_reflectance(theta, sigma) - 1.0 / math.pi).max() <= TOLERANCE["limit"]


def test_nothing_warns() -> None:
    with np.errstate(all="raise", under="ignore"):
        for sigma in (0.0, 5e-324, 1e-300, BELOW, ABOVE, 1e200, math.inf):
            assert np.isfinite(ring_reflectance(ANGLES, sigma)).all()


def test_no_step_where_the_two_forms_meet() -> None:
    theta = np.linspace(0.0, math.pi, 10_001)
    for other in (BELOW, ABOVE):
        step = np.abs(ring_reflectance(theta, other) - ring_reflectance(theta, SERIES_FROM)).max()
        assert step <= TOLERANCE["seam"]


GRID = np.linspace(0.0, math.pi, 2_001)
SIGMAS = np.array([0.0, *NARROW, *MIDDLE, *WIDE, math.inf])[:, None]


def test_even_and_periodic() -> None:
    base = ring_reflectance(GRID, SIGMAS)
    assert np.abs(ring_reflectance(-GRID, SIGMAS) - base).max() <= TOLERANCE["law"]
    for turns in (-10, -1, 1, 10):
        turned = ring_reflectance(GRID + turns * 2.0 * math.pi, SIGMAS)
        # At the tiny widths f has the slope 1 of Lambert, so an angle's rounding comes through.
        assert np.abs(turned - base).max() <= TOLERANCE["law"]


def test_darker_as_the_light_sinks_and_within_zero_and_one() -> None:
    value = ring_reflectance(GRID, SIGMAS)
    assert value.min() >= 0.0
    assert value.max() <= 1.0
    assert np.diff(value, axis=1).max() <= TOLERANCE["monotone"]


def test_bright_and_dark_side_differ_by_the_damped_cosine() -> None:
    # Of the series only 1/2 exp(-sigma^2 / 2) cos(theta) is odd about pi / 2: the mean and every
    # cos(2 k theta) are the same at pi - theta, so they cancel.
    difference = ring_reflectance(GRID, SIGMAS) - ring_reflectance(math.pi - GRID, SIGMAS)
    with np.errstate(over="ignore"):
        damped = np.exp(-0.5 * SIGMAS**2) * np.cos(GRID)
    assert np.abs(difference - damped).max() <= TOLERANCE["law"]


@pytest.mark.parametrize("terms", [1, 3, 10])
@pytest.mark.parametrize("sigma", [0.05, 0.2, SERIES_FROM, 1.0, 3.0])
def test_the_stated_remainder_bounds_the_real_one(sigma: float, terms: int) -> None:
    # At theta = pi / 2 every term has the same sign: the remainder is as large as it gets.
    with mpmath.workdps(40):
        width = mpmath.mpf(sigma)
        rest = mpmath.fsum(
            2 / mpmath.pi / (4 * k * k - 1) * mpmath.exp(-2 * (k * width) ** 2)
            for k in range(terms + 1, terms + 201)
        )
        assert rest <= series_remainder(sigma, terms) * (1 + TOLERANCE["bound"]) + 5e-324


def test_the_remainder_is_below_what_the_module_says() -> None:
    assert series_remainder(SERIES_FROM) < 2e-24


@pytest.mark.parametrize(
    ("theta", "sigma"),
    [
        (math.nan, 0.1),
        (math.inf, 0.1),
        (-math.inf, 0.1),
        (0.1, math.nan),
        (0.1, -1e-9),
        (0.1, -math.inf),
    ],
)
def test_nonsense_is_refused_in_a_sentence(theta: float, sigma: float) -> None:
    for angle, width in ((theta, sigma), ([0.0, theta], [0.1, sigma])):
        with pytest.raises(ParameterError) as refusal:
            ring_reflectance(angle, width)
        assert isinstance(refusal.value, CdrfError)
        text = str(refusal.value)
        assert text.endswith(".")
        assert " must be " in text


def test_arguments_are_broadcast() -> None:
    assert ring_reflectance(0.3, 0.1).shape == ()
    assert ring_reflectance([0.3], 0.1).shape == (1,)
    assert ring_reflectance(np.zeros((0, 3)), 0.1).shape == (0, 3)
    wide = ring_reflectance(np.linspace(0.0, 3.0, 5)[:, None], np.array([0.0, 0.2, 0.5, math.inf]))
    assert wide.shape == (5, 4)
    assert wide.dtype == np.float64
    for i, theta in enumerate(np.linspace(0.0, 3.0, 5)):
        for j, sigma in enumerate((0.0, 0.2, 0.5, math.inf)):
            assert abs(wide[i, j] - ring_reflectance(theta, sigma)) <= TOLERANCE["scalar"]


def test_scalars_integers_and_float32_are_taken() -> None:
    assert float(ring_reflectance(0, 0)) == 1.0
    assert ring_reflectance(np.float32(1.0), np.float32(0.25)) == ring_reflectance(1.0, 0.25)
    assert ring_reflectance([0, 1], 0).shape == (2,)


def test_arguments_are_left_alone() -> None:
    theta, sigma = np.array([-7.0, 0.5, 4.0]), np.array([0.0, 0.2, 2.0])
    ring_reflectance(theta, sigma)
    assert theta.tolist() == [-7.0, 0.5, 4.0]
    assert sigma.tolist() == [0.0, 0.2, 2.0]
