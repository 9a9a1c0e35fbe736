# SPDX-License-Identifier: GPL-3.0-or-later
"""Chandrasekhar's H against its defining equation, mpmath, published values and its laws."""

import functools
import math

import mpmath
import numpy as np
import pytest

from cdrf_addon.core.walk.chandrasekhar import chandrasekhar_h, cut_off, escape

pytestmark = pytest.mark.smoke

TOLERANCE = {
    # What the docstring promises.
    "documented": 1e-10,
    # Published with six decimals, the last one rounded.
    "published": 6e-7,
    # The equation's integral with 300 nodes, cubed towards 0 where H rises like mu ln(mu).
    "equation": 1e-10,
    # The leading term of the tail; its next order is 1 / n, here 1 / 256, of at most 0.1.
    "cut off": 5e-4,
}
OMEGAS = (0.0, 0.1, 0.5, 0.9, 0.99, 0.999999, 1.0)
MUS = np.array([0.0, 1e-12, 1e-6, 1e-3, 0.05, 0.3, 0.7, 1.0])
# Chandrasekhar, Radiative Transfer (1950), table XI (conservative), as Hapke (2012) repeats it.
PUBLISHED = {0.1: 1.247350, 0.5: 2.012779, 1.0: 2.907810}


@functools.cache
def nodes() -> tuple[np.ndarray, np.ndarray]:
    x, w = np.polynomial.legendre.leggauss(300)
    u = (x + 1.0) / 2.0
    return u**3, 1.5 * w * u**2


def by_mpmath(mu: float, omega: float) -> float:
    """The same logarithm over t, where its kernel is sharp, with 50 digits."""
    with mpmath.workdps(50):

        def term(log_t: mpmath.mpf) -> mpmath.mpf:
            t = mpmath.exp(log_t)
            return t * mpmath.log(1 - omega * mpmath.atan(t) / t) / (1 + (mu * t) ** 2)

        # Below exp(-40) and beyond exp(80) the integrand is less than 1e-15 of its whole.
        cuts = [-40, -20, -8, -3, 0, 3, 8, 15, 30, 80]
        return float(mpmath.exp(-mu / mpmath.pi * mpmath.quad(term, cuts)))


@pytest.mark.parametrize("omega", OMEGAS)
def test_the_equation_that_defines_it(omega: float) -> None:
    x, w = nodes()
    inner, outer = chandrasekhar_h(x, omega), chandrasekhar_h(MUS, omega)
    kernel = (w * inner / np.maximum(MUS[:, None] + x, 1e-300)).sum(axis=1)
    error = np.abs(outer - 1.0 - MUS * outer * omega / 2.0 * kernel).max()
    assert error <= TOLERANCE["equation"]


@pytest.mark.parametrize("omega", [0.3, 0.97, 1.0])
@pytest.mark.parametrize("mu", [0.01, 0.4, 1.0])
def test_mpmath(mu: float, omega: float) -> None:
    assert abs(float(chandrasekhar_h(mu, omega)) - by_mpmath(mu, omega)) <= TOLERANCE["documented"]


def test_published_values() -> None:
    for mu, value in PUBLISHED.items():
        assert abs(float(chandrasekhar_h(mu, 1.0)) - value) <= TOLERANCE["published"], mu


@pytest.mark.parametrize("omega", OMEGAS)
def test_its_mean_is_closed(omega: float) -> None:
    # Chandrasekhar, section 38, theorem 1: the mean over mu is 2 (1 - sqrt(1 - omega)) / omega.
    x, w = nodes()
    mean = float(w @ chandrasekhar_h(x, omega))
    exact = 1.0 if omega == 0.0 else 2.0 / omega * (1.0 - math.sqrt(1.0 - omega))
    assert abs(mean - exact) <= TOLERANCE["equation"]


def test_escape_is_a_share_and_rises_with_the_albedo() -> None:
    share = escape(MUS[:, None], np.linspace(0.0, 1.0, 101))
    assert share.min() >= -1e-15
    assert share.max() <= 1.0
    assert np.diff(share, axis=1).min() >= 0.0
    assert np.array_equal(share[:, -1], np.ones(len(MUS)))
    # Seen flatter, light enters less deep and more of it comes back.
    assert np.diff(share[:, 1:-1], axis=0).max() <= 1e-15


def test_what_an_end_takes_is_the_tail_of_the_series() -> None:
    # escape(omega) = sum over n of p_n omega^n: p_n from a contour of 2,048 points, the radius
    # such that what wraps around is below 1e-9.
    count, radius = 2048, 0.99
    mu = 0.6
    angle = 2.0 * np.pi * np.arange(count) / count
    omega = radius * np.exp(1j * angle)
    phi = np.pi / 2.0 * (np.polynomial.legendre.leggauss(200)[0] + 1.0) / 2.0
    part = np.polynomial.legendre.leggauss(200)[1] * np.pi / 4.0
    t = np.tan(phi) / mu
    log = np.zeros(count, dtype=complex)
    for own, weight in zip(t, part, strict=True):
        log += weight * np.log(1.0 - omega * math.atan(own) / own)
    series = 1.0 - np.sqrt(1.0 - omega) * np.exp(-log / np.pi)
    terms = (np.fft.fft(series) / count).real / radius ** np.arange(count)
    for albedo in (0.9, 0.99, 0.995):
        tail = float((terms[256:1200] * albedo ** np.arange(256, 1200)).sum())
        assert abs(float(cut_off(mu, albedo, 256)) - tail) <= TOLERANCE["cut off"]


def test_an_end_takes_nothing_where_there_is_none() -> None:
    assert np.array_equal(cut_off(MUS, 1.0, math.inf), np.zeros(len(MUS)))
    assert float(cut_off(0.5, 0.0, 256)) == 0.0
    taken = cut_off(0.5, np.linspace(0.0, 1.0, 101), 256)
    assert np.diff(taken).min() >= 0.0


def test_extremes_are_finite_and_nothing_warns() -> None:
    with np.errstate(all="raise", under="ignore"):
        value = chandrasekhar_h([0.0, 1e-300, 5e-324, 1.0], [[0.0], [1.0]])
    assert np.isfinite(value).all()
    assert np.array_equal(value[:, 0], [1.0, 1.0])
    assert np.array_equal(
        chandrasekhar_h([-1.0, 2.0], [-1.0, 2.0]), chandrasekhar_h([0, 1], [0, 1])
    )
