# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders look-ups over both arguments, a square of pixels each, exact past the half-float film."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray
from rig import Rig

from cdrf_addon.blender.nodes.tree import TreeBuilder
from cdrf_addon.compat import ensure_node_tree
from cdrf_addon.core.reflectance.lut import (
    SIGMA_MAX,
)

from .variants import Values, Variant

Wire = Callable[[TreeBuilder, Any, Any], Any]
PIXELS = 160
"""Side of a square."""
SQUARES = (8, 5)
"""Squares in a picture."""
# The film is half float: a value is written as floor and fraction of SPLIT times itself, exact to
# 2^-11 / SPLIT = 5e-7 of the span that covers a cubic filter's overshoot too.
SPLIT, LOW, SPAN = 1024.0, -1.1, 2.2
ARGUMENT_ERROR = 3e-6


def arguments() -> tuple[Values, Values]:
    """Cosine across and sigma up a square, (PIXELS,) each: what `sweep` makes of pixel centres."""
    centre = (np.arange(PIXELS) + 0.5) / PIXELS
    return np.clip(1.02 * (2.0 * centre - 1.0), -1.0, 1.0) ** 3, SIGMA_MAX * centre**3


def sweep(b: TreeBuilder) -> tuple[Any, Any]:
    """Wire both arguments from the square's texture coordinates; the ends are whole columns."""
    u, v, _ = b.separate(b.node("ShaderNodeTexCoord").outputs["UV"])
    wide = b.math("MULTIPLY_ADD", u, 2.04, -1.02)
    wide = b.math("MAXIMUM", -1.0, b.math("MINIMUM", 1.0, wide))
    cube = b.math("MULTIPLY", b.math("MULTIPLY", wide, wide), wide)
    sigma = b.math("MULTIPLY", b.math("MULTIPLY", v, v), b.math("MULTIPLY", v, SIGMA_MAX))
    return cube, sigma


def material(wire: Wire) -> bpy.types.Material:
    """Make a material that emits floor and fraction of what `wire` makes of the arguments."""
    made = bpy.data.materials.new("Square")
    tree = ensure_node_tree(made)
    tree.nodes.clear()
    b = TreeBuilder(tree)
    scaled = b.math("MULTIPLY_ADD", wire(b, *sweep(b)), SPLIT / SPAN, -LOW * SPLIT / SPAN)
    emission = b.node("ShaderNodeEmission")
    parts = b.combine(b.math("FLOOR", scaled), b.math("FRACT", scaled), 0.0)
    b.feed(emission.inputs["Color"], parts)
    output = b.node("ShaderNodeOutputMaterial")
    tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])
    return made


def image_of(variant: Variant, table: NDArray[np.float32]) -> bpy.types.Image:
    """Hand a table to Blender, as cdrf_addon/blender/nodes/tables.py does."""
    width, height = variant.width, variant.height
    image = bpy.data.images.new("Table", width, height, float_buffer=True, is_data=True)
    image.use_half_precision = variant.storage == "half"
    image.alpha_mode = "CHANNEL_PACKED"
    pixels = np.ones((height, width, 4), dtype=np.float32)
    pixels[..., :3] = table[..., None]
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()
    return image


def render(wires: Sequence[Wire]) -> list[Values]:
    """Render a square for each wiring, one picture for all; the values, (PIXELS, PIXELS) each."""
    across, up = SQUARES
    assert len(wires) <= across * up
    rig = Rig(ortho_scale=float(max(SQUARES)))
    rig.scene.render.resolution_x, rig.scene.render.resolution_y = across * PIXELS, up * PIXELS
    rig.camera.location = (across / 2.0, -10.0, up / 2.0)
    for number, wire in enumerate(wires):
        row, column = divmod(number, across)
        bpy.ops.mesh.primitive_plane_add(
            size=1.0, location=(column + 0.5, 0.0, row + 0.5), rotation=(math.pi / 2.0, 0.0, 0.0)
        )
        bpy.context.object.data.materials.append(material(wire))
    picture = rig.render()
    value = (picture[..., 0] + picture[..., 1]) / SPLIT * SPAN + LOW
    squares = value.reshape(up, PIXELS, across, PIXELS).swapaxes(1, 2)
    return list(squares.reshape(-1, PIXELS, PIXELS)[: len(wires)])


def check_arguments() -> float:
    """Render the arguments themselves; return the largest difference to `arguments`."""
    cosine, sigma = arguments()
    seen = render([lambda _, c, s: c, lambda b, c, s: b.math("MULTIPLY", s, 1.0 / SIGMA_MAX)])
    worst = max(
        float(np.abs(seen[0] - cosine[None, :]).max()),
        float(np.abs(seen[1] - sigma[:, None] / SIGMA_MAX).max()),
    )
    assert worst <= ARGUMENT_ERROR, f"The arguments are {worst:.1e} off."
    return worst


def batches(found: list[Variant]) -> Iterator[list[Variant]]:
    """Split a list into what fits on a picture."""
    count = SQUARES[0] * SQUARES[1]
    for start in range(0, len(found), count):
        yield found[start : start + count]
