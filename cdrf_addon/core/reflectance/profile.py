# SPDX-License-Identifier: GPL-3.0-or-later
"""The profile model: for each channel a sum of Gaussians, as of layered skin.

A diffusion profile is the irradiance that one illuminated point sends out around it. As a sum of
Gaussians (d'Eon and Luebke 2007) it blurs the cosine lobe like a sum of ring or sphere models, each
of its own width.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..arguments import checked
from ..errors import ParameterError
from .finite_light import RING_GAIN, SPHERE_GAIN
from .model import PROFILE, RING, SPHERE, Model, table_key
from .ring_model import ring_reflectance
from .sphere_model import sphere_reflectance

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

MOST_GAUSSIANS = 64
# The channels' weights may miss 1 by this much before they are taken for a mistake.
WEIGHT_TOLERANCE = 0.02


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
        """Write the profile as `parse_profile` reads it."""
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
    """Read a profile from text.

    Args:
        text: Gaussians separated by semicolons or line breaks, each of four numbers: width, and
            its parts of red, green and blue.
        base: What each Gaussian is blurred along: RING or SPHERE.

    Raises:
        ParameterError: The text is no such list, or no valid profile.
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
    """Return the model of a profile; its sigma is the RMS width of the widest channel."""
    one = {RING: ring_reflectance, SPHERE: sphere_reflectance}[shape.base]
    rms = shape.rms_widths
    reference = float(rms.max())
    widths = np.array(shape.widths) / reference if reference > 0.0 else np.zeros(len(shape.widths))
    parts = np.array(shape.weights) / np.sum(shape.weights, axis=0)

    def evaluate(theta: ArrayLike, sigma: ArrayLike) -> NDArray[np.float64]:
        _, blur = checked(theta, sigma)
        blurred = []
        for width in widths:
            with np.errstate(over="ignore"):
                # 0 times infinity is 0 here: what does not scatter stays Lambert at any curvature.
                own = blur * width if width > 0.0 else np.zeros_like(blur)
            blurred.append(one(theta, own))
        return np.stack(blurred, axis=-1) @ parts

    moments = (rms / reference) ** 2 if reference > 0.0 else np.ones(3)
    key = table_key(PROFILE, shape.base, shape.to_text())
    red, green, blue = (float(moment) for moment in moments)
    gain = RING_GAIN if shape.base == RING else SPHERE_GAIN
    return Model(PROFILE, key, evaluate, True, (red, green, blue), gain)
