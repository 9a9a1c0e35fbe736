# SPDX-License-Identifier: GPL-3.0-or-later
"""What a light's look-up needs of the surface: normals, cosines and variance per channel.

Wiring:

    geometry's normal ---------------------------------------------------+
    map - geometry's normal -> x weight that detail keeps at its sigma0 --+-> + -> normal
    normal . light's Direction -> Cosine ------------------+
    sigma^2 + light's Variance / moment of the channel ----+-> Reflectance
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TypeAlias

import bpy

from ... import ids
from ..nodes.detail import detail_group
from ..nodes.reflectance import SEPARATE, reflectance_group
from ..nodes.tables import Table
from ..nodes.tree import Operand, Socket, Sockets, TreeBuilder
from ..nodes.walk import haze_group
from .variant import Variant

# A channel narrower than a hundredth of the widest is Lambert in every row of the table.
LEAST_MOMENT = 1e-4

Normals: TypeAlias = dict[str, Socket]
"""Sets of channels that share a normal, each with its normal."""


@dataclass(frozen=True)
class Surface:
    """What the look-ups of all lights share."""

    table: Table
    """Of the reflectance model."""
    normals: Normals
    """Empty where no light depends on the normal."""
    variance: Operand
    """Square of sigma per channel; zero where the surface changes no light."""
    haze: Operand | None = None
    """What a random walk takes off the blur (nodes/walk.py), per channel; None for nothing."""


def shading_normal(b: TreeBuilder, variant: Variant, given: Sockets) -> Socket:
    """Return the geometry's normal, or the map's where one is connected."""
    own = b.node("ShaderNodeNewGeometry").outputs["Normal"]
    if not variant.mapped:
        return own
    mapped = given[ids.NORMAL]
    # An unconnected input is a zero vector.
    unset = b.math("LESS_THAN", b.vector("DOT_PRODUCT", mapped, mapped), 1e-12)
    return b.vector("ADD", mapped, b.vector("SCALE", own, scale=unset))


def surface_normals(b: TreeBuilder, variant: Variant, table: Table, given: Sockets) -> Normals:
    """Return the geometry's normal; under a map, blended with it as each channel keeps detail."""
    mapped = shading_normal(b, variant, given)
    if not variant.mapped:
        return {"RGB": mapped}
    own = b.node("ShaderNodeNewGeometry").outputs["Normal"]
    change = b.vector("SUBTRACT", mapped, own)
    ratio = b.separate_channels(given[ids.SIGMA0_RATIO])
    moments = dict(zip("RGB", table.moments, strict=True))
    normals = {}
    for shared in (SEPARATE if table.colour else variant.channels).split():
        factor = b.math("MULTIPLY", ratio[shared[0]], math.sqrt(moments[shared[0]]))
        weight = b.group(
            detail_group(),
            f"Detail {shared}",
            Sigma0=b.math("MULTIPLY", given[ids.SIGMA0], factor),
            Detail_Size=given[ids.DETAIL_SIZE],
        ).outputs[ids.WEIGHT]
        blend = b.vector("ADD", own, b.vector("SCALE", change, scale=weight))
        normals[shared] = b.vector("NORMALIZE", blend)
    return normals


def reflectance_node(
    b: TreeBuilder, surface: Surface, light: bpy.types.ShaderNode, lookups: str, name: str
) -> Socket:
    """Look up the reflectance of a surface under one light.

    Args:
        b: Builder of the shader group.
        surface: What is lit.
        light: An instance of a light's group.
        lookups: Which channels share a look-up.
        name: Of the light.

    Returns:
        f per channel.
    """
    direction, variance = light.outputs[ids.DIRECTION], light.outputs[ids.VARIANCE]
    cosine = _cosine(b, surface.normals, direction)
    reflectance = b.group(
        reflectance_group(lookups, surface.table, own_cosines=len(surface.normals) > 1),
        f"Reflectance {name}",
        Cosine=cosine,
        Variance=_total_variance(b, surface, variance, lookups),
    ).outputs[ids.REFLECTANCE]
    if surface.haze is None:
        return reflectance
    node = b.group(
        haze_group(), f"Haze {name}", Reflectance=reflectance, Haze=surface.haze, Cosine=cosine
    )
    return node.outputs[ids.LEFT]


def per_channel(
    b: TreeBuilder, normals: Normals, value: Callable[[Socket | None], Operand]
) -> Operand:
    """Return a colour that depends on the normal, each channel taken at its own normal.

    Args:
        b: Builder of the shader group.
        normals: May be empty, where `value` gets None.
        value: Makes the colour from a normal.
    """
    if len(normals) <= 1:
        return value(next(iter(normals.values()), None))
    parts = {shared: b.separate_channels(value(normal)) for shared, normal in normals.items()}
    return b.combine_channels(
        {channel: parts[_set_of(channel, parts)][channel] for channel in "RGB"}
    )


def _cosine(b: TreeBuilder, normals: Normals, direction: Socket) -> Socket:
    """Return the cosine between light and normal, or a vector with one for each channel."""
    each = {
        shared: b.vector("DOT_PRODUCT", normal, direction) for shared, normal in normals.items()
    }
    if len(each) == 1:
        return next(iter(each.values()))
    return b.combine_channels({channel: each[_set_of(channel, each)] for channel in "RGB"})


def _set_of(channel: str, sets: Iterable[str]) -> str:
    return next(shared for shared in sets if channel in shared)


def _total_variance(b: TreeBuilder, surface: Surface, light: Socket, lookups: str) -> Socket:
    """Add a light's variance to the surface's, in the units of the table's rows.

    A channel whose blur is sqrt(m) sigma wide needs 1 / m of the light's variance on top of
    sigma^2; channels that share a look-up take that of the widest.
    """
    if not surface.table.colour:
        return b.vector("ADD", surface.variance, light)
    moments = dict(zip("RGB", surface.table.moments, strict=True))
    share = {}
    for shared in lookups.split():
        widest = max(moments[channel] for channel in shared)
        share.update(dict.fromkeys(shared, 1.0 / max(widest, LEAST_MOMENT)))
    factors = (share["R"], share["G"], share["B"])
    return b.vector("MULTIPLY_ADD", light, factors, surface.variance)
