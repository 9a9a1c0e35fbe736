# SPDX-License-Identifier: GPL-3.0-or-later
"""The damping of a normal map's detail, against the Hankel transform of Burley's profile."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest

from cdrf_addon.core.reflectance.detail import DETAIL_PER_SIGMA0, detail_left


@pytest.mark.parametrize("ratio", [0.3, 1.0])
def test_against_the_profile_itself(ratio: float) -> None:
    """2 pi integral of R(r) J0(k r) r dr, R Burley's profile, sigma0^2 its variance on an axis."""
    sigma0, size = mpmath.mpf(ratio), mpmath.mpf(1)

    def profile(r: mpmath.mpf, d: mpmath.mpf) -> mpmath.mpf:
        return (mpmath.exp(-r / d) + mpmath.exp(-r / (3 * d))) / (8 * mpmath.pi * d * r)

    d = sigma0 / mpmath.sqrt(7)
    second = mpmath.quad(lambda r: mpmath.pi * profile(r, d) * r**3, [0, d, 10 * d, 200 * d])
    assert float(mpmath.sqrt(second)) == pytest.approx(ratio, rel=1e-6)
    k = 2 * mpmath.pi / size
    waves = [n * size / 2 for n in range(1, int(120 * d) + 1)]
    ends = sorted({mpmath.mpf(0), d / 10, d, 3 * d, 10 * d, 30 * d, 60 * d + 1, *waves})
    left = mpmath.quad(lambda r: 2 * mpmath.pi * profile(r, d) * mpmath.besselj(0, k * r) * r, ends)
    assert detail_left(ratio, 1.0) == pytest.approx(float(left), abs=1e-6)


def test_limits() -> None:
    assert detail_left(0.0, 0.01) == 1.0
    assert detail_left(3.0, 0.0) == 1.0  # no size given: all detail stays
    assert detail_left(1e6, 1.0) == pytest.approx(0.0, abs=1e-5)
    falling = detail_left(np.linspace(0.0, 5.0, 100), 1.0)
    assert (np.diff(falling) < 0.0).all()


def test_skin_is_blurred_as_in_shipped_shaders() -> None:
    """FaceWorks takes 0, 0.7 and 1 of the map for red, green and blue; a Gaussian would too."""
    left = detail_left(np.array([1.0, 0.35, 0.2]), DETAIL_PER_SIGMA0)
    assert left == pytest.approx((0.36, 0.70, 0.85), abs=0.01)
    gaussian = math.exp(-2.0 * (math.pi * 0.35 / DETAIL_PER_SIGMA0) ** 2)
    assert left[1] > gaussian
