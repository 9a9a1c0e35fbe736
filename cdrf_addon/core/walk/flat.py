# SPDX-License-Identifier: GPL-3.0-or-later
"""The flat limit: what a surface shows that is flat at the scale of the mean free path.

Cycles' walk, traced backwards, enters along the refracted view, comes out somewhere near and is lit
there by one white Lambert. On a plane all exits have the plane's normal, so that the radiance is
Lambert's times G(mu) = <1 - sqrt(1 - omega) H(mu_t)> / A, the mean taken over the directions of
entry (core/walk/entry.py), less what a walk of 256 bounces never brings back.

Exact by quadrature here, to 1e-5; `FlatFit` is what a shader evaluates instead.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from ..scattering.node_radius import LEGACY, RANDOM_WALK, SKIN
from .chandrasekhar import chandrasekhar_h, cut_off, escape
from .entry import entry
from .medium import BOUNCES, WalkMedium, medium, van_de_hulst

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

# H is looked up where it is needed at thousands of directions; the nodes are dense at mu = 0, where
# it is steep. Error of the look-up 3e-7.
_TABLE = np.linspace(0.0, 1.0, 1501) ** 2
# Of the cosine law: mean depth, and the nodes of its mean.
COSINE_DEPTH = 2.0 / 3.0
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(32)
_COSINES = ((_NODES + 1.0) / 2.0) ** 2
_COSINE_WEIGHTS = _WEIGHTS * ((_NODES + 1.0) / 2.0) ** 3 * 2.0


def flat_radiance(
    mu: ArrayLike, walk: WalkMedium, bounces: float = BOUNCES
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Radiance of a plane under light of irradiance pi, by view and channel.

    Args:
        mu: Cosines of the views, (v,).
        walk: The medium of c channels, its arrays (c,).
        bounces: Scatterings after which a walk is given up; infinity for a walk without an end.

    Returns:
        What a walk without an end shows, A G (v, c), and what its end takes away (v, c).
    """
    views = np.asarray(mu, dtype=np.float64).ravel()
    albedo = np.atleast_1d(walk.single_scattering)
    if not walk.view_dependent:
        shown = np.broadcast_to(np.atleast_1d(walk.colour), (len(views), len(albedo)))
        return np.array(shown), np.zeros((len(views), len(albedo)))
    shown = np.stack([_mean(views, walk, escape(_TABLE, one)) for one in albedo], axis=1)
    white = _mean(views, walk, chandrasekhar_h(_TABLE, 1.0))
    tail = cut_off(0.0, albedo, bounces)
    return shown * walk.darkening, white[:, None] * tail * walk.darkening


def flat_gain(mu: ArrayLike, walk: WalkMedium, bounces: float = BOUNCES) -> NDArray[np.float64]:
    """G(mu) of a plane, Lambert's radiance being 1, by view and channel (v, c).

    A black channel has the limit of dark ones.
    """
    colour = np.maximum(np.atleast_1d(walk.colour), 1e-4)
    walk = walk if np.all(walk.colour >= 1e-4) else _at(walk, colour)
    shown, lost = flat_radiance(mu, walk, bounces)
    return np.asarray((shown - lost) / colour)


