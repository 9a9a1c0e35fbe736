# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials by name: sigma0 in millimetres for red, green and blue, and where it comes from."""

from __future__ import annotations

from dataclasses import dataclass

from ..reflectance.model import PROFILE, SPHERE
from .dipole import Medium

Colour = tuple[float, float, float]
JENSEN = "Jensen et al. 2001, measured"
DEON = "d'Eon and Luebke 2007, GPU Gems 3: six Gaussians, RMS widths"
ARTIST = "an artist's choice, not measured"


@dataclass(frozen=True)
class Preset:
    """A material; what was measured of it says where sigma0 comes from."""

    label: str
    sigma0: Colour
    """Scatter distance, mm. For measured media that of `Medium.sigma0`, to three digits."""
    albedo: Colour
    source: str
    media: tuple[Medium, Medium, Medium] | None = None
    model: str = SPHERE
    """Kind of the model of reflectance it is meant for."""

    @property
    def description(self) -> str:
        """One sentence for a tooltip."""
        red, green, blue = self.sigma0
        return f"Scatters red {red:g}, green {green:g}, blue {blue:g} mm. Source: {self.source}"


def _measured(label: str, sigma0: Colour, scattering: Colour, absorption: Colour) -> Preset:
    eta = 1.5 if label == "Marble" else 1.3  # as in the paper's figures
    red, green, blue = (Medium(s, a, eta) for s, a in zip(scattering, absorption, strict=True))
    albedo = (red.albedo, green.albedo, blue.albedo)
    return Preset(label, sigma0, albedo, JENSEN, (red, green, blue))


# Coefficients in 1/mm: Jensen et al. 2001, table 1.
PRESETS: dict[str, Preset] = {
    "SKIN1": _measured("Skin, dark", (2.63, 1.20, 0.674), (0.74, 0.88, 1.01), (0.032, 0.17, 0.48)),
    "SKIN2": _measured(
        "Skin, light", (2.73, 1.22, 0.855), (1.09, 1.59, 1.79), (0.013, 0.070, 0.145)
    ),
    "SKIN_LAYERED": Preset(
        "Skin, layered",
        (1.176, 0.261, 0.157),
        (0.74, 0.49, 0.40),
        DEON,
        model=PROFILE,
    ),
    "MARBLE": _measured("Marble", (2.92, 2.17, 1.70), (2.19, 2.62, 3.00), (0.0021, 0.0041, 0.0071)),
    "WHOLE_MILK": _measured(
        "Milk, whole", (2.59, 1.84, 1.08), (2.55, 3.21, 3.77), (0.0011, 0.0024, 0.014)
    ),
    "SKIM_MILK": _measured(
        "Milk, skimmed", (6.78, 3.87, 1.79), (0.70, 1.22, 1.90), (0.0014, 0.0025, 0.0142)
    ),
    "CREAM": _measured("Cream", (1.46, 1.17, 1.19), (7.38, 5.47, 3.15), (0.0002, 0.0028, 0.0163)),
    "KETCHUP": _measured("Ketchup", (4.50, 0.724, 0.502), (0.18, 0.07, 0.03), (0.061, 0.97, 1.45)),
    "POTATO": _measured("Potato", (6.09, 4.16, 1.81), (0.68, 0.70, 0.55), (0.0024, 0.0090, 0.12)),
    "APPLE": _measured("Apple", (2.28, 2.15, 1.23), (2.29, 2.39, 1.97), (0.0030, 0.0034, 0.046)),
    "CHICKEN": _measured("Chicken", (9.35, 3.71, 1.75), (0.15, 0.21, 0.38), (0.015, 0.077, 0.19)),
    "JADE": Preset("Jade", (3.0, 5.0, 3.5), (0.25, 0.55, 0.35), ARTIST),
    "WAX": Preset("Wax", (8.0, 5.0, 2.5), (0.90, 0.82, 0.62), ARTIST),
}


def in_units(sigma0: Colour, unit_scale: float, size: float = 1.0) -> tuple[float, Colour]:
    """Turn millimetres into a scene's units.

    Args:
        sigma0: Scatter distance of each channel, mm.
        unit_scale: Metres in a unit of the scene.
        size: Size of the object in the scene over its real size.

    Returns:
        The largest of the three in units, and the three as factors of it.
    """
    largest = max(sigma0)
    red, green, blue = (channel / largest if largest > 0.0 else 1.0 for channel in sigma0)
    return largest * 1e-3 / unit_scale * size, (red, green, blue)
