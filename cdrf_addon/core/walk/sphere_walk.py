# SPDX-License-Identifier: GPL-3.0-or-later
"""Walks in the plainest bodies, as Cycles does them: where every fit of core/walk comes from.

A ball, a cylinder (seen across or along its axis), a half-space, and the medium around a ball: a
hollow, whose wall is the surface. Lengths are mean free paths, so that a body is its curvature
x = l / R alone. Light is traced backwards: it enters along the refracted view at a point whose
normal is +z, the view in the plane of x and z, and each walk keeps how often it scattered and the
normal where it got out. An isotropic walk knows no albedo, so one set of walks is the reference of
every colour: omega^n is its weight.

Seeded, and NumPy alone: a million flights take about a third of a second.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .medium import BOUNCES, SIMILAR_FROM

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Vectors = NDArray[np.float64]

BALL, HOLLOW, PLANE = "BALL", "HOLLOW", "PLANE"
ACROSS, ALONG = "ACROSS", "ALONG"
"""A cylinder seen across its axis, and along it."""
BODIES = (BALL, HOLLOW, PLANE, ACROSS, ALONG)
# A flight into the void ends nowhere.
_FAR = 1e30


@dataclass(frozen=True)
class Exits:
    """The walks that began with one view."""

    started: int
    """How many walks there were: those that never got out count too."""
    scattered: NDArray[np.int64]
    """How often each scattered that got out, (n,)."""
    normal: Vectors
    """Of the surface where it got out, (n, 3)."""

    def weights(self, omega: float, first: float | None = None) -> NDArray[np.float64]:
        """What is left of each, (n,); `first` is the albedo of the anisotropic flights."""
        if first is None:
            return np.asarray(omega ** self.scattered.astype(np.float64))
        early = np.minimum(self.scattered, SIMILAR_FROM)
        return np.asarray(first**early * omega ** (self.scattered - early).astype(np.float64))

    def reflected(self, weights: NDArray[np.float64]) -> float:
        """Radiance under light of radiance 1 from everywhere."""
        return float(weights.sum() / self.started)

    def radiance(self, weights: NDArray[np.float64], lights: ArrayLike) -> NDArray[np.float64]:
        """Radiance under each of the distant lights (k, 3), irradiance pi: a Lambert shows N.L."""
        directions = np.asarray(lights, dtype=np.float64)
        shown = np.zeros(len(directions))
        for start in range(0, len(weights), 1 << 14):  # in parts, so that no table is large
            part = slice(start, start + (1 << 14))
            shown += weights[part] @ np.maximum(self.normal[part] @ directions.T, 0.0)
        return shown / self.started


def views(mu: float, count: int, alpha: float, ior: float, random: np.random.Generator) -> Vectors:
    """Sample directions of entry for a view in the plane of x and z, (count, 3).

    The visible normals as in core/walk/entry.py, drawn instead of integrated.
    """
    sine = np.sqrt(max(1.0 - mu * mu, 0.0))
    stretched = np.array([alpha * sine, 0.0, max(mu, 1e-9)])
    stretched /= np.linalg.norm(stretched)
    height = (1.0 - random.random(count)) * (1.0 + stretched[2]) - stretched[2]
    around, angle = np.sqrt(1.0 - height**2), 2.0 * np.pi * random.random(count)
    normal = np.stack(
        (
            alpha * (around * np.cos(angle) + stretched[0]),
            alpha * around * np.sin(angle),
            height + stretched[2],
        ),
        axis=1,
    )
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    toward = np.array([sine, 0.0, mu])
    cosine = normal @ toward
    bend = cosine / ior - np.sqrt(1.0 - (1.0 - cosine**2) / ior**2)
    return np.asarray(bend[:, None] * normal - toward / ior)


def diffuse_views(count: int, random: np.random.Generator) -> Vectors:
    """Sample directions of entry by the cosine law, (count, 3)."""
    square, angle = random.random(count), 2.0 * np.pi * random.random(count)
    radius = np.sqrt(square)
    return np.stack(
        (radius * np.cos(angle), radius * np.sin(angle), -np.sqrt(1.0 - square)), axis=1
    )


def walk(
    body: str,
    curvature: float,
    entered: Vectors,
    random: np.random.Generator,
    bounces: int = BOUNCES,
    anisotropy: float = 0.0,
    first_free_path: float = 1.0,
) -> Exits:
    """Walk from the point with the normal +z.

    Args:
        body: One of BODIES.
        curvature: Mean free path (of the reduced medium) over the body's radius, above 0.
        entered: Directions in which the walks begin, (n, 3); those that point out are lost.
        random: Its seed makes the walks.
        bounces: Flights after which a walk is given up.
        anisotropy: Mean cosine of the first ten scatterings (Henyey-Greenstein).
        first_free_path: Mean length of those flights, of the reduced one's.

    Returns:
        What got out.
    """
    radius = 1.0 / curvature
    direction = entered[entered[:, 2] < 0.0]
    position = np.zeros_like(direction)
    position[:, 2] = -radius if body == HOLLOW else radius
    counts, normals = [], []
    for flight in range(bounces):
        if not len(direction):
            break
        early = anisotropy != 0.0 and flight < SIMILAR_FROM
        length = random.exponential(first_free_path if early else 1.0, len(direction))
        reach = _reach(body, radius, position, direction, flight == 0)
        out = length >= reach
        position = position + direction * np.where(out, reach, length)[:, None]
        if out.any():
            counts.append(np.full(int(out.sum()), flight))
            normals.append(_normal(body, radius, position[out]))
        position, direction = position[~out], direction[~out]
        # The direction of flight n + 1 is drawn with that flight's anisotropy, as Cycles does it.
        turning = anisotropy if flight + 1 < SIMILAR_FROM else 0.0
        direction = _scatter(direction, turning, random)
    if not counts:
        return Exits(len(entered), np.zeros(0, dtype=np.int64), np.zeros((0, 3)))
    return Exits(len(entered), np.concatenate(counts), np.concatenate(normals))


def _reach(body: str, radius: float, position: Vectors, direction: Vectors, first: bool) -> Vectors:
    """Distance to the surface along each direction."""
    if body == PLANE:
        up = direction[:, 2]
        height = np.maximum(radius - position[:, 2], 0.0)
        return np.where(up > 0.0, height / np.maximum(up, 1e-300), _FAR)
    across = {ACROSS: [0, 2], ALONG: [1, 2]}.get(body, [0, 1, 2])
    p, d = position[:, across], direction[:, across]
    square = np.einsum("ij,ij->i", d, d)
    b, c = np.einsum("ij,ij->i", p, d), np.einsum("ij,ij->i", p, p) - radius**2
    below = b * b - square * c
    if body != HOLLOW:
        return (np.sqrt(np.maximum(below, 0.0)) - b) / np.maximum(square, 1e-300)
    if first:  # it begins on the wall and leads away from it
        return np.full(len(position), _FAR)
    return np.where((below > 0.0) & (b < 0.0), -b - np.sqrt(np.maximum(below, 0.0)), _FAR)


def _normal(body: str, radius: float, position: Vectors) -> Vectors:
    if body == PLANE:
        return np.tile([0.0, 0.0, 1.0], (len(position), 1))
    normal = position / (-radius if body == HOLLOW else radius)
    if body in {ACROSS, ALONG}:
        normal[:, 1 if body == ACROSS else 0] = 0.0
    return normal


def _scatter(direction: Vectors, g: float, random: np.random.Generator) -> Vectors:
    count = len(direction)
    share, angle = random.random(count), 2.0 * np.pi * random.random(count)
    if g == 0.0:
        z = 2.0 * share - 1.0
    else:
        part = (1.0 - g * g) / (1.0 - g + 2.0 * g * share)
        z = np.clip((1.0 + g * g - part**2) / (2.0 * g), -1.0, 1.0)
    s = np.sqrt(1.0 - z * z)
    x, y = s * np.cos(angle), s * np.sin(angle)
    if g == 0.0:
        return np.stack((x, y, z), axis=1)
    # A frame without a branch (Duff et al. 2017).
    sign = np.copysign(1.0, direction[:, 2])
    a = -1.0 / (sign + direction[:, 2])
    b = direction[:, 0] * direction[:, 1] * a
    first = np.stack((1.0 + sign * direction[:, 0] ** 2 * a, sign * b, -sign * direction[:, 0]), 1)
    second = np.stack((b, sign + direction[:, 1] ** 2 * a, -direction[:, 1]), 1)
    return first * x[:, None] + second * y[:, None] + direction * z[:, None]
