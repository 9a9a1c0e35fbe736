# SPDX-License-Identifier: GPL-3.0-or-later
"""Curvature from what a mesh stores: at a diffusion length, and as colours."""

from __future__ import annotations

import bpy

from ... import ids
from ...core.colour_scale import HOT, MARK_COLOUR, SIGNED
from ...core.curvature.scale_space import LENGTH_PER_SIGMA0, LEVEL_RATIO, LEVELS
from .tree import TreeBuilder, declare, ensure_group

VERSION = 9


def diffused_group() -> bpy.types.ShaderNodeTree:
    """Return the group for kappa at a sigma0's diffusion length (core/curvature/scale_space.py).

    Wiring, with c = LENGTH_PER_SIGMA0, q = LEVEL_RATIO and levels K0 to K3:

        Sigma0 x c / Length -> max(., 1) -> log_q = t
        K0 + clamp(t) (K1 - K0) + clamp(t - 1) (K2 - K1) + clamp(t - 2) (K3 - K2) -> Curvature
    """

    def build(b: TreeBuilder) -> None:
        declare(b.tree, ids.LEVELS, "Color", tip="Curvature at the first three lengths")
        declare(b.tree, ids.LEVELS_ALPHA, tip="Curvature at the longest length")
        declare(b.tree, ids.LENGTH, default=1.0, tip="The shortest length")
        declare(b.tree, ids.SIGMA0, default=0.0, tip="Scatter distance of the channel")
        declare(b.tree, ids.CURVATURE, output=True)
        given, result = b.ends()
        length = b.math("MULTIPLY", given[ids.SIGMA0], LENGTH_PER_SIGMA0)
        ratio = b.math("MAXIMUM", b.math("DIVIDE", length, given[ids.LENGTH]), 1.0)
        place = b.math("LOGARITHM", ratio, LEVEL_RATIO)
        parts = b.node("ShaderNodeSeparateColor")
        b.feed(parts.inputs["Color"], given[ids.LEVELS])
        levels = [parts.outputs[name] for name in ("Red", "Green", "Blue")]
        levels.append(given[ids.LEVELS_ALPHA])
        kappa = levels[0]
        for step in range(LEVELS - 1):
            rise = b.math("SUBTRACT", levels[step + 1], levels[step])
            part = b.math("SUBTRACT", place, float(step), clamp=True)
            kappa = b.math("MULTIPLY_ADD", part, rise, kappa)
        b.feed(result[ids.CURVATURE], kappa)

    return ensure_group("CDRF Diffused Curvature", ids.ROLE_DIFFUSED, VERSION, build)


def display_group(*, signed: bool) -> bpy.types.ShaderNodeTree:
    """Return the group that shows curvature in colours (paper, Fig. 3a); green where Mark is 1.

    Wiring:

        Curvature -> Minimum..Maximum to 0..1 -> colour ramp --+
        Mark -> > 1/2 -----------------------------------------+-> ramp or green -> Emission
    """
    scale = SIGNED if signed else HOT

    def build(b: TreeBuilder) -> None:
        declare(b.tree, ids.CURVATURE, default=0.0, tip="Curvature, signed or not")
        declare(b.tree, ids.MINIMUM, default=0.0, tip="Shown in the first colour")
        declare(b.tree, ids.MAXIMUM, default=1.0, tip="Shown in the last colour")
        declare(b.tree, ids.MARK, default=0.0, tip="1 where the curvature was filled in")
        declare(b.tree, ids.SHADER, "Shader", output=True)
        given, result = b.ends()
        part = b.node("ShaderNodeMapRange", clamp=True)
        b.feed(part.inputs["Value"], given[ids.CURVATURE])
        b.feed(part.inputs["From Min"], given[ids.MINIMUM])
        b.feed(part.inputs["From Max"], given[ids.MAXIMUM])
        ramp = b.node("ShaderNodeValToRGB")
        stops = ramp.color_ramp.elements
        for _ in range(len(scale) - 2):
            stops.new(0.5)
        for stop, (position, colour) in zip(stops, scale, strict=True):
            stop.position, stop.color = position, (*colour, 1.0)
        b.feed(ramp.inputs["Fac"], part.outputs["Result"])
        marked = b.math("GREATER_THAN", given[ids.MARK], 0.5)
        kept = b.vector("SCALE", ramp.outputs["Color"], scale=b.math("SUBTRACT", 1.0, marked))
        green = b.vector("SCALE", MARK_COLOUR, scale=marked)
        emission = b.node("ShaderNodeEmission")
        b.feed(emission.inputs["Color"], b.vector("ADD", kept, green))
        b.feed(result[ids.SHADER], emission.outputs["Emission"])

    name = "CDRF Signed Curvature Display" if signed else "CDRF Curvature Display"
    role = f"{ids.ROLE_DISPLAY} signed" if signed else ids.ROLE_DISPLAY
    return ensure_group(name, role, VERSION, build)
