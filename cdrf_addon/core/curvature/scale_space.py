# SPDX-License-Identifier: GPL-3.0-or-later
"""Curvature at the length over which light diffuses, for every length at once.

A bump much smaller than the distance that light travels under the surface hardly changes where the
light emerges: what counts is the curvature diffused over that distance (decision 006). The distance
differs from channel to channel and follows the slider, so each vertex keeps kappa at a geometric
series of lengths, and the shader interpolates between them.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..progress import portion
from .diffusion import Diffusion
from .estimators.tensor import shape_operator_steps

if TYPE_CHECKING:
    from .field import CleanCurvature
    from .tri_mesh import Points

# A colour attribute holds four.
LEVELS = 4
# From each length to the next; docs/results/kappa_choice.md has the loss by interpolation.
LEVEL_RATIO = 4.0
# Diffusion length over sigma0, measured against path tracing (docs/results/kappa_choice.md).
LENGTH_PER_SIGMA0 = 2.0
# Length of the mean curvature that decides the energy over that of kappa: what is absorbed on the
# way out is gathered from further away than what blurs
# (docs/develop/decisions/017-view-dependence.md).
MEAN_LENGTH = 2.0
# Level at which the shape operator is kept: shorter ones hold the noise of the mesh.
SHAPE_LEVEL = 1


@dataclass(frozen=True)
class KappaLevels:
    """Curvedness at several diffusion lengths, in the source's vertices and unit."""

    values: Points
    """(N, LEVELS) kappa, 1/unit; column i at the length shortest * LEVEL_RATIO^i."""
    shortest: Points
    """(N,) the shortest length, unit; one number for each component of the surface."""

    def at(self, length: float) -> Points:
        """Interpolate kappa at a length, (N,), linearly in the length's logarithm."""
        place = np.log(np.maximum(length / self.shortest, 1.0)) / np.log(LEVEL_RATIO)
        place = np.minimum(place, LEVELS - 1.0)[:, None]
        weights = np.clip(1.0 - np.abs(np.arange(LEVELS) - place), 0.0, 1.0)
        return np.asarray((self.values * weights).sum(axis=1))


@dataclass(frozen=True)
class DiffusedCurvature:
    """All that is diffused of a surface's curvature, in the source's vertices and unit."""

    kappa: KappaLevels
    mean: Points
    """(N, LEVELS) mean curvature with its sign, at the lengths of kappa, 1/unit."""
    shape: Points
    """(N, 6) the shape operator xx, xy, xz, yy, yz, zz at the length of SHAPE_LEVEL, 1/unit."""


def level_steps(curvature: CleanCurvature) -> Generator[float, None, DiffusedCurvature]:
    """Diffuse the curvature of a mesh over lengths that follow its size, yielding the part done.

    First the mean and the Gaussian curvature over the shortest length: both are signed, so that the
    noise of a scan averages out of them, which it does not of kappa = sqrt(2 mean^2 - Gaussian).
    Then that kappa over the longer ones.

    The lengths are parts of the square root of a component's area, not of its edges: the same shape
    has the same levels however finely it is divided and whatever else the mesh holds.

    Args:
        curvature: Principal curvatures on a clean mesh.

    Returns:
        The levels in the source's vertices and unit.
    """
    mesh = curvature.mesh
    diffusion = Diffusion(mesh)
    yield 0.0
    shortest = diffusion.size() / LEVEL_RATIO**LEVELS
    k1, k2 = curvature.k1, curvature.k2
    mean, gaussian = yield from portion(
        diffusion.steps(((k1 + k2) / 2.0, k1 * k2), shortest), 0.0, 0.4
    )
    # No two curvatures may have these averages as their sum and product; then k1 = k2.
    kappa = np.sqrt(np.maximum(2.0 * mean**2 - gaussian, mean**2))
    # With obtuse triangles a step is not quite an average, and may overshoot.
    kappa = np.minimum(kappa, np.sqrt((k1**2 + k2**2).max() / 2.0))
    kappas, means = [kappa], [mean]
    shape = yield from portion(shape_operator_steps(mesh), 0.4, 0.5)
    for level in range(1, LEVELS):
        length = shortest * LEVEL_RATIO**level
        fields, starts = [kappa, mean], [kappas[-1], means[-1]]
        if level == SHAPE_LEVEL:
            fields, starts = fields + shape, starts + shape
        steps = diffusion.steps(fields, length, starts)
        found = yield from portion(steps, 0.3 + 0.2 * level, 0.5 + 0.2 * level)
        kappas.append(found[0])
        means.append(found[1])
        if level == SHAPE_LEVEL:
            shape = found[2:]

    def columns(fields: list[Points]) -> Points:
        return np.stack([mesh.to_source(values) / mesh.edge for values in fields], axis=1)

    lengths = mesh.to_source(shortest, loose=1.0) * mesh.edge
    return DiffusedCurvature(KappaLevels(columns(kappas), lengths), columns(means), columns(shape))
