# SPDX-License-Identifier: GPL-3.0-or-later
"""Sizes, materials, lights and ranges of the study, shared by its modules."""

from __future__ import annotations

LEVEL = 2
OTHER_LEVELS = (1, 3)
ALBEDO = 0.9
RATIO = (1.0, 0.35, 0.2)
SCALES = (0.03, 0.1)
LIGHTS = {"left": (-0.85, -0.40, 0.35), "right": (0.95, 0.15, 0.25)}
"""Directions towards the sun; the camera looks along +Y. Two, as a slider must serve them all."""
BOUNCES = 0
"""No light from surface to surface: neither CDRF nor a Diffuse BSDF in EEVEE has it."""
MANY_BOUNCES = 12

FIXED = (0.02, 0.04, 0.08, 0.16, 0.32, 0.64)
FACTORS = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
LADDER_START, LADDER_STEP, LADDER_COUNT = 0.004, 2.0 ** (1.0 / 3.0), 31
LADDER = (0.0, *(LADDER_START * LADDER_STEP**i for i in range(LADDER_COUNT)))
SIGMA0_RANGE = (1e-3, 3.0)
SIGMA0_GRID = 18
NOISES = (0.01, 0.05, 0.2)
"""Standard deviations of the vertices along their normals, in median edges."""
QUOTIENTS = (3, 4, 5)
STORED = 4
SLIDER_STEPS = (0.1, 0.25, 0.5, 1.0, 2.0)
RECOMMENDED = ("mean and Gaussian over √area/256, curvedness", 2.0)
PLAIN = "curvedness"
