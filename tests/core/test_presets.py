# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets against their sources: Jensen's dipole in another form, d'Eon's profile, units."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from cdrf_addon.core.errors import ParameterError
from cdrf_addon.core.reflectance.model import PROFILE, SKIN_PROFILE, SPHERE
from cdrf_addon.core.scattering.dipole import Medium
from cdrf_addon.core.scattering.presets import ARTIST, PRESETS, in_units

pytestmark = pytest.mark.smoke

TOLERANCE = {
    # Three significant digits are written down.
    "digits": 5e-3,
    # Adaptive quadrature of the dipole over the plane.
    "quadrature": 1e-6,
    # Table 1 of Jensen et al. 2001 has two digits, and so have the coefficients it comes from.
    "table": 0.01,
}
MEASURED = {key: preset for key, preset in PRESETS.items() if preset.media}
# Diffuse reflectance in that table, for two materials.
REFLECTANCE = {"SKIN1": (0.44, 0.22, 0.13), "WHOLE_MILK": (0.91, 0.88, 0.76)}


def dipole(medium: Medium, distance: float) -> float:
    """R_d(r), Jensen et al. 2001, Eq. 4, as it stands there."""
    albedo = medium.scattering / medium.extinction
    total = 0.0
    for depth in medium.depths:
        d = math.hypot(distance, depth)
        total += depth * (1.0 + medium.transport * d) * math.exp(-medium.transport * d) / d**3
    return albedo / (4.0 * math.pi) * total


@pytest.mark.parametrize("key", MEASURED)
def test_sigma0_is_that_of_the_coefficients(key: str) -> None:
    preset = MEASURED[key]
    assert preset.media is not None
    for written, medium in zip(preset.sigma0, preset.media, strict=True):
        assert written == pytest.approx(medium.sigma0(), rel=TOLERANCE["digits"])


@pytest.mark.parametrize("key", ["SKIN1", "MARBLE", "KETCHUP"])
def test_the_closed_forms_are_those_of_the_dipole(key: str) -> None:
    media = MEASURED[key].media
    assert media is not None
    for medium in media:
        end = 60.0 / medium.transport

        def over_the_plane(power: int, medium: Medium = medium, end: float = end) -> float:
            def integrand(r: float) -> float:
                return 2.0 * math.pi * r ** (1 + power) * dipole(medium, r)

            return float(quad(integrand, 0.0, end, limit=400, epsabs=0.0, epsrel=1e-9)[0])

        assert medium.albedo == pytest.approx(over_the_plane(0), rel=TOLERANCE["quadrature"])
        variance = over_the_plane(2) / over_the_plane(0) / 2.0  # of one axis
        assert medium.rms_width == pytest.approx(math.sqrt(variance), rel=TOLERANCE["quadrature"])
        assert medium.sigma0() < medium.rms_width


@pytest.mark.parametrize("key", REFLECTANCE)
def test_albedo_is_that_of_the_paper(key: str) -> None:
    assert PRESETS[key].albedo == pytest.approx(REFLECTANCE[key], abs=TOLERANCE["table"])


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


def test_every_preset_says_where_it_comes_from() -> None:
    for key, preset in PRESETS.items():
        assert min(preset.sigma0) > 0.0
        assert all(0.0 <= part <= 1.0 for part in preset.albedo)
        assert preset.source in preset.description
        assert (preset.source == ARTIST) == (key in {"JADE", "WAX"})
        assert preset.model in {SPHERE, PROFILE}
    layered = PRESETS["SKIN_LAYERED"]
    assert layered.model == PROFILE
    assert layered.sigma0 == pytest.approx(tuple(SKIN_PROFILE.rms_widths), rel=TOLERANCE["digits"])


@pytest.mark.parametrize("metres", [1.0, 0.01, 0.001, 0.3048])
def test_millimetres_are_millimetres_in_any_unit(metres: float) -> None:
    sigma0, ratio = in_units((2.0, 1.0, 0.5), metres)
    assert sigma0 * metres * 1e3 == pytest.approx(2.0, rel=1e-14)
    assert ratio == (1.0, 0.5, 0.25)
    assert in_units((2.0, 1.0, 0.5), metres, 10.0)[0] == pytest.approx(10.0 * sigma0)


@pytest.mark.parametrize("numbers", [(0.0, 1.0), (1.0, -1.0), (math.nan, 1.0), (1.0, math.inf)])
def test_impossible_media_are_refused_in_a_sentence(numbers: tuple[float, float]) -> None:
    with pytest.raises(ParameterError, match=r"positive numbers.*\.$"):
        Medium(*numbers)
