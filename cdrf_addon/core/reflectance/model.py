# SPDX-License-Identifier: GPL-3.0-or-later
"""The kinds of reflectance model a material can have, each a function of (theta, sigma).

    ring      the paper's: a Gaussian blur along a circle             one table for all channels
    sphere    the same along a sphere; keeps the energy               one table for all channels
    profile   a sum of Gaussians for each channel, on either          a table with three channels
    measured  radiance of path-traced spheres (core/measured)         a table with three channels

sigma = sigma0 kappa in all of them: sigma0 is the RMS width of the blur of the channel that
scatters furthest. Where the channels have tables of their own, one look-up serves all three.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

from .finite_light import RING_GAIN, SPHERE_GAIN
from .ring_model import ring_reflectance
from .sphere_model import sphere_reflectance

if TYPE_CHECKING:
    from ..arguments import Evaluate

RING, SPHERE, PROFILE, MEASURED = "RING", "SPHERE", "PROFILE", "MEASURED"
DEFAULT_KIND = SPHERE
MODEL_ITEMS = (
    (
        SPHERE,
        "Path-Traced Look",
        "As Cycles shows skin, wax and marble: softer where the surface bends, brighter at its "
        "rim. View Dependence below takes the rim out again; the default",
    ),
    (
        RING,
        "Paper (Kubo 2011)",
        "As in the paper: light spreads along a circle. Bleeds more; brighter at large distances",
    ),
    (
        PROFILE,
        "Profile",
        "A soft edge of several widths for each colour, as layered skin has. One look-up for all "
        "colours",
    ),
    (
        MEASURED,
        "Measured (older)",
        "A table that was path-traced for this material. Older files have it; Path-Traced Look "
        "comes closer and needs no minute of Cycles",
    ),
)
"""Kind, name and tooltip of each model."""
OFFERED_KINDS = (SPHERE, RING, PROFILE)
"""What the panel offers; scripts and older files may have the others."""


@dataclass(frozen=True)
class Model:
    """A reflectance that can be tabulated."""

    kind: str
    """RING, SPHERE, PROFILE or MEASURED."""
    key: str
    """Name of its table in a .blend: the kind, and a hash where the kind has parameters."""
    evaluate: Evaluate
    """(theta, sigma), broadcast, to the reflectance; with a last axis of 3 where `colour`."""
    colour: bool = False
    """True where red, green and blue differ at the same sigma."""
    moments: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Variance of each channel's blur over sigma^2, to which that of a large light is added."""
    gain: float = SPHERE_GAIN
    """Part of a large light's variance in the exponent of its gain (finite_light.py)."""


def name_of(key: str) -> str:
    """Return a model's key as people read it: "Profile 1f2e..."."""
    kind, *parameters = key.split()
    return " ".join((kind.title(), *parameters))


def ring() -> Model:
    """Return the paper's model: a blur along a circle (Kubo et al. 2011, Eqs. 3 and 4)."""
    return Model(RING, RING, ring_reflectance, gain=RING_GAIN)


def sphere() -> Model:
    """Return the model of heat that diffuses over a sphere."""
    return Model(SPHERE, SPHERE, sphere_reflectance)


def table_key(kind: str, *parameters: str) -> str:
    """Return the name of a model's table in a .blend: its kind and a hash of its parameters."""
    digest = hashlib.blake2b(json.dumps(parameters).encode(), digest_size=6).hexdigest()
    return f"{kind} {digest}"
