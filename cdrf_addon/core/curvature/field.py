# SPDX-License-Identifier: GPL-3.0-or-later
"""Principal curvatures at the vertices of any mesh: clean it, estimate, fill where the fit fails.

kappa is the curvedness sqrt((k1^2 + k2^2) / 2) of Koenderink and van Doorn (1992), which is 1/r on
a sphere of radius r. The work is a generator, so that an operator can show its progress and stop
between two steps.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ParameterError
from ..progress import counted, portion, run_steps
from .clean import CleaningReport, CleanMesh, clean_steps
from .creases import NO_CREASE
from .estimators import DEFAULT_METHOD, DEFAULT_RADIUS, METHODS
from .topology import adjacency, vertex_normals

if TYPE_CHECKING:
    from .tri_mesh import Mask, Points, TriMesh

# Rounds of filling bad vertices from their neighbours: holes of up to this many rings close.
FILL_ROUNDS = 64
# Curvature radii below this part of the median edge are noise of the fit, not shape.
CURVATURE_LIMIT = 1e3


@dataclass(frozen=True)
class Options:
    """How curvature is measured."""

    method: str = DEFAULT_METHOD
    """Key of METHODS."""
    radius: int = DEFAULT_RADIUS
    """Rings of neighbours in the fit, 2 to 10: 2 is the most accurate on clean meshes, 3 to 5 suit
    noisy scans. Methods without rings ignore it."""
    crease_angle: float = NO_CREASE
    """Do not fit across edges at which faces meet at a sharper angle than this, radians."""


DEFAULT_OPTIONS = Options()


@dataclass(frozen=True)
class CurvatureField:
    """Principal curvatures at the vertices of the source mesh, 1/unit; all arrays (n,) float64."""

    k1: Points
    """The larger principal curvature; positive where the surface bulges outwards."""
    k2: Points
    """The smaller principal curvature."""
    filled: Mask
    """True where the fit failed and the value comes from the neighbours (or is 0: no face)."""
    report: CleaningReport = field(default_factory=CleaningReport)

    @property
    def kappa(self) -> Points:
        """Curvedness sqrt((k1^2 + k2^2) / 2) >= 0 (Koenderink and van Doorn 1992)."""
        return np.asarray(np.hypot(self.k1, self.k2) / np.sqrt(2.0))

    @property
    def mean(self) -> Points:
        """Signed mean curvature (k1 + k2) / 2."""
        return self.k1 / 2.0 + self.k2 / 2.0

    def sentences(self) -> list[str]:
        """Describe for an artist what was unusual, a sentence each; empty on a good mesh."""
        lines = self.report.sentences()
        count = int(self.filled.sum())
        if count:
            lines.append(
                f"{count:,} of {len(self.filled):,} vertices have too few faces around them for a "
                "fit; their curvature comes from their neighbours."
            )
        return lines


@dataclass(frozen=True)
class CleanCurvature:
    """Principal curvatures on the cleaned mesh itself, per unit of that mesh."""

    mesh: CleanMesh
    k1: Points
    """(n,) the larger principal curvature."""
    k2: Points
    """(n,) the smaller principal curvature."""
    good: Mask
    """(n,) False where the value comes from the neighbours."""

    def on_source(self) -> CurvatureField:
        """Carry the curvatures back to the source's vertices and unit."""
        mesh = self.mesh
        return CurvatureField(
            mesh.to_source(self.k1) / mesh.edge,
            mesh.to_source(self.k2) / mesh.edge,
            # Loose vertices are no failure: nothing is rendered there.
            mesh.to_source((~self.good).astype(np.float64)) > 0.0,
            mesh.report,
        )


