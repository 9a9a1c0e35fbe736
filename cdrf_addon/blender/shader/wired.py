# SPDX-License-Identifier: GPL-3.0-or-later
"""Which lights a shader group has, read back from its nodes and drivers.

    light's node: kind, look-ups, flags (custom properties) --+
    targets of its drivers: the lamp, the empty --------------+-> WiredLight

The targets identify a light, not its name: they survive renaming.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import bpy

from ... import ids
from ..lights.scene_lights import SceneLight
from ..nodes.reflectance import SEPARATE
from ..nodes.tables import Table
from .variant import Variant

Source: TypeAlias = tuple[bpy.types.Object | None, bpy.types.Object | None]
"""A lamp and the empty that instances it; None if deleted, or if there is no empty."""


@dataclass(frozen=True)
class WiredLight:
    """A light of a shader group, as it was wired."""

    object: bpy.types.Object | None
    """The lamp; None if it, or the empty that instances it, was deleted."""
    instance: bpy.types.Object | None
    """The empty that instances it."""
    kind: str
    """See `SceneLight.kind`."""
    selective: bool
    """Whether each object stores which of these lights it does not receive."""
    lookups: str
    """Which channels share a look-up."""

    @property
    def source(self) -> Source:
        """What identifies it; see `SceneLight.source`."""
        return self.object, self.instance


def lookups_of(table: Table, variant: Variant, light: SceneLight) -> str:
    """Choose which channels share a look-up for a light.

    A table with colour serves all channels with one look-up, unless the light has a size: its blur
    adds to a wide channel's and to a narrow one's in different proportions. Nor does it under a
    normal map, of which each channel keeps another part.
    """
    return SEPARATE if table.colour and (light.soft or variant.mapped) else variant.channels


def wanted_light(table: Table, variant: Variant, light: SceneLight) -> WiredLight:
    """Return what a light would be if it were wired now."""
    lookups = lookups_of(table, variant, light)
    return WiredLight(light.object, light.instance, light.kind, light.selective, lookups)


def wired_lights(group: bpy.types.ShaderNodeTree) -> list[WiredLight]:
    """List the lights of a shader group."""
    sources = light_sources(group)
    return [
        WiredLight(
            *sources.get(node.name, (None, None)),
            node[ids.LIGHT_KEY],
            ids.BIT_KEY in node,
            node.get(ids.LOOKUPS_KEY, ""),
        )
        for node in group.nodes
        if ids.LIGHT_KEY in node
    ]


def light_sources(group: bpy.types.ShaderNodeTree) -> dict[str, Source]:
    """Map the names of the lights' nodes to the lamps that drive them and their empties."""
    lamps: dict[str, bpy.types.Object | None] = {}
    empties: dict[str, bpy.types.Object | None] = {}
    instanced = {node.name for node in group.nodes if node.get(ids.INSTANCED_KEY)}
    for curve in group.animation_data.drivers if group.animation_data is not None else ():
        escaped, _, socket = curve.data_path.removeprefix('nodes["').partition('"].inputs["')
        name = bpy.utils.unescape_identifier(escaped)
        variables = curve.driver.variables
        lamps[name] = variables[0].targets[0].id
        if name in instanced and socket.startswith(ids.POWER):
            # The last variable of an instanced light's power is its empty's (lights/drivers.py).
            empties[name] = variables[-1].targets[0].id
    # Without its empty an instanced lamp counts as deleted, even if it is elsewhere as well.
    return {
        name: (lamp if name not in instanced or empties.get(name) else None, empties.get(name))
        for name, lamp in lamps.items()
    }
