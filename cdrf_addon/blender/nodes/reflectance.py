# SPDX-License-Identifier: GPL-3.0-or-later
"""The look-up of a reflectance model: f(theta, sigma) per channel from its table.

Wiring, once for each set of channels that share a sigma0, with K, offset and scale of
core/reflectance/lut.py:

    Cosine -> q = sign(c) sqrt|c| -> p = pi K q -> (sin p, cos p) --+
    Variance -> min(., max) -> ^1/4 -> v = offset + scale w --------+-> tube look-up -> Reflectance
"""

from __future__ import annotations

import math

import bpy

from ... import ids
from ...core.reflectance.lut import DEFAULT_LAYOUT, VARIANCE_MAX
from ...core.reflectance.model import name_of
from .tables import Table
from .tree import Operand, Socket, TreeBuilder, declare, ensure_group

VERSION = 9

CHANNEL_SETS = ("RGB", "R GB", "RG B", "RB G", "R G B")
"""Which channels share a sigma0, and so a look-up."""
SEPARATE = CHANNEL_SETS[-1]
"""A look-up for each channel."""
PARTS = {"R": "Red", "G": "Green", "B": "Blue"}
"""Output of a look-up that holds the channel."""


def reflectance_group(
    channels: str, table: Table, *, own_cosines: bool = False
) -> bpy.types.ShaderNodeTree:
    """Return the group that looks up f(theta, sigma) per channel.

    Args:
        channels: One of CHANNEL_SETS; each of its parts takes one look-up ("RG B": two).
        table: Of the model. In a table with colour each channel reads a column of its own.
        own_cosines: Whether each channel has a normal, and so a cosine, of its own.
    """

    def build(b: TreeBuilder) -> None:
        kind = "Vector" if own_cosines else "Float"
        declare(
            b.tree,
            ids.COSINE,
            kind,
            default=(1.0,) * 3 if own_cosines else 1.0,
            tip="Cosine between normal and light",
        )
        declare(b.tree, ids.VARIANCE, "Vector", tip="Squared blur width of each channel")
        declare(b.tree, ids.REFLECTANCE, "Vector", output=True)
        given, result = b.ends()
        layout = DEFAULT_LAYOUT
        if own_cosines:
            cosines = b.separate_channels(given[ids.COSINE])
        else:
            place = _on_tube(b, given[ids.COSINE])
        variance = b.separate_channels(given[ids.VARIANCE])
        f = {}
        for shared in channels.split():
            across, along = _on_tube(b, cosines[shared[0]]) if own_cosines else place
            # MINIMUM(limit, NaN) is the limit: in this order a bad attribute stays finite.
            w = b.math("MINIMUM", VARIANCE_MAX, variance[shared[0]])
            w = b.math("SQRT", b.math("SQRT", b.math("MAXIMUM", 0.0, w)))
            v = b.math("MULTIPLY_ADD", w, layout.row_scale / VARIANCE_MAX**0.25, layout.row_offset)
            value = b.look_up(table.image, f"Look-up {shared}", across, along, v)
            for channel in shared:
                f[channel] = value[PARTS[channel] if table.colour else "Red"]
        b.feed(result[ids.REFLECTANCE], b.combine_channels(f))

    name = f"CDRF Reflectance {name_of(table.key)} {'+'.join(channels.split())}"
    role = f"{ids.ROLE_REFLECTANCE} {channels} {table.key}"
    if own_cosines:
        name, role = f"{name} mapped", f"{role} mapped"
    return ensure_group(name, role, VERSION, build)


def _on_tube(b: TreeBuilder, cosine: Operand) -> tuple[Socket, Socket]:
    """Return the texture coordinates x and y of a cosine's column on the tube."""
    root = b.math("SQRT", b.math("ABSOLUTE", cosine))
    q = b.math("MULTIPLY", root, b.math("SIGN", cosine))
    p = b.math("MULTIPLY", q, math.pi * DEFAULT_LAYOUT.seam_factor)
    # Blender itself maps the tube's cube from 0..1 to -1..1.
    across = b.math("MULTIPLY_ADD", b.math("SINE", p), 0.5, 0.5)
    along = b.math("MULTIPLY_ADD", b.math("COSINE", p), 0.5, 0.5)
    return across, along