def principal_curvatures(
    mesh: TriMesh,
    method: str = DEFAULT_METHOD,
    radius: int = DEFAULT_RADIUS,
    crease_angle: float = NO_CREASE,
) -> CurvatureField:
    """Estimate the principal curvatures in one go; see `curvature_steps`.

    Args:
        mesh: Any mesh; unchanged.
        method: Key of METHODS.
        radius: Rings of neighbours in the fit, 2 to 10.
        crease_angle: Do not fit across sharper edges than this, radians.

    Returns:
        The curvatures at the mesh's vertices, per unit of its positions.

    Raises:
        ParameterError: The method is unknown, or the radius outside 2 to 10.
        MeshError: No face of the mesh can be used.
    """
    options = Options(method, radius, crease_angle)
    return run_steps(curvature_steps(mesh, options)).on_source()


def curvature_steps(
    mesh: TriMesh, options: Options = DEFAULT_OPTIONS
) -> Generator[float, None, CleanCurvature]:
    """Estimate the principal curvatures of any mesh, yielding the part done after each step.

    Args:
        mesh: Any mesh; unchanged. Positions in the unit whose inverse the result has.
        options: How to measure.

    Yields:
        Progress from 0 to 1.

    Returns:
        The curvatures on the cleaned mesh, finite everywhere; `on_source` carries them back.

    Raises:
        ParameterError: The method is unknown, or the radius outside 2 to 10.
        MeshError: No face of the mesh can be used.
    """
    method, radius = options.method, options.radius
    if method not in METHODS:
        raise ParameterError(f"There is no method '{method}'; choose from {', '.join(METHODS)}.")
    if not 2 <= radius <= 10:
        raise ParameterError(f"The fit takes 2 to 10 rings of neighbours, not {radius}.")
    yield 0.0
    cleaned = yield from portion(counted(clean_steps(mesh, options.crease_angle), 9), 0.0, 0.25)
    estimate = yield from portion(METHODS[method].steps(cleaned, radius), 0.25, 0.95)
    with np.errstate(invalid="ignore"):
        good = estimate.good & (np.abs(estimate.k1) <= CURVATURE_LIMIT)
        good &= np.abs(estimate.k2) <= CURVATURE_LIMIT
    k1, k2 = np.where(good, estimate.k1, 0.0), np.where(good, estimate.k2, 0.0)
    _fill(cleaned, k1, k2, good)
    yield 1.0
    return CleanCurvature(cleaned, k1, k2, good)


def _fill(cleaned: CleanMesh, k1: Points, k2: Points, good: Mask) -> None:
    """Give vertices without a fit the mean of their neighbours, ring by ring, in place.

    A piece without a single fit (a lone tetrahedron) is too small for a quadric; it gets the turn
    of the normals along its edges.
    """
    if good.all():
        return
    near = adjacency(cleaned.triangles, len(good)).astype(np.float64)
    known = good.copy()
    for _ in range(FILL_ROUNDS):
        neighbours = near @ known.astype(np.float64)
        reached = ~known & (neighbours > 0.0)
        if not reached.any():
            break
        for values in (k1, k2):
            around = near @ np.where(known, values, 0.0)
            values[reached] = around[reached] / neighbours[reached]
        known |= reached
    if not known.all():
        turn = _turn_of_normals(cleaned, near)
        k1[~known] = k2[~known] = turn[~known]


def _turn_of_normals(cleaned: CleanMesh, near: Any) -> Points:
    """Mean of |dN| / |dP| over the edges at each vertex, signed: positive where normals diverge."""
    vertices = cleaned.vertices
    count = len(vertices)
    normals = vertex_normals(cleaned.face_normals, cleaned.triangles, count)
    unit, sound = normals.unit, normals.sound
    start, end = near.nonzero()
    along, turned = vertices[end] - vertices[start], unit[end] - unit[start]
    distance = np.maximum(np.linalg.norm(along, axis=1), np.finfo(np.float64).tiny)
    bend = np.linalg.norm(turned, axis=1) / distance
    bend *= np.where((along * turned).sum(axis=1) < 0.0, -1.0, 1.0)
    bend[~(sound[start] & sound[end])] = 0.0  # the normals of opposite sheets cancel: no turn
    edges = np.bincount(start, minlength=count) - 1  # the diagonal is no edge
    total = np.bincount(start, np.minimum(bend, CURVATURE_LIMIT), minlength=count)
    return np.asarray(total / np.maximum(edges, 1))
