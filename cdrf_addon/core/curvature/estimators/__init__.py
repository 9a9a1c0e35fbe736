# SPDX-License-Identifier: GPL-3.0-or-later
"""Estimators of curvature behind one interface; docs/results/estimators.md has errors and times."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...progress import portion
from .estimate import Estimate
from .libigl import libigl_steps
from .meyer import meyer_steps
from .polynomial import CUBIC, GOLDFEATHER, QUADRIC, polynomial_steps
from .tensor import tensor_steps

if TYPE_CHECKING:
    from ..clean import CleanMesh

Steps = Generator[float, None, Estimate]


@dataclass(frozen=True)
class Method:
    """A way to estimate curvature."""

    label: str
    """Name in the menu."""
    description: str
    """Tooltip."""
    steps: Callable[[CleanMesh, int], Steps]
    """(clean mesh, rings) to a generator of progress that returns an Estimate."""
    takes_radius: bool = True
    """Whether the number of rings changes the result."""


def _richardson_steps(mesh: CleanMesh, radius: int) -> Steps:
    """Cancel the leading error of two quadric fits, which grows with the area of the rings."""
    near = yield from portion(polynomial_steps(mesh, radius, QUADRIC), 0.0, 0.4)
    wide = yield from portion(polynomial_steps(mesh, radius + 1, QUADRIC), 0.4, 1.0)
    both = near.good & wide.good
    k1 = near.k1 + both * (near.k1 - wide.k1)
    k2 = near.k2 + both * (near.k2 - wide.k2)
    # Extrapolation may swap two that are nearly equal.
    return Estimate(np.maximum(k1, k2), np.minimum(k1, k2), near.good)


METHODS = {
    "CUBIC": Method(
        "Cubic Fit",
        "A cubic through the rings of neighbours: the least error for its time on clean meshes",
        lambda mesh, radius: polynomial_steps(mesh, radius, CUBIC),
    ),
    "QUADRIC": Method(
        "Quadric Fit",
        "A quadric through the rings of neighbours: a little faster than the cubic",
        lambda mesh, radius: polynomial_steps(mesh, radius, QUADRIC),
    ),
    "RICHARDSON": Method(
        "Quadric Fit, Extrapolated",
        "Two quadric fits combined so that their leading errors cancel",
        _richardson_steps,
    ),
    "LIBIGL": Method(
        "Quadric Fit of libigl",
        "The library's own fit (Panozzo et al. 2010), slower than ours",
        libigl_steps,
    ),
    "GOLDFEATHER": Method(
        "Goldfeather-Interrante",
        "A cubic through positions and normals (2004), reference 11 of the paper",
        lambda mesh, radius: polynomial_steps(mesh, radius, GOLDFEATHER, use_normals=True),
    ),
    "MEYER": Method(
        "Meyer et al.",
        "Cotangents and angle defects (2003), reference 10 of the paper; wrong on irregular meshes",
        lambda mesh, _radius: meyer_steps(mesh),
        takes_radius=False,
    ),
    "TENSOR": Method(
        "Rusinkiewicz (Fast)",
        "Turn of the normals along the edges (2004): for previews and deforming meshes",
        lambda mesh, _radius: tensor_steps(mesh),
        takes_radius=False,
    ),
}

DEFAULT_METHOD = "CUBIC"
DEFAULT_RADIUS = 2