def depths(mu: ArrayLike, walk: WalkMedium) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean direction in which light enters, by view.

    Returns:
        Its component along the inward normal, and that along the surface, both (v,).
    """
    views = np.asarray(mu, dtype=np.float64).ravel()
    ways = entry(views, walk.alpha, walk.ior)
    part = 1.0 - walk.diffuse
    into = part * ways.mean(ways.depth) + walk.diffuse * COSINE_DEPTH
    return into, part * ways.mean(ways.along)


@dataclass(frozen=True)
class FlatFit:
    """The flat limit as a shader has it; what depends on the view alone is a polynomial in mu.

    A G = A (1 + (1 - A) (base(mu) + A slope(mu))) - lost(mu) (t0 A^8 + t1 A^16 + t2 A^32)
    """

    base: tuple[float, ...]
    """Four coefficients, constant first."""
    slope: tuple[float, ...]
    """Four."""
    lost: tuple[float, ...]
    """Two."""
    tail: tuple[float, ...]
    """t0, t1, t2: 0 where walks have no end."""
    depth: tuple[float, ...]
    """Three: mean cosine of the entry to the inward normal."""
    along: tuple[float, ...]
    """Three: mean component along the surface over the sine of the view."""


# Views and colours at which the fit is made: mu from just above the horizon, dense in the colours
# where the tail is.
_FIT_MU = (np.arange(40) + 0.5) / 40.0
_FIT_COLOUR = np.array(
    [0.03, 0.06, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.94, 0.97, 0.985, 1.0]
)
TAIL_POWERS = (8, 16, 32)


@lru_cache(maxsize=64)
def flat_fit(
    method: str = RANDOM_WALK,
    alpha: float = 1.0,
    ior: float = 1.4,
    anisotropy: float = 0.0,
    bounces: float = BOUNCES,
) -> FlatFit:
    """Fit the flat limit of a method, in float64, by least squares; half a second, once.

    The bound: over mu in [0.02, 1] and every colour, roughness and index, A G differs from the
    exact by less than 0.011, root mean square below 0.0026 (tests/core/test_walk_flat.py; 0.005 and
    0.0011 for RANDOM_WALK at roughness 1 and index 1.4).
    """
    walk = medium(method, _FIT_COLOUR, 1.0, anisotropy, alpha, ior)
    if not walk.view_dependent:
        return FlatFit((0.0,) * 4, (0.0,) * 4, (0.0,) * 2, (0.0,) * 3, (1.0, 0.0, 0.0), (0.0,) * 3)
    shown, lost = flat_radiance(_FIT_MU, walk, bounces)
    into, along = depths(_FIT_MU, walk)
    powers = _FIT_MU[:, None] ** np.arange(4)
    white = lost[:, -1] / max(float(lost[:, -1].max()), 1e-300)
    views = np.linalg.lstsq(powers[:, :2], white, rcond=None)[0]
    tail_basis = np.stack([_FIT_COLOUR**power for power in TAIL_POWERS], axis=1)
    mu, colour = (grid.ravel() for grid in np.meshgrid(_FIT_MU, _FIT_COLOUR, indexing="ij"))
    own = (colour * (1.0 - colour))[:, None] * np.repeat(powers, len(_FIT_COLOUR), axis=0)
    basis = np.concatenate((own, own * colour[:, None]), axis=1)
    weight = 1.0 / np.sqrt(colour)  # between A G, what is seen, and G
    if method in {LEGACY, SKIN}:
        # Chiang's albedo makes up for the tail, so neither is small or smooth alone.
        loss = (powers[:, :2] @ views)[:, None, None] * tail_basis
        basis = np.concatenate((basis, -loss.reshape(len(mu), -1)), axis=1)
        target = (shown - lost - _FIT_COLOUR).ravel()
        found = np.linalg.lstsq(basis * weight[:, None], target * weight, rcond=None)[0]
        tail = found[8:]
    else:
        target = (shown - _FIT_COLOUR).ravel()
        found = np.linalg.lstsq(basis * weight[:, None], target * weight, rcond=None)[0]
        tail = np.linalg.lstsq(tail_basis, lost.max(axis=0), rcond=None)[0]
    sine = np.sqrt(1.0 - _FIT_MU**2)
    return FlatFit(
        _floats(found[:4]),
        _floats(found[4:8]),
        _floats(views),
        _floats(tail),
        _floats(np.linalg.lstsq(powers[:, :3], into, rcond=None)[0]),
        _floats(np.linalg.lstsq(powers[:, :3] * sine[:, None], along, rcond=None)[0]),
    )


def _mean(
    views: NDArray[np.float64], walk: WalkMedium, table: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Mean over the directions of entry of what `table` has at their cosines, (v,)."""
    ways = entry(views, walk.alpha, walk.ior)
    refracted = ways.mean(np.interp(ways.depth, _TABLE, table))
    diffuse = float(_COSINE_WEIGHTS @ np.interp(_COSINES, _TABLE, table))
    return (1.0 - walk.diffuse) * refracted + walk.diffuse * diffuse


def _at(walk: WalkMedium, colour: NDArray[np.float64]) -> WalkMedium:
    """Same medium, its dark channels those of `colour`, and never raised or darkened."""
    albedo = np.maximum(walk.single_scattering * walk.darkening, 1.0 - van_de_hulst(colour) ** 2)
    return replace(walk, colour=colour, single_scattering=albedo, darkening=np.ones_like(albedo))


def _floats(values: NDArray[np.float64]) -> tuple[float, ...]:
    return tuple(float(value) for value in values)
