# SPDX-License-Identifier: GPL-3.0-or-later
"""The lights of a shader group: an instance of its type's group for each, driven and stamped.

Wiring, for each light:

    drivers -> light's group -> Direction, Variance --> Reflectance -------------------+
                             -> Radiance -> x received (bits.py) -> x visibility (rgb) -+-> + total

The visibility, where shadows are wired, is one number, or with coloured edges one per channel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from ... import ids
from ..lights.drivers import drive_light
from ..lights.scene_lights import SceneLight
from ..nodes.lights import light_group
from ..nodes.shadow_edge import edge_group
from ..nodes.tables import Table
from ..nodes.tree import Operand, Socket, Sockets, TreeBuilder
from ..world.surface import world_shines
from .bits import bit_of
from .surface import Surface, reflectance_node
from .variant import Variant
from .visibility import MOST_ISOLATED, Branch, VisibilityBuilder
from .wired import lookups_of


@dataclass(frozen=True)
class LightNodes:
    """The nodes of all lights of a group, in one order."""

    lights: Sequence[SceneLight]
    nodes: Sequence[bpy.types.ShaderNode]
    """An instance of its type's group for each light."""
    radiances: Sequence[Socket]
    """Radiance of each light, zero where the object does not receive it."""


def add_lights(
    b: TreeBuilder, variant: Variant, lights: Sequence[SceneLight], table: Table
) -> LightNodes:
    """Add the nodes of all lights of a shader group."""
    nodes = [_light_node(b, variant, light, table) for light in lights]
    return LightNodes(lights, nodes, _received(b, nodes))


def _light_node(
    b: TreeBuilder, variant: Variant, light: SceneLight, table: Table
) -> bpy.types.ShaderNode:
    """Add the node of a light, driven by it and stamped with what it was wired for."""
    node = b.group(light_group(light.kind), light.name)
    node[ids.LIGHT_KEY] = light.kind
    node[ids.INSTANCED_KEY] = light.instance is not None
    node[ids.BLOCKERS_KEY] = light.picks_blockers
    if light.selective:
        node[ids.BIT_KEY] = bit_of(light)
    node[ids.LOOKUPS_KEY] = lookups_of(table, variant, light)
    node[ids.SHADOW_KEY] = variant.shadows.cast and light.casts
    if light.excluded:
        node[ids.EXCLUDED_KEY] = "\n".join(light.excluded)
    node.inputs[ids.GAIN].default_value = table.gain
    drive_light(b.tree, node, light)
    return node


def _received(b: TreeBuilder, nodes: Sequence[bpy.types.ShaderNode]) -> list[Socket]:
    """Return the radiance of each light, zero where the object does not receive it."""
    radiances = [node.outputs[ids.RADIANCE] for node in nodes]
    selective = {n: node[ids.BIT_KEY] for n, node in enumerate(nodes) if ids.BIT_KEY in node}
    if selective:
        unlit = b.node(
            # EEVEE reads the instancing empty, and the object itself where there is none.
            "ShaderNodeAttribute",
            attribute_type="INSTANCER",
            attribute_name=ids.UNLIT_KEY,
        ).outputs["Fac"]
    for number, bit in selective.items():
        if bit >= 0:
            shifted = b.math("FLOOR", b.math("MULTIPLY", unlit, 2.0**-bit))
            received = b.math("SUBTRACT", 1.0, b.math("MODULO", shifted, 2.0))
            radiances[number] = b.vector("SCALE", radiances[number], scale=received)
    return radiances


def add_visibilities(b: TreeBuilder, lit: LightNodes) -> dict[int, Socket]:
    """Return the visibility of each light that casts shadows, by its number."""
    normal = b.node("ShaderNodeNewGeometry").outputs["Normal"]
    scene = bpy.data.scenes.get(b.tree[ids.SCENE_KEY])
    shines = world_shines(scene.world if scene is not None else None)
    branches = [
        Branch(node.outputs[ids.DIRECTION], radiance, light.casts)
        for node, radiance, light in zip(lit.nodes, lit.radiances, lit.lights, strict=True)
    ]
    return VisibilityBuilder(b, branches, normal, world=shines).visibilities()


def sum_lights(
    b: TreeBuilder,
    variant: Variant,
    surface: Surface,
    lit: LightNodes,
    visibilities: dict[int, Socket],
    given: Sockets,
) -> Operand:
    """Return the sum over the lights of reflectance, radiance and visibility (paper, Eq. 5).

    Args:
        b: Builder of the shader group.
        variant: Of the group.
        surface: What is lit.
        lit: The lights.
        visibilities: What `add_visibilities` returned, or empty.
        given: The group's inputs.
    """
    total: Operand = (0.0, 0.0, 0.0)
    isolated = len(visibilities) <= MOST_ISOLATED
    for number, node in enumerate(lit.nodes):
        f = reflectance_node(b, surface, node, node[ids.LOOKUPS_KEY], node.name)
        radiance = lit.radiances[number]
        # Rays in screen space meet every object, also those that do not block this light.
        edges = variant.shadows.edges and isolated and not node[ids.BLOCKERS_KEY]
        if number in visibilities and edges:
            edge = b.group(
                edge_group(),
                f"Shadow Edge {node.name}",
                Visibility=visibilities[number],
                Direction=node.outputs[ids.DIRECTION],
                Width=b.vector("SCALE", given[ids.SIGMA0_RATIO], scale=given[ids.SIGMA0]),
            )
            radiance = b.vector("MULTIPLY", radiance, edge.outputs[ids.VISIBILITY])
        elif number in visibilities:
            radiance = b.vector("SCALE", radiance, scale=visibilities[number])
        total = b.vector("MULTIPLY_ADD", f, radiance, total)
    return total
