# SPDX-License-Identifier: GPL-3.0-or-later
"""The models of reflectance a material can have, each a function of (theta, sigma).

    ring      the paper's: a Gaussian blur along a circle             one table for all channels
    sphere    the same along a sphere; keeps the energy               one table for all channels
    profile   a sum of Gaussians for each channel, on either          a table with three channels
    measured  radiance of path-traced spheres (core/measured.py)      a table with three channels

sigma = sigma0 kappa in all of them: sigma0 is the RMS width of the blur of the channel that
scatters furthest. Where the channels have tables of their own, one look-up serves all three.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..arguments import checked
from ..errors import ParameterError
from .energy import conserving
from .finite_light import RING_GAIN, SPHERE_GAIN
from .ring_model import reflectance
from .sphere_model import sphere_reflectance

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from ..measured.measurement import SphereMeasurement

    Evaluate = Callable[[ArrayLike, ArrayLike], NDArray[np.float64]]

RING, SPHERE, PROFILE, MEASURED = "RING", "SPHERE", "PROFILE", "MEASURED"
DEFAULT_KIND = SPHERE
MODEL_ITEMS = (
    (
        SPHERE,
        "Sphere",
        "Light spreads as heat does on a sphere, and none is lost. Closest to path tracing on "
        "heads and figures; the default",
    ),
    (
        RING,
        "Ring (Kubo 2011)",
        "The paper's own: light spreads along a circle. Bleeds more; brighter at large distances",
    ),
    (
        PROFILE,
        "Profile",
        "A sum of Gaussians for each colour, as of layered skin. One look-up for all colours",
    ),
    (
        MEASURED,
        "Measured",
        "What Cycles shows on spheres of this very material. Press Measure first",
    ),
)
"""Kind, name and tooltip of each model."""
MOST_GAUSSIANS = 64
# The channels' weights may miss 1 by this much before they are taken for a mistake.
WEIGHT_TOLERANCE = 0.02


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
    """Variance of each channel's blur over sigma^2: what the blur of a large light adds to."""
    gain: float = SPHERE_GAIN
    """Part of a large light's variance in the exponent of its gain (core/finite_light.py)."""


def name_of(key: str) -> str:
    """Write a model's key for people."""
    kind, *parameters = key.split()
    return " ".join((kind.title(), *parameters))


def ring() -> Model:
    """The paper's model (Kubo et al. 2011, Eqs. 3 and 4)."""
    return Model(RING, RING, reflectance, gain=RING_GAIN)


def sphere() -> Model:
    """Diffusion over a sphere."""
    return Model(SPHERE, SPHERE, sphere_reflectance)


@dataclass(frozen=True)
class Profile:
    """A diffusion profile as a sum of Gaussians, per channel (d'Eon and Luebke 2007).

    Raises:
        ParameterError: A number is negative or none, or a channel's weights do not add up to 1.
    """

    widths: tuple[float, ...]
    """Standard deviations, in any unit of length: only their ratios count."""
    weights: tuple[tuple[float, float, float], ...]
    """Part of red, green and blue in each Gaussian; each channel is scaled to add up to 1."""
    base: str = SPHERE
    """What each Gaussian is blurred along: RING or SPHERE."""

    def __post_init__(self) -> None:
        if self.base not in {RING, SPHERE}:
            raise ParameterError(f"A profile lies on a RING or a SPHERE, not on '{self.base}'.")
        if not 1 <= len(self.widths) <= MOST_GAUSSIANS or len(self.widths) != len(self.weights):
            raise ParameterError(
                f"A profile has 1 to {MOST_GAUSSIANS} Gaussians, each with a width and the parts "
                "of red, green and blue."
            )
        if any(len(parts) != 3 for parts in self.weights):
            raise ParameterError("Each Gaussian has a width and three parts: red, green and blue.")
        numbers = np.column_stack((self.widths, self.weights)).astype(np.float64)
        if not np.isfinite(numbers).all() or (numbers < 0.0).any():
            raise ParameterError("Widths and parts of a profile are finite numbers of 0 or more.")
        if not max(self.widths) <= 1e30:
            raise ParameterError("A profile's widths end at 1e30.")
        for name, *parts in zip(("red", "green", "blue"), *self.weights, strict=True):
            total = sum(parts)
            if abs(total - 1.0) > WEIGHT_TOLERANCE:
                raise ParameterError(
                    f"The parts of {name} add up to {total:.4g}; they have to add up to 1."
                )

    @property
    def rms_widths(self) -> NDArray[np.float64]:
        """RMS width of each channel, (3,), in the unit of the widths."""
        parts = np.array(self.weights) / np.sum(self.weights, axis=0)
        largest = max(self.widths)
        if not largest > 0.0:
            return np.zeros(3)
        return largest * np.sqrt((np.array(self.widths) / largest) ** 2 @ parts)

    def to_text(self) -> str:
        """One line a Gaussian: width, then red, green and blue."""
        return "; ".join(
            f"{width:.7g} " + " ".join(f"{part:.7g}" for part in parts)
            for width, parts in zip(self.widths, self.weights, strict=True)
        )


