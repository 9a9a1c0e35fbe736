# SPDX-License-Identifier: GPL-3.0-or-later
"""The dipole's closed forms against Jensen's own form, integrated over the plane."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from cdrf_addon.core.errors import ParameterError
from cdrf_addon.core.scattering.dipole import Medium
from cdrf_addon.core.scattering.presets import PRESETS

pytestmark = pytest.mark.smoke

# Adaptive quadrature of the dipole over the plane, relative.
QUADRATURE = 1e-6


def dipole(medium: Medium, distance: float) -> float:
    """R_d(r), Jensen et al. 2001, Eq. 4, as it stands there."""
    albedo = medium.scattering / medium.extinction
    total = 0.0
    for depth in medium.depths:
        d = math.hypot(distance, depth)
        total += depth * (1.0 + medium.transport * d) * math.exp(-medium.transport * d) / d**3
    return albedo / (4.0 * math.pi) * total


@pytest.mark.parametrize("key", ["SKIN1", "MARBLE", "KETCHUP"])
def test_the_closed_forms_are_those_of_the_dipole(key: str) -> None:
    media = PRESETS[key].media
    assert media is not None
    for medium in media:
        end = 60.0 / medium.transport

        def over_the_plane(power: int, medium: Medium = medium, end: float = end) -> float:
            def integrand(r: float) -> float:
                return 2.0 * math.pi * r ** (1 + power) * dipole(medium, r)

            return float(quad(integrand, 0.0, end, limit=400, epsabs=0.0, epsrel=1e-9)[0])

        assert medium.albedo == pytest.approx(over_the_plane(0), rel=QUADRATURE)
        variance = over_the_plane(2) / over_the_plane(0) / 2.0  # of one axis
        assert medium.rms_width == pytest.approx(math.sqrt(variance), rel=QUADRATURE)
        assert medium.sigma0() < medium.rms_width


def test_a_terminator_blurred_by_sigma0_is_closest() -> None:
    """Against the blurred ramps themselves, summed over x, where the code works on transforms."""
    medium = Medium(2.19, 0.0021, 1.5)
    x = np.linspace(-400.0, 400.0, 80_001)
    step = x[1] - x[0]
    k = 2.0 * math.pi * np.fft.rfftfreq(len(x), step)
    q = np.hypot(k, medium.transport)
    weights = [math.exp(-depth * medium.transport) for depth in medium.depths]
    h = sum(np.exp(-d * q) for d in medium.depths) / sum(weights)

    def distance(sigma: float) -> float:
        difference = np.fft.irfft(h - np.exp(-0.5 * (sigma * k) ** 2), len(x)) / step
        ramp = np.cumsum(np.cumsum(np.fft.fftshift(difference))) * step**2
        return float((ramp**2).sum() * step)

    best = medium.sigma0()
    assert distance(best) < distance(0.99 * best)
    assert distance(best) < distance(1.01 * best)


@pytest.mark.parametrize("numbers", [(0.0, 1.0), (1.0, -1.0), (math.nan, 1.0), (1.0, math.inf)])
def test_impossible_media_are_refused_in_a_sentence(numbers: tuple[float, float]) -> None:
    with pytest.raises(ParameterError, match=r"positive numbers.*\.$"):
        Medium(*numbers)
