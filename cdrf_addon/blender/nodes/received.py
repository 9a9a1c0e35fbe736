# SPDX-License-Identifier: GPL-3.0-or-later
"""What a white BSDF receives in EEVEE, shadows included, as one number; 1 is a radiance of 1.

Wiring:

    Normal -> Diffuse or Translucent BSDF -> Shader to RGB -> sum of channels -> Lit
"""

from __future__ import annotations

import bpy

from ... import ids
from .tree import Operand, Socket, TreeBuilder, declare, ensure_group

VERSION = 1


def lit_group(*, translucent: bool) -> bpy.types.ShaderNodeTree:
    """Return the group for what a white BSDF with a normal of its own receives."""
    kind = "Translucent" if translucent else "Diffuse"

    def build(b: TreeBuilder) -> None:
        declare(b.tree, ids.NORMAL, "Vector", tip="Direction from which light is received")
        declare(b.tree, ids.LIT, output=True)
        given, result = b.ends()
        bsdf = b.node(f"ShaderNodeBsdf{kind}")
        b.feed(bsdf.inputs["Color"], (1.0, 1.0, 1.0, 1.0))
        b.feed(bsdf.inputs["Normal"], given[ids.NORMAL])
        seen = b.node("ShaderNodeShaderToRGB")
        b.feed(seen.inputs["Shader"], bsdf.outputs["BSDF"])
        b.feed(result[ids.LIT], total(b, seen.outputs["Color"]))

    return ensure_group(f"CDRF Lit {kind}", f"{ids.ROLE_LIT} {kind}", VERSION, build)


def total(b: TreeBuilder, colour: Operand) -> Socket:
    """Return the sum of a colour's channels."""
    return b.vector("DOT_PRODUCT", colour, (1.0, 1.0, 1.0))
