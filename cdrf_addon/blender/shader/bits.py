# SPDX-License-Identifier: GPL-3.0-or-later
"""The bits by which objects switch off lights that they do not receive (light linking).

An object stores a sum of powers of two, one for each light that it does not receive. All shader
groups read the same property, so a light has the same bit in all of them:

    object's property -> x 2^-bit -> floor -> modulo 2 = 1 where the light is not received
"""

from __future__ import annotations

import bpy

from ... import ids
from ..lights.scene_lights import SceneLight
from .variant import is_shader_group
from .wired import Source, light_sources

MOST_SELECTIVE = 24
"""Bits there are: whole numbers up to 2^24 are exact in the shader's 32-bit float."""


def light_bits(group: bpy.types.ShaderNodeTree) -> dict[Source, int]:
    """Map a group's lights that some objects do not receive to their bits; -1 for none left."""
    bits = {node.name: node[ids.BIT_KEY] for node in group.nodes if ids.BIT_KEY in node}
    sources = light_sources(group) if bits else {}
    return {sources.get(name, (None, None)): bit for name, bit in bits.items()}


def bit_of(light: SceneLight) -> int:
    """Return the bit that a light has in another group, else a free one; -1 if none is left."""
    known = -1
    others = set()
    for source, bit in _all_bits():
        if source == light.source:
            known = max(known, bit)
        else:
            others.add(bit)
    free = set(range(MOST_SELECTIVE)) - others
    return known if known in free else min(free, default=-1)


def bits_due(group: bpy.types.ShaderNodeTree) -> str:
    """Return which light shares its bit with another, or has none though one is free; else ""."""
    own = light_bits(group)
    if not own:
        return ""
    everywhere = _all_bits()
    full = len({bit for _, bit in everywhere if bit >= 0}) >= MOST_SELECTIVE
    for source, bit in own.items():
        shared = any(other != source and bit == its for other, its in everywhere)
        if source[0] is not None and (not full if bit < 0 else shared):
            return f"light '{source[0].name}' needs another place in the objects' light property"
    return ""


def _all_bits() -> list[tuple[Source, int]]:
    """List the lights with a bit in any shader group, and their bits."""
    return [
        pair
        for group in bpy.data.node_groups
        if is_shader_group(group)
        for pair in light_bits(group).items()
    ]
