# SPDX-License-Identifier: GPL-3.0-or-later
"""What is measured: the estimators, and families of surfaces at sizes and levels of noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from surfaces import BORDER_ROWS

from cdrf_addon.core.curvature.estimators import METHODS
from cdrf_addon.core.curvature.field import CurvatureField, principal_curvatures
from cdrf_addon.core.curvature.tri_mesh import TriMesh

SEED = 19760102
SIZES = (1_000, 10_000, 100_000, 1_000_000)
NOISES = (0.0, 0.001, 0.01)
RADII = (2, 3, 5)
SCALING_SIZES = (10_000, 20_000, 50_000, 100_000, 200_000, 500_000, 1_000_000, 2_000_000)
SCALING_SURFACE = "jittered torus"
LARGE = 200_000
"""From here on the fixed costs of a run no longer count."""
CLICK = "Make Translucent"
# Errors below this are rounding: an estimator is exact on that surface.
EXACT = 1e-7
PARTS = ("inner", "border")
QUANTITIES = ("k1", "k2", "mean", "kappa")


@dataclass(frozen=True)
class Family:
    """Surfaces whose errors are reported together."""

    title: str
    surfaces: tuple[str, ...]
    part: str = "inner"


OPEN = ("cylinder", "cone", "saddle", "catenoid", "sine field")
FAMILIES = {
    # Spheres are apart: normals weighted after Max (1999) are exact there and nowhere else.
    "irregular": Family(
        "Irregular meshes", ("jittered torus", "irregular ellipsoid", "jittered sine field")
    ),
    "spheres": Family("Irregular spheres", ("irregular sphere", "jittered sphere")),
    "regular": Family("Regular closed meshes", ("ico-sphere", "torus")),
    "poles": Family("The UV sphere and its poles", ("UV sphere",)),
    "open": Family("Regular meshes with a boundary, away from it", OPEN),
    "border": Family(
        f"The {BORDER_ROWS} rows of vertices next to a boundary",
        (*OPEN, "jittered sine field"),
        "border",
    ),
}


Config = tuple[str, int | None]
"""A method and, if it takes one, the radius of its fit in rings."""


def configurations(radii: Sequence[int] = RADII) -> list[Config]:
    """List every estimator with every radius it is measured at."""
    return [
        (key, rings)
        for key, method in METHODS.items()
        for rings in (radii if method.takes_radius else (None,))
    ]


def name_of(config: Config) -> str:
    """Name an estimator for the page."""
    method, rings = config
    label = METHODS[method].label if method in METHODS else method
    return label if rings is None else f"{label} {rings}"


def estimate(mesh: TriMesh, config: Config) -> CurvatureField:
    """Run an estimator."""
    method, rings = config
    if rings is None:
        return principal_curvatures(mesh, method=method)
    return principal_curvatures(mesh, method=method, radius=rings)
