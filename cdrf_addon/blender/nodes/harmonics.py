# SPDX-License-Identifier: GPL-3.0-or-later
"""A world's light as nine harmonics, and what a translucent surface leaves of their bands.

Wiring, with c the coefficients of core/reflectance/environment.py and the normal (x, y, z):

    Variance -> exp(-v), exp(-3 v) or a look-up -> bands B0, B1, B2
    B0 c0 + B1 (cx x + cy y + cz z)
          + B2 (cxy xy + cyz yz + czx zx + c7 (3 zz - 1) + c8 (xx - yy)) -> max(., 0) -> Radiance
"""

from __future__ import annotations

from collections.abc import Mapping

import bpy
import numpy as np

from ... import ids
from ...core.reflectance.environment import BAND_ROWS
from ...core.reflectance.lut import VARIANCE_MAX
from ...core.reflectance.model import SPHERE, name_of
from .reflectance import SEPARATE
from .tables import Table, bands_image
from .tree import Operand, Socket, Sockets, TreeBuilder, declare, ensure_group

VERSION = 1
COLUMNS = 3
"""Columns of a table of band factors: one for each channel."""


def bands_group(channels: str, table: Table) -> bpy.types.ShaderNodeTree:
    """Return the group for what a variance v leaves of bands 0, 1 and 2, per channel.

    The sphere model leaves 1, exp(-v) and exp(-3 v). Other models have a small table beside their
    own, with one look-up for each part of `channels`.

    Args:
        channels: Which channels share a sigma0, such as "R GB".
        table: Of the model.
    """
    # Channels of a table with colour differ at the same variance.
    sets = SEPARATE if table.colour else channels

    def build(b: TreeBuilder) -> None:
        declare(b.tree, ids.VARIANCE, "Vector", tip="Squared blur width of each channel")
        for name in ids.BANDS:
            declare(b.tree, name, "Vector", output=True)
        given, result = b.ends()
        variance = b.separate_channels(given[ids.VARIANCE])
        if table.key == SPHERE:
            _closed_form(b, sets, variance, result)
        else:
            _looked_up(b, sets, variance, result, table)

    name = f"CDRF Bands {name_of(table.key)} {'+'.join(sets.split())}"
    return ensure_group(name, f"{ids.ROLE_BANDS} {sets} {table.key}", VERSION, build)


def _limited(b: TreeBuilder, variance: Operand) -> Socket:
    # MINIMUM(limit, NaN) is the limit: in this order a bad attribute stays finite.
    return b.math("MAXIMUM", 0.0, b.math("MINIMUM", VARIANCE_MAX, variance))


def _closed_form(
    b: TreeBuilder, sets: str, variance: Mapping[str, Socket], result: Sockets
) -> None:
    left: dict[str, Socket] = {}
    for shared in sets.split():
        power = b.math("MULTIPLY", _limited(b, variance[shared[0]]), -1.0)
        left.update(dict.fromkeys(shared, b.math("EXPONENT", power)))
    one = b.combine_channels(left)
    three = b.vector("MULTIPLY", b.vector("MULTIPLY", one, one), one)
    for name, value in zip(ids.BANDS, ((1.0, 1.0, 1.0), one, three), strict=True):
        b.feed(result[name], value)


def _looked_up(
    b: TreeBuilder, sets: str, variance: Mapping[str, Socket], result: Sockets, table: Table
) -> None:
    image = bands_image(table)
    bands: list[dict[str, Socket]] = [{}, {}, {}]
    for shared in sets.split():
        part = b.math("MULTIPLY", _limited(b, variance[shared[0]]), 1.0 / VARIANCE_MAX)
        row = b.math("SQRT", b.math("SQRT", part))
        v = b.math("MULTIPLY_ADD", row, (BAND_ROWS - 1.0) / BAND_ROWS, 0.5 / BAND_ROWS)
        # The tube's angle of a column's centre; tube projection reads no coarser mip levels.
        angle = np.pi * (1.0 - 2.0 * ("RGB".index(shared[0]) + 0.5) / COLUMNS)
        x, y = (float(0.5 + 0.5 * wave) for wave in (np.sin(angle), np.cos(angle)))
        value = b.look_up(image, f"Bands {shared}", x, y, v)
        for factors, output in zip(bands, ("Red", "Green", "Blue"), strict=True):
            factors.update(dict.fromkeys(shared, value[output]))
    for name, factors in zip(ids.BANDS, bands, strict=True):
        b.feed(result[name], b.combine_channels(factors))


def harmonics_group() -> bpy.types.ShaderNodeTree:
    """Return the group for the radiance of a white surface under nine harmonics, per channel."""

    def build(b: TreeBuilder) -> None:
        declare(b.tree, ids.NORMAL, "Vector", hide_value=True, tip="Unit normal, world space")
        for name in ids.BANDS:
            declare(b.tree, name, "Vector", default=(1.0,) * 3, tip="What is left of the band")
        for name in ids.COEFFICIENTS:
            declare(b.tree, name, "Vector", tip="Red, green and blue of this polynomial")
        declare(b.tree, ids.RADIANCE, "Vector", output=True)
        given, result = b.ends()
        x, y, z = b.separate(given[ids.NORMAL])
        squares = b.math("MULTIPLY", x, x), b.math("MULTIPLY", y, y), b.math("MULTIPLY", z, z)
        basis = [
            x,
            y,
            z,
            b.math("MULTIPLY", x, y),
            b.math("MULTIPLY", y, z),
            b.math("MULTIPLY", z, x),
            b.math("MULTIPLY_ADD", squares[2], 3.0, -1.0),
            b.math("SUBTRACT", squares[0], squares[1]),
        ]
        terms = [
            b.vector("SCALE", given[name], scale=part)
            for name, part in zip(ids.COEFFICIENTS[1:], basis, strict=True)
        ]
        total = b.vector("MULTIPLY", given[ids.COEFFICIENTS[0]], given[ids.BANDS[0]])
        for name, band in ((ids.BANDS[1], terms[:3]), (ids.BANDS[2], terms[3:])):
            value = band[0]
            for term in band[1:]:
                value = b.vector("ADD", value, term)
            total = b.vector("MULTIPLY_ADD", value, given[name], total)
        b.feed(result[ids.RADIANCE], b.vector("MAXIMUM", total, (0.0, 0.0, 0.0)))

    return ensure_group("CDRF Harmonics", ids.ROLE_HARMONICS, VERSION, build)
