# SPDX-License-Identifier: GPL-3.0-or-later
"""The materials: lengths of the presets, the nodes that scatter as far, profiles of Gaussians.

A preset's sigma0 is millimetres; a scene's unit stands for as many of them as its shape says. The
radius of Cycles' Subsurface Scattering node is the one of which *From Shader Nodes* makes that
sigma0, so the path tracer and the extension are given one and the same number.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.optimize import nnls

from cdrf_addon.core.reflectance.profile import Profile
from cdrf_addon.core.scattering.node_radius import RANDOM_WALK, sigma0_per_radius
from cdrf_addon.core.scattering.presets import PRESETS, Colour, Preset

from ..common.arrays import Array

PRESET_OF = {"skin": "SKIN2", "marble": "MARBLE", "milk": "WHOLE_MILK"}
GAUSSIANS = 6
# From a fraction of the narrowest channel's length to several of the widest's.
NARROWEST, WIDEST = 0.2, 3.0


@dataclass(frozen=True)
class Substance:
    """A material of the report."""

    name: str
    preset: Preset

    @property
    def albedo(self) -> Colour:
        """Of red, green and blue."""
        return self.preset.albedo

    def sigma0(self, millimetres: float) -> Array:
        """Scatter distance of each channel in units of so many millimetres, (3,)."""
        return np.array(self.preset.sigma0) / millimetres

    def radius(self, millimetres: float, method: str = RANDOM_WALK) -> Array:
        """Subsurface radius of each channel in those units, (3,), by the path tracer's method."""
        return np.asarray(self.sigma0(millimetres) / sigma0_per_radius(self.albedo, method))


def substance(name: str) -> Substance:
    """A material by its name in the report."""
    return Substance(name, PRESETS[PRESET_OF[name]])


@cache
def profile_of(name: str) -> Profile:
    """Six Gaussians for the dipole of a material, as d'Eon and Luebke fitted theirs; widths in mm.

    The weights minimise the squared error of a straight terminator, as the preset's sigma0 does.
    """
    media = substance(name).preset.media
    assert media is not None
    sigma0 = substance(name).preset.sigma0
    widths = np.geomspace(NARROWEST * min(sigma0), WIDEST * max(sigma0), GAUSSIANS)
    k = np.logspace(-3.0, 2.0, 400)
    weight = k**-1.5
    columns = []
    for medium in media:
        shares = np.exp(-np.array(medium.depths) * medium.transport)
        q = np.hypot(k, medium.transport)[:, None] - medium.transport
        wanted = np.exp(-np.array(medium.depths) * q) @ (shares / shares.sum())
        gaussians = np.exp(-0.5 * (widths * k[:, None]) ** 2)
        found, _ = nnls(gaussians * weight[:, None], wanted * weight)
        columns.append(found / found.sum())
    rows = [(float(r), float(g), float(b)) for r, g, b in np.array(columns).T]
    return Profile(tuple(float(width) for width in widths), tuple(rows))
