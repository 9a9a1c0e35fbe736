# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets against their sources: Jensen's coefficients and albedos, d'Eon's profile, units."""

import pytest

from cdrf_addon.core.reflectance.model import PROFILE, SPHERE
from cdrf_addon.core.reflectance.profile import SKIN_PROFILE
from cdrf_addon.core.scattering.presets import ARTIST, PRESETS, in_units

pytestmark = pytest.mark.smoke

TOLERANCE = {
    # Three significant digits are written down.
    "digits": 5e-3,
    # Table 1 of Jensen et al. 2001 has two digits, and so have the coefficients it comes from.
    "table": 0.01,
}
MEASURED = {key: preset for key, preset in PRESETS.items() if preset.media}
# Diffuse reflectance in that table, for two materials.
REFLECTANCE = {"SKIN1": (0.44, 0.22, 0.13), "WHOLE_MILK": (0.91, 0.88, 0.76)}


@pytest.mark.parametrize("key", MEASURED)
def test_sigma0_is_that_of_the_coefficients(key: str) -> None:
    preset = MEASURED[key]
    assert preset.media is not None
    for written, medium in zip(preset.sigma0, preset.media, strict=True):
        assert written == pytest.approx(medium.sigma0(), rel=TOLERANCE["digits"])


@pytest.mark.parametrize("key", REFLECTANCE)
def test_albedo_is_that_of_the_paper(key: str) -> None:
    assert PRESETS[key].albedo == pytest.approx(REFLECTANCE[key], abs=TOLERANCE["table"])


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
