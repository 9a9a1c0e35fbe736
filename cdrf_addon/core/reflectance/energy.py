# SPDX-License-Identifier: GPL-3.0-or-later
"""The energy that a whole sphere sends out, and models that conserve it.

A path-traced sphere of a long scatter distance is up to a third brighter than Lambert's: it is
convex everywhere, so light that is lost in one place emerges in another. A head is not convex. With
that gain, the measured table is further from path tracing than Lambert on heads; divided by it, it
is as close as the sphere model (docs/results/model_choice.md).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from ..arguments import Evaluate

# The energy is tabulated between these widths, radians, and constant beyond.
FIRST_SIGMA, LAST_SIGMA, WIDTHS = 1e-7, 10.0, 512
# Of the quadrature over the sphere.
NODES = 256


def sphere_energy(evaluate: Evaluate, sigma: ArrayLike) -> NDArray[np.float64]:
    """Integrate a model over the sphere, relative to Lambert's mean of 1/4.

    Gauss-Legendre quadrature in cos theta on either side of the terminator, where max(cos theta, 0)
    has its corner.

    Args:
        evaluate: The model.
        sigma: Blur widths, radians, any shape.

    Returns:
        1 where no energy is gained or lost, of sigma's shape and the model's channels.
    """
    node, weight = np.polynomial.legendre.leggauss(NODES // 2)
    cosine = np.concatenate(((node - 1.0) / 2.0, (node + 1.0) / 2.0))
    weights = np.concatenate((weight, weight)) / 2.0
    width = np.asarray(sigma, dtype=np.float64)
    values = evaluate(np.arccos(cosine), width[..., None])
    return np.asarray(2.0 * np.tensordot(weights, values, axes=(0, width.ndim)))


def conserving(evaluate: Evaluate) -> Evaluate:
    """Divide a model with colour by its energy, channel by channel; the energy must be above 0."""
    widths = np.concatenate(([0.0], np.geomspace(FIRST_SIGMA, LAST_SIGMA, WIDTHS)))
    energy = sphere_energy(evaluate, widths)

    def conserved(theta: ArrayLike, sigma: ArrayLike) -> NDArray[np.float64]:
        values = evaluate(theta, sigma)
        width = np.broadcast_to(np.asarray(sigma, dtype=np.float64), values.shape[:-1])
        gain = np.stack([np.interp(width, widths, part) for part in energy.T], axis=-1)
        return np.asarray(values / gain)

    return conserved
