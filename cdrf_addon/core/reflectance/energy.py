# SPDX-License-Identifier: GPL-3.0-or-later
"""The energy a reflectance sends out over a whole sphere, and models that keep it.

A path-traced sphere that scatters far is up to a third brighter than Lambert's: it is curved the
same way everywhere, so light that leaves one place arrives at another. A head is not. With that
gain, the measured table is further from path tracing than Lambert on heads; divided by it, as close
as the sphere model (docs/results/model_choice.md).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from ..arguments import Evaluate

# Between these widths, radians, the energy is tabulated; beyond them it is that at the ends.
FIRST_SIGMA, LAST_SIGMA, WIDTHS = 1e-7, 10.0, 512
NODES = 256


def sphere_energy(evaluate: Evaluate, sigma: ArrayLike) -> NDArray[np.float64]:
    """Mean over the sphere relative to Lambert's 1/4, of sigma's shape and the model's channels.

    Gauss-Legendre in cos theta on either side of the terminator, where Lambert has its corner.
    """
    node, weight = np.polynomial.legendre.leggauss(NODES // 2)
    cosine = np.concatenate(((node - 1.0) / 2.0, (node + 1.0) / 2.0))
    weights = np.concatenate((weight, weight)) / 2.0
    width = np.asarray(sigma, dtype=np.float64)
    values = evaluate(np.arccos(cosine), width[..., None])
    return np.asarray(2.0 * np.tensordot(weights, values, axes=(0, width.ndim)))


def conserving(evaluate: Evaluate) -> Evaluate:
    """Divide a model with colour by its energy, channel by channel; what it divides is above 0."""
    widths = np.concatenate(([0.0], np.geomspace(FIRST_SIGMA, LAST_SIGMA, WIDTHS)))
    energy = sphere_energy(evaluate, widths)

    def kept(theta: ArrayLike, sigma: ArrayLike) -> NDArray[np.float64]:
        values = evaluate(theta, sigma)
        width = np.broadcast_to(np.asarray(sigma, dtype=np.float64), values.shape[:-1])
        gain = np.stack([np.interp(width, widths, part) for part in energy.T], axis=-1)
        return np.asarray(values / gain)

    return kept