# GPU Gems 3, chapter 14 (d'Eon and Luebke 2007): variances in mm^2, here their roots.
SKIN_PROFILE = Profile(
    tuple(math.sqrt(v) for v in (0.0064, 0.0484, 0.187, 0.567, 1.99, 7.41)),
    (
        (0.233, 0.455, 0.649),
        (0.100, 0.336, 0.344),
        (0.118, 0.198, 0.0),
        (0.113, 0.007, 0.007),
        (0.358, 0.004, 0.0),
        (0.078, 0.0, 0.0),
    ),
)


def parse_profile(text: str, base: str = SPHERE) -> Profile:
    """Read a profile: Gaussians parted by semicolons or lines, each width, red, green, blue.

    Raises:
        ParameterError: The text is none.
    """
    rows = []
    for line in text.replace("\n", ";").split(";"):
        words = line.replace(",", " ").split()
        if not words:
            continue
        try:
            numbers = [float(word) for word in words]
        except ValueError:
            raise ParameterError(f"'{line.strip()[:40]}' is not a list of numbers.") from None
        if len(numbers) != 4:
            raise ParameterError(
                f"'{line.strip()[:40]}' has {len(numbers)} numbers; a Gaussian has four: its "
                "width, then its parts of red, green and blue."
            )
        rows.append(numbers)
    return Profile(
        tuple(row[0] for row in rows), tuple((row[1], row[2], row[3]) for row in rows), base
    )


def profile(shape: Profile = SKIN_PROFILE) -> Model:
    """A sum of Gaussians; sigma is the RMS width of the widest channel."""
    one = {RING: reflectance, SPHERE: sphere_reflectance}[shape.base]
    rms = shape.rms_widths
    reference = float(rms.max())
    widths = np.array(shape.widths) / reference if reference > 0.0 else np.zeros(len(shape.widths))
    parts = np.array(shape.weights) / np.sum(shape.weights, axis=0)

    def evaluate(theta: ArrayLike, sigma: ArrayLike) -> NDArray[np.float64]:
        _, blur = checked(theta, sigma)
        blurred = []
        for width in widths:
            with np.errstate(over="ignore"):
                # 0 times infinity is 0 here: what does not spread stays Lambert however curved.
                own = blur * width if width > 0.0 else np.zeros_like(blur)
            blurred.append(one(theta, own))
        return np.stack(blurred, axis=-1) @ parts

    moments = (rms / reference) ** 2 if reference > 0.0 else np.ones(3)
    key = f"{PROFILE} {_hash(shape.base, shape.to_text())}"
    red, green, blue = (float(moment) for moment in moments)
    gain = RING_GAIN if shape.base == RING else SPHERE_GAIN
    return Model(PROFILE, key, evaluate, True, (red, green, blue), gain)


def measured_model(
    spheres: SphereMeasurement, radius: tuple[float, float, float], *, keep_energy: bool
) -> tuple[Model, float]:
    """What was measured on path-traced spheres, for channels of these scatter radii.

    Args:
        spheres: The measurement.
        radius: Of red, green and blue, in any unit.
        keep_energy: Divide by what a sphere gains over Lambert (core/energy.py): closer on bodies
            that are not spheres, and no longer exact on those that are.

    Returns:
        The model, and the sigma0 that belongs to it, in the unit of the radii.
    """
    from ..measured.material_fit import sigma_per_scale
    from ..measured.model import MeasuredModel

    slopes = [sigma_per_scale(spheres, channel) for channel in range(3)]
    widths = [own * slope for own, slope in zip(radius, slopes, strict=True)]
    sigma0 = max(widths)
    # Rows are counted by the widest blur, scales by the largest radius.
    table = MeasuredModel(spheres, radius, sigma0 / max(radius) if sigma0 > 0.0 else None)
    red, green, blue = (float(width / sigma0) ** 2 for width in widths)
    facts = [spheres.blender, spheres.method, spheres.seed, spheres.samples]
    facts += [spheres.all_views, keep_energy]
    numbers = [float(number) for number in (*spheres.albedo, *table.ratio)]
    key = f"{MEASURED} {_hash(str(facts), str(numbers))}"
    evaluate = conserving(table.evaluate) if keep_energy else table.evaluate
    return Model(MEASURED, key, evaluate, True, (red, green, blue)), sigma0


def _hash(*parts: str) -> str:
    return hashlib.blake2b(json.dumps(parts).encode(), digest_size=6).hexdigest()
