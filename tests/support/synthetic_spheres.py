# SPDX-License-Identifier: GPL-3.0-or-later
"""A measurement of spheres whose truth is known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cdrf_addon.core.measured.measurement import SphereMeasurement
from cdrf_addon.core.reflectance.sphere_model import sphere_reflectance

Array = NDArray[np.float64]
SEED = 20111106
# sigma = 2 s, as a sphere of albedo 0.8 has it, and a gain that grows with the scale.
SLOPE = 2.0
SCALES = 2.0 ** np.arange(-8.0, 3.0, 0.5)
COSINE = np.linspace(-0.96, 0.96, 72)


def truth(theta: Array, scale: Array | float) -> Array:
    gain = 1.0 + 0.1 * np.tanh(4.0 * np.asarray(scale))
    return np.asarray(gain * sphere_reflectance(theta, SLOPE * np.asarray(scale)))


def synthetic(noise: float = 1e-3, seed: int = SEED) -> SphereMeasurement:
    rng = np.random.default_rng(seed)
    exact = truth(np.arccos(COSINE)[None, :], SCALES[:, None])
    errors = noise * (0.2 + np.maximum(COSINE, 0.0))
    values = exact[:, None, :] + rng.normal(size=(len(SCALES), 3, len(COSINE))) * errors
    return SphereMeasurement(
        np.array([0.8, 0.5, 0.3]), SCALES, COSINE, values, np.broadcast_to(errors, values.shape)
    )
