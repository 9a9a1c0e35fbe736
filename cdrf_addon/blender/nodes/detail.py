# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of a normal map's detail scattering leaves (core/reflectance/detail.py).

Wiring, with c = PHASE:

    r = Sigma0 / Detail Size -> 1/4 (1 + c^2 r^2)^-1/2 + 3/4 (1 + 9 c^2 r^2)^-1/2 -> Weight
"""

from __future__ import annotations

import bpy

from ... import ids
from ...core.reflectance.detail import PHASE
from .tree import TreeBuilder, declare, ensure_group

VERSION = 9


def detail_group() -> bpy.types.ShaderNodeTree:
    """Return the group for the part of a normal map's detail that a sigma0 leaves."""

    def build(b: TreeBuilder) -> None:
        declare(b.tree, ids.SIGMA0, default=0.0, tip="Scatter distance of the channel")
        declare(b.tree, ids.DETAIL_SIZE, default=0.0, tip="Wavelength of the map's detail")
        declare(b.tree, ids.WEIGHT, output=True)
        given, result = b.ends()
        # Division by zero is zero in Blender: all detail stays.
        ratio = b.math("DIVIDE", given[ids.SIGMA0], given[ids.DETAIL_SIZE])
        square = b.math("MULTIPLY", b.math("MULTIPLY", ratio, ratio), PHASE**2)
        near = b.math("INVERSE_SQRT", b.math("ADD", square, 1.0))
        far = b.math("INVERSE_SQRT", b.math("MULTIPLY_ADD", square, 9.0, 1.0))
        far = b.math("MULTIPLY", far, 0.75)
        b.feed(result[ids.WEIGHT], b.math("MULTIPLY_ADD", near, 0.25, far))

    return ensure_group("CDRF Detail", ids.ROLE_DETAIL, VERSION, build)
