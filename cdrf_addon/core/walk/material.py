# SPDX-License-Identifier: GPL-3.0-or-later
"""Which random walk a material stands for, as a key that a node group can be stamped with."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from ..errors import ParameterError
from ..scattering.node_radius import BURLEY, RANDOM_WALK, sigma0_per_radius
from .entry import LEAST_IOR, MOST_IOR
from .medium import METHODS, medium
from .view import WalkModel, walk_model

MOST_ANISOTROPY = 0.99


@dataclass(frozen=True)
class MaterialWalk:
    """A method with what its node says of the surface; values out of range are clamped."""

    method: str = RANDOM_WALK
    alpha: float = 1.0
    """GGX alpha of the surface: the SSS node's Roughness, the square of the Principled BSDF's."""
    ior: float = 1.4
    anisotropy: float = 0.0

    def __post_init__(self) -> None:
        for name, low, high, usual in (
            ("alpha", 0.0, 1.0, 1.0),
            ("ior", LEAST_IOR, MOST_IOR, 1.4),
            ("anisotropy", -MOST_ANISOTROPY, MOST_ANISOTROPY, 0.0),
        ):
            value = float(getattr(self, name))
            value = min(max(value, low), high) if math.isfinite(value) else usual
            # Three digits decide less than the walk's own error, and materials share groups.
            object.__setattr__(self, name, float(f"{value:.3g}"))

    @property
    def key(self) -> str:
        """The walk as text; empty where the method does not depend on the view."""
        if self.method == BURLEY:
            return ""
        return f"{self.method} {self.alpha:g} {self.ior:g} {self.anisotropy:g}"


DEFAULT_WALK = MaterialWalk()
"""That of the Subsurface Scattering node as Blender adds it."""


def free_path_ratio(albedo: Sequence[float], walk: MaterialWalk) -> tuple[float, float, float]:
    """Return the mean free path over sigma0 of red, green and blue.

    Both are proportional to the node's radius; the albedo decides how many flights a walk has.
    """
    factors = sigma0_per_radius(albedo, walk.method)
    paths = (
        medium(walk.method, albedo, 1.0, walk.anisotropy, walk.alpha, walk.ior).mean_free_path
        / factors
    )
    red, green, blue = (float(path) for path in paths)
    return red, green, blue


@lru_cache(maxsize=64)
def model_of_key(key: str) -> WalkModel:
    """Return the coefficients of the walk that a key stands for.

    Raises:
        ParameterError: The text is no key.
    """
    words = key.split()
    try:
        if len(words) != 4 or words[0] not in METHODS:
            raise ValueError
        numbers = [float(word) for word in words[1:]]
    except ValueError:
        raise ParameterError(f"'{key[:60]}' names no random walk.") from None
    walk = MaterialWalk(words[0], *numbers)
    return walk_model(walk.method, walk.alpha, walk.ior, walk.anisotropy)
