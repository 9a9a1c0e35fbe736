# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounds on rendered pixels, each with its reason. The peak of every reference is 1."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Bound:
    """Largest allowed worst error and RMS error over the pixels a sphere covers."""

    worst: float
    rms: float
    reason: str


WRITTEN = Bound(
    1e-3, 2e-4, "the film is half float: 4.9e-4 at values over 1/2, and it truncates (mean -1.6e-4)"
)
SHADER = Bound(
    1e-4,
    3e-5,
    "bilinear look-up: 6.5e-5 in the ideal (core/reflectance/lut.py), float32 arithmetic 1e-6",
)
WALK = Bound(
    3e-4,
    1e-4,
    "the look-up's 1e-4 times a gain of up to 1.5; the walk's formulas in float32, to 1e-5",
)
FOUR_LIGHTS = Bound(
    1e-3,
    3e-4,
    "the sum of four lights peaks at 1; each light's look-up error scales with its share",
)
DIFFUSE = Bound(
    5e-3, 2e-3, "the issue's 0.5 %; the sphere light's fit takes 0.4 % of it at 46 degrees"
)
# EEVEE's own table of the horizon leaves 0.8 % of the peak at N.L = 0 for a light without size
# (64 texels over N.L in [-1, 1]); a pixel that close to the terminator shows nothing of ours.
DIFFUSE_TERMINATOR = 0.01
DIFFUSE_AT_TERMINATOR = Bound(9e-3, 9e-3, "EEVEE's table: half a texel of 1/63 at N.L = 0")
WORLD_CYCLES = Bound(
    0.06,
    0.012,
    "a square window is shaded as a disc; path tracing with 128 samples has 1 to 2 % of noise",
)
SHADOW = Bound(
    8e-3,
    2e-3,
    "clear of edges, in a peak of 1/2: EEVEE's horizon table leaves 0.8 % of a light in the plane "
    "where another is measured; bleeding beyond 5 sigma0 is cut",
)
SHADOW_OF_HAT = Bound(
    2e-2,
    2e-3,
    "behind the terminator an occluder nearer than 5 sigma0 is skipped, and with it 0.016 of light",
)
SHADOW_OF_MANY = Bound(0.3, 1e-2, "one mask for all lights darkens those that are not blocked")
SHADOW_WORLD = Bound(
    2e-2, 1e-2, "EEVEE's world light is not quite the even function that is taken off"
)
