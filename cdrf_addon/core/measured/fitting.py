# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit one closed-form model to one sphere: its blur width sigma, and its gain if that is free."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..reflectance.ring_model import ring_reflectance
from ..reflectance.sphere_model import sphere_reflectance

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

MODELS: dict[str, Callable[..., Array]] = {"ring": ring_reflectance, "sphere": sphere_reflectance}
# Widths tried before the best of them is refined; 0 is Lambert.
SIGMAS = np.concatenate(([0.0], np.geomspace(1e-3, 8.0, 120)))
SIGMA_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Fit:
    """The best width and gain of a model, and what it leaves: RMS in units of max(cos, 0)."""

    sigma: float
    gain: float
    rms: float


class ModelFitter:
    """A model tabulated at the angles of a measurement, ready to be fitted to many spheres.

    Args:
        name: "ring" or "sphere".
        theta: (B,) angles, radians.
        weights: (B,) weights of the squared residuals, any positive scale.
    """

    def __init__(self, name: str, theta: Array, weights: Array) -> None:
        self._model = MODELS[name]
        self._theta = theta
        self._weights = weights / weights.sum()
        self._table = self._model(theta[None, :], SIGMAS[:, None])

    def _gain(self, model: Array, values: Array) -> Array:
        """Gain of least squares, over the last axis."""
        power = (model**2 * self._weights).sum(axis=-1)
        found: Array = (model * values * self._weights).sum(axis=-1) / power
        return found

    def _rms(self, model: Array, values: Array, gain: float | None) -> tuple[Array, Array]:
        scale = self._gain(model, values) if gain is None else np.full(model.shape[:-1], gain)
        left = ((scale[..., None] * model - values) ** 2 * self._weights).sum(axis=-1)
        return np.sqrt(left), scale

    def fit(self, values: Array, gain: float | None = 1.0) -> Fit:
        """Fit sigma, and the gain too if it is None.

        Args:
            values: (B,) radiance / (albedo * irradiance / pi).
            gain: Factor on the model; None leaves it free.
        """
        from scipy.optimize import minimize_scalar  # late: scipy takes 0.2 s to load

        tried, _ = self._rms(self._table, values, gain)
        best = int(tried.argmin())
        low, high = SIGMAS[max(best - 1, 0)], SIGMAS[min(best + 1, len(SIGMAS) - 1)]

        def left(sigma: float) -> float:
            return float(self._rms(self._model(self._theta, sigma), values, gain)[0])

        found = minimize_scalar(
            left, bounds=(low, high), method="bounded", options={"xatol": SIGMA_TOLERANCE}
        )
        sigma = float(found.x) if found.fun < tried[best] else float(SIGMAS[best])
        rms, scale = self._rms(self._model(self._theta, sigma), values, gain)
        return Fit(sigma, float(scale), float(rms))
