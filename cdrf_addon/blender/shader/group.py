# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's CDRF shader group: the sum over its lights of paper Eq. 5, and nothing it lacks.

A variant is made for each way of having curvature and of sharing sigma0 between channels, and for
each model of reflectance; the branches are one per light. Wiring:

    attribute levels -> kappa at the channel's length                 |
                     -> x Sigma0 x Ratio -> squared = variance --------+
    normal (or map) -------+                                          |
    light i -> Direction --+-> dot -> Cosine --------> Reflectance <--+-- + light's Variance/moment
            -> Radiance (x received, x visibility) -> x f --> sum over i --> x Base Color
    world (ambient_nodes.py) ------------------------------------> + ^
                                                                           x Strength -> Emission
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import bpy

from ... import ids
from ...core.reflectance.model import RING, SPHERE, name_of
from ..lights.scene_lights import HARD_SUN, SceneLight, drive_light
from ..nodes.groups import SEPARATE, detail_group, diffused_group, light_group, reflectance_group
from ..nodes.shadow_edge import edge_group
from ..nodes.tables import Table, find_table, table_of
from ..nodes.tree import TreeBuilder, declare, is_intact, rebuild
from ..world.light import WorldLight, is_same, stamp, stamped
from . import shadows
from .ambient import (
    bands_group,
    feed_sun,
    harmonics_node,
    occlusion_node,
    world_rotation,
    world_strength,
)
from .shadows import NO_SHADOWS, Choice

VERSION = 11

# A channel narrower than a hundredth of the widest is Lambert in every row of the table.
LEAST_MOMENT = 1e-4
# A sun of more than 3 degrees blurs the terminator visibly (lights.HARD_SUN).
SMALL_SUN = math.sin(HARD_SUN / 2.0) ** 2
# Whole numbers up to 2^24 are exact in the 32-bit float as which a property reaches the shader.
MOST_SELECTIVE = 24

Normals = dict[str, Any]
"""Sets of channels that share a normal, and the normal."""

FLAT, CONSTANT, ATTRIBUTE, SCALED = "flat", "constant", "attribute", "scaled attribute"
"""Where kappa comes from: nowhere, the Curvature input, the mesh, the mesh and the object."""


@dataclass(frozen=True)
class Variant:
    """What decides the content of a shader group, apart from the lights."""

    channels: str
    """Look-ups: see groups.CHANNEL_SETS."""
    source: str
    """FLAT, CONSTANT, ATTRIBUTE or SCALED."""
    model: str
    """Key of the model of reflectance."""
    mapped: bool = False
    """Whether a normal or bump map feeds the Normal input."""
    occluded: bool = False
    """Whether what is near takes away from the world's light."""
    shadows: Choice = NO_SHADOWS
    """Whether the lights' cast shadows fall on the surface, and how."""
    links: str = ""
    """Lights with light linking that the group has (linking.links_of); empty if there are none."""

    @property
    def name(self) -> str:
        """Name of the node group."""
        lookups = "+".join(self.channels.split())
        source = "" if self.source == ATTRIBUTE else f" {self.source}"
        extras = (" mapped" if self.mapped else "") + (" occluded" if self.occluded else "")
        extras += (" shadows" if self.shadows.cast else "") + (
            " coloured" if self.shadows.edges else ""
        )
        extras += " linked" if self.links else ""
        return f"CDRF {name_of(self.model)} {lookups}{source}{extras}"


def variant_of(
    ratio: Sequence[float],
    source: str,
    model: str,
    *,
    mapped: bool = False,
    occluded: bool = False,
    shadows: Choice = NO_SHADOWS,
    links: str = "",
) -> Variant:
    """Choose the variant with one look-up per distinct sigma0.

    A flat mesh has sigma = 0 in every channel, whatever the ratio: one look-up, unless a map gives
    each channel a normal of its own.
    """
    if source == FLAT and not mapped:
        return Variant("RGB", FLAT, model, False, occluded, shadows, links)
    red, green, blue = ratio
    if red == green == blue:
        channels = "RGB"
    elif green == blue:
        channels = "R GB"
    elif red == green:
        channels = "RG B"
    elif red == blue:
        channels = "RB G"
    else:
        channels = "R G B"
    return Variant(channels, source, model, mapped, occluded, shadows, links)


def stamped_variant(group: bpy.types.ShaderNodeTree) -> Variant:
    """Read back the variant of a group made by `ensure_shader_group`.

    The paper's ring was the only model before version 5.
    """
    return Variant(
        group[ids.CHANNELS_KEY],
        group[ids.SOURCE_KEY],
        group.get(ids.MODEL_KEY, RING),
        bool(group.get(ids.MAPPED_KEY, False)),
        bool(group.get(ids.OCCLUDED_KEY, False)),
        Choice(bool(group.get(ids.SHADOW_KEY, False)), bool(group.get(ids.EDGE_KEY, False))),
        group.get(ids.LINKS_KEY, ""),
    )


def branch_lookups(table: Table, variant: Variant, light: SceneLight) -> str:
    """Choose which channels share a look-up for a light.

    Where one look-up of a table with colour serves all channels, a light of some size needs three:
    its own blur adds to a wide channel's and to a narrow one's in different parts. So it does under
    a normal map, of which each channel sees another part.
    """
    return SEPARATE if table.colour and (light.soft or variant.mapped) else variant.channels


def is_shader_group(group: bpy.types.ShaderNodeTree | None) -> bool:
    """Tell whether a node group is one of ours, whoever renamed or linked it."""
    return group is not None and group.get(ids.ROLE_KEY) == ids.ROLE_SHADER


def ensure_shader_group(
    variant: Variant,
    scene: bpy.types.Scene,
    lights: Sequence[SceneLight],
    world: WorldLight | None = None,
) -> bpy.types.ShaderNodeTree:
    """Return the scene's group of that variant, its light branches brought up to date."""
    group = _find(variant, scene)
    if group is None:
        group = bpy.data.node_groups.new(variant.name, "ShaderNodeTree")
        group[ids.ROLE_KEY] = ids.ROLE_SHADER
        group[ids.CHANNELS_KEY] = variant.channels
        group[ids.SOURCE_KEY] = variant.source
        group[ids.MODEL_KEY] = variant.model
        group[ids.MAPPED_KEY] = variant.mapped
        group[ids.OCCLUDED_KEY] = variant.occluded
        group[ids.SHADOW_KEY] = variant.shadows.cast
        group[ids.EDGE_KEY] = variant.shadows.edges
        group[ids.LINKS_KEY] = variant.links
        group[ids.SCENE_KEY] = scene.name
        group.color_tag = "SHADER"
        group.description = "Curvature-dependent translucency (Kubo et al. 2011), made by CDRF"
    elif is_current(group, lights) and is_same(stamped(group), world):
        return group
    table = table_of(variant.model)
    rebuild(group, lambda builder: _build(builder, variant, lights, world, table))
    stamp(group, world)
    group[ids.SHADOW_WORLD_KEY] = shadows.world_shines(scene.world)
    group[ids.VERSION_KEY] = VERSION
    return group


def _find(variant: Variant, scene: bpy.types.Scene) -> bpy.types.ShaderNodeTree | None:
    for group in bpy.data.node_groups:
        if (
            group.library is None
            and is_shader_group(group)
            and stamped_variant(group) == variant
            and group[ids.SCENE_KEY] == scene.name
        ):
            return group
    return None


def is_current(group: bpy.types.ShaderNodeTree, lights: Sequence[SceneLight]) -> bool:
    """Tell whether the group has exactly these lights, each of the type it was wired for."""
    if group.get(ids.VERSION_KEY) != VERSION or not is_intact(group):
        return False
    variant = stamped_variant(group)
    table = find_table(variant.model)
    if table is None:
        # Where only the world shines nothing may have used it, and a saved file drops it.
        return not lights and not wired_lights(group)
    wanted = {wanted_branch(table, variant, light) for light in lights}
    if layers_due(group, lights) or shadows_due(group, lights) or bits_due(group):
        return False
    return set(wired_lights(group)) == wanted


def layers_due(group: bpy.types.ShaderNodeTree, lights: Sequence[SceneLight]) -> str:
    """Say which light other view layers leave out than those the group was made for."""
    sources = _sources(group)
    wired = {
        sources.get(node.name): tuple(node.get(ids.EXCLUDED_KEY, "").splitlines())
        for node in group.nodes
        if ids.LIGHT_KEY in node
    }
    for light in lights:
        if wired.get(light.source, light.excluded) != light.excluded:
            return f"light '{light.name}' is in other view layers now"
    return ""


def shadows_due(group: bpy.types.ShaderNodeTree, lights: Sequence[SceneLight]) -> str:
    """Say how the shadows differ from those the group was made for; empty if they do not."""
    if not stamped_variant(group).shadows.cast:
        return ""
    wired = {node.name for node in group.nodes if node.get(ids.SHADOW_KEY)}
    sources = _sources(group)
    casting = {sources.get(name) for name in wired}
    changed = [light for light in lights if light.casts != (light.source in casting)]
    if changed:
        return f"light '{changed[0].name}' casts shadows now, or no more"
    if stamped_variant(group).shadows.edges:
        picky = {sources.get(name) for name in wired if group.nodes[name].get(ids.BLOCKERS_KEY)}
        for light in lights:
            if light.casts and light.picks_blockers != (light.source in picky):
                return f"other objects block light '{light.name}' now"
    scene = bpy.data.scenes.get(group[ids.SCENE_KEY])
    if wired and scene and shadows.world_shines(scene.world) != group.get(ids.SHADOW_WORLD_KEY):
        return "the world's light was switched on or off"
    return ""


class Wired(NamedTuple):
    """A light's branch of a shader group, as it was made."""

    object: bpy.types.Object | None
    """The lamp; None if it, or the empty that instances it, was deleted."""
    instance: bpy.types.Object | None
    kind: str
    selective: bool
    """Whether each object says by itself that it does not receive the light."""
    lookups: str


def wanted_branch(table: Table, variant: Variant, light: SceneLight) -> Wired:
    """Say what the branch of a light would be if it were made now."""
    lookups = branch_lookups(table, variant, light)
    return Wired(light.object, light.instance, light.kind, light.selective, lookups)


def wired_lights(group: bpy.types.ShaderNodeTree) -> list[Wired]:
    """List the branches of a group.

    The drivers' targets are asked, not names: they survive renaming.
    """
    sources = _sources(group)
    return [
        Wired(
            *sources.get(node.name, (None, None)),
            node[ids.LIGHT_KEY],
            ids.BIT_KEY in node,
            node.get(ids.LOOKUPS_KEY, ""),
        )
        for node in group.nodes
        if ids.LIGHT_KEY in node
    ]


Source = tuple[bpy.types.Object | None, bpy.types.Object | None]
"""A lamp and the empty that instances it; None if deleted, or if there is no empty."""


def light_bits(group: bpy.types.ShaderNodeTree) -> dict[Source, int]:
    """Map the selective lights of a group, each a lamp and the empty that instances it, to bits."""
    bits = {node.name: node[ids.BIT_KEY] for node in group.nodes if ids.BIT_KEY in node}
    sources = _sources(group) if bits else {}
    return {sources.get(name, (None, None)): bit for name, bit in bits.items()}


def _sources(group: bpy.types.ShaderNodeTree) -> dict[str, Source]:
    """Map the names of the light nodes to the lamps that drive them, and the instancing empties."""
    lamps: dict[str, bpy.types.Object | None] = {}
    empties: dict[str, bpy.types.Object | None] = {}
    instanced = {node.name for node in group.nodes if node.get(ids.INSTANCED_KEY)}
    for curve in group.animation_data.drivers if group.animation_data is not None else ():
        escaped, _, socket = curve.data_path.removeprefix('nodes["').partition('"].inputs["')
        name = bpy.utils.unescape_identifier(escaped)
        variables = curve.driver.variables
        lamps[name] = variables[0].targets[0].id
        if name in instanced and socket.startswith(ids.POWER):
            empties[name] = variables[-1].targets[0].id
    # Without its empty an instanced lamp is as good as deleted, even if it stands elsewhere too.
    return {
        name: (lamp if name not in instanced or empties.get(name) else None, empties.get(name))
        for name, lamp in lamps.items()
    }


def _declare(tree: bpy.types.ShaderNodeTree) -> None:
    declare(
        tree,
        ids.BASE_COLOR,
        "Color",
        default=(0.8, 0.8, 0.8, 1.0),
        tip="Albedo k_d: the colour of the surface in white light",
    )
    declare(
        tree,
        ids.SIGMA0,
        default=0.0,
        low=0.0,
        high=1e6,
        subtype="DISTANCE",
        tip="How far light travels under the surface. 0 is an opaque (Lambert) surface",
    )
    declare(
        tree,
        ids.SIGMA0_RATIO,
        "Vector",
        default=(1.0, 1.0, 1.0),
        low=0.0,
        high=1e3,
        tip="Sigma0 of red, green and blue, as factors of Sigma0",
    )
    declare(
        tree,
        ids.NORMAL,
        "Vector",
        default=(0.0, 0.0, 0.0),
        hide_value=True,
        tip="Normal or bump map; after connecting one press Update",
    )
    declare(tree, ids.STRENGTH, default=1.0, low=0.0, high=1e6, tip="Factor on the result")
    declare(tree, ids.SHADER, "Shader", output=True)


def _build(
    b: TreeBuilder,
    variant: Variant,
    lights: Sequence[SceneLight],
    world: WorldLight | None,
    table: Table,
) -> None:
    _declare(b.tree)
    if variant.mapped:
        declare(
            b.tree,
            ids.DETAIL_SIZE,
            default=0.0,
            low=0.0,
            high=1e6,
            subtype="DISTANCE",
            tip="Size of the normal map's detail, from bump to bump. What is finer than the "
            "scatter distance is blurred, red most. 0 keeps all",
        )
    if variant.occluded:
        declare(
            b.tree,
            ids.OCCLUSION_DISTANCE,
            default=1.0,
            low=0.0,
            subtype="DISTANCE",
            tip="How far away a surface may be that still takes away from the world's light",
        )
    if variant.source == CONSTANT:
        declare(
            b.tree, ids.CURVATURE, default=0.0, low=0.0, tip="Curvature of the whole mesh, 1/length"
        )
    given, result = b.ends()
    total: Any = (0.0, 0.0, 0.0)
    if world is not None and world.environment.is_black:
        world = None
    normal: Normals = {}
    variance = None
    if lights or (world is not None and not world.environment.is_uniform):
        normal = _normals(b, variant, table, given)
    if lights or (world is not None and has_bands(variant, world, table)):
        variance = _skin_variance(b, variant, given)
    branches = [_light_node(b, variant, light, table) for light in lights]
    radiances = _radiances(b, branches)
    visible = {}
    if variant.shadows.cast and any(light.casts for light in lights):
        visible = _visibilities(b, branches, radiances, lights)
        declare(b.tree, ids.THICKNESS, output=True, tip="Where the surface's own shadow begins")
        reach = shadows.thickness(b, given[ids.SIGMA0], given[ids.SIGMA0_RATIO])
        b.feed(result[ids.THICKNESS], reach)
    for number, node in enumerate(branches):
        lit = node.outputs
        lookups = node[ids.LOOKUPS_KEY]
        f = b.group(
            reflectance_group(lookups, table, own_cosines=len(normal) > 1),
            f"Reflectance {node.name}",
            Cosine=_cosine(b, normal, lit[ids.DIRECTION]),
            Variance=_with_light(b, variance, lit[ids.VARIANCE], lookups, table),
        ).outputs[ids.REFLECTANCE]
        radiance = radiances[number]
        # Rays in screen space meet every object, also those that do not block this light.
        edges = variant.shadows.edges and not node[ids.BLOCKERS_KEY]
        if number in visible and edges and len(visible) <= shadows.MOST_ISOLATED:
            edge = b.group(
                edge_group(),
                f"Shadow Edge {node.name}",
                Visibility=visible[number],
                Direction=lit[ids.DIRECTION],
                Width=b.vector("SCALE", given[ids.SIGMA0_RATIO], scale=given[ids.SIGMA0]),
            )
            radiance = b.vector("MULTIPLY", radiance, edge.outputs[ids.VISIBILITY])
        elif number in visible:
            radiance = b.vector("SCALE", radiance, scale=visible[number])
        total = b.vector("MULTIPLY_ADD", f, radiance, total)
    if world is not None:
        total = _with_world(b, variant, world, table, normal, variance, total)
    emission = b.node("ShaderNodeEmission")
    b.feed(emission.inputs["Color"], b.vector("MULTIPLY", total, given[ids.BASE_COLOR]))
    b.feed(emission.inputs["Strength"], given[ids.STRENGTH])
    b.feed(result[ids.SHADER], emission.outputs["Emission"])


def has_bands(variant: Variant, world: WorldLight, table: Table) -> bool:
    """Tell whether the skin changes the world's light: it blurs, and there is more than grey."""
    whole = world.environment.is_uniform and table.key == SPHERE
    return variant.source != FLAT and not whole


def _with_world(
    b: TreeBuilder,
    variant: Variant,
    world: WorldLight,
    table: Table,
    normal: Normals,
    variance: Any,
    total: Any,
) -> Any:
    """Add the world's light, as far as the skin lets it through."""
    environment = world.environment
    bands = None
    if has_bands(variant, world, table):
        bands = b.group(bands_group(variant.channels, table), "Bands", Variance=variance).outputs
    rotation = world_rotation(b, world)
    light: Any = _per_set(b, normal, lambda own: harmonics_node(b, world, own, bands, rotation))
    if environment.sun is not None:
        sun = SceneLight(None, "SUN", environment.sun.sin2_half_angle > SMALL_SUN)
        lookups = branch_lookups(table, variant, sun)
        node = b.group(light_group("SUN"), "World Sun")
        node.inputs[ids.GAIN].default_value = table.gain
        feed_sun(b, node, world, environment.sun, rotation)
        f = b.group(
            reflectance_group(lookups, table, own_cosines=len(normal) > 1),
            "Reflectance World Sun",
            Cosine=_cosine(b, normal, node.outputs[ids.DIRECTION]),
            Variance=_with_light(b, variance, node.outputs[ids.VARIANCE], lookups, table),
        ).outputs[ids.REFLECTANCE]
        light = b.vector("MULTIPLY_ADD", f, node.outputs[ids.RADIANCE], light)
    if variant.occluded:
        distance = b.node("NodeGroupInput").outputs[ids.OCCLUSION_DISTANCE]
        seen = occlusion_node(b, distance)
        light = b.vector("SCALE", light, scale=seen)
    strength = world_strength(b, world)
    if strength is None:
        return b.vector("ADD", light, total)
    return b.vector("MULTIPLY_ADD", light, strength, total)


def _light_node(
    b: TreeBuilder, variant: Variant, light: SceneLight, table: Table
) -> bpy.types.ShaderNode:
    """Add the node of a light, driven by it and stamped with what it was wired for."""
    node = b.group(light_group(light.kind), light.name)
    node[ids.LIGHT_KEY] = light.kind
    node[ids.INSTANCED_KEY] = light.instance is not None
    node[ids.BLOCKERS_KEY] = light.picks_blockers
    if light.selective:
        node[ids.BIT_KEY] = _bit_of(light)
    node[ids.LOOKUPS_KEY] = branch_lookups(table, variant, light)
    node[ids.SHADOW_KEY] = variant.shadows.cast and light.casts
    if light.excluded:
        node[ids.EXCLUDED_KEY] = "\n".join(light.excluded)
    node.inputs[ids.GAIN].default_value = table.gain
    drive_light(b.tree, node, light)
    return node


def _bit_of(light: SceneLight) -> int:
    """The bit that a light has in another group, else one that none has; -1 if there is none left.

    Groups share the objects' property, so a light has the same bit in all.
    """
    known = -1
    others = set()
    for source, bit in _all_bits():
        if source == light.source:
            known = max(known, bit)
        else:
            others.add(bit)
    free = set(range(MOST_SELECTIVE)) - others
    return known if known in free else min(free, default=-1)


def _all_bits() -> list[tuple[Source, int]]:
    """List the selective lights of all shader groups, and their bits."""
    return [
        pair
        for group in bpy.data.node_groups
        if is_shader_group(group)
        for pair in light_bits(group).items()
    ]


def bits_due(group: bpy.types.ShaderNodeTree) -> str:
    """Say which light shares its bit with another, or has none though there are free ones."""
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


def _radiances(b: TreeBuilder, nodes: Sequence[bpy.types.ShaderNode]) -> list[Any]:
    """Radiance of each light; nothing where the object does not receive it (ids.UNLIT_KEY)."""
    radiances = [node.outputs[ids.RADIANCE] for node in nodes]
    selective = {n: node[ids.BIT_KEY] for n, node in enumerate(nodes) if ids.BIT_KEY in node}
    if selective:
        unlit = b.node(
            # EEVEE asks the instancing empty; what is not instanced falls back to itself.
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


def _visibilities(
    b: TreeBuilder,
    nodes: Sequence[bpy.types.ShaderNode],
    radiances: Sequence[Any],
    lights: Sequence[SceneLight],
) -> dict[int, Any]:
    """Visibility of each light that casts shadows, by its number; for the surface's own normal."""
    normal = b.node("ShaderNodeNewGeometry").outputs["Normal"]
    scene = bpy.data.scenes.get(b.tree[ids.SCENE_KEY])
    shines = shadows.world_shines(scene.world if scene is not None else None)
    branches = [
        shadows.Branch(node.outputs[ids.DIRECTION], radiance, light.casts)
        for node, radiance, light in zip(nodes, radiances, lights, strict=True)
    ]
    return shadows.Shadows(b, branches, normal, world=shines).visibilities()


def _with_light(b: TreeBuilder, skin: Any, light: Any, lookups: str, table: Table) -> Any:
    """Add a light's variance to the skin's, in the units of the table's rows.

    A channel whose blur is sqrt(m) sigma wide needs 1 / m of the light's variance on top of
    sigma^2; channels that share a look-up take the widest one's.
    """
    if not table.colour:
        return b.vector("ADD", skin, light)
    moments = dict(zip("RGB", table.moments, strict=True))
    share = {}
    for shared in lookups.split():
        widest = max(moments[channel] for channel in shared)
        share.update(dict.fromkeys(shared, 1.0 / max(widest, LEAST_MOMENT)))
    return b.vector("MULTIPLY_ADD", light, (share["R"], share["G"], share["B"]), skin)


def _normals(b: TreeBuilder, variant: Variant, table: Table, given: Any) -> Normals:
    """The surface's own normal; under a map, blended with it as far as a channel keeps detail."""
    own = b.node("ShaderNodeNewGeometry").outputs["Normal"]
    if not variant.mapped:
        return {"RGB": own}
    mapped = given[ids.NORMAL]
    # Nothing connected gives a zero vector.
    unset = b.math("LESS_THAN", b.vector("DOT_PRODUCT", mapped, mapped), 1e-12)
    mapped = b.vector("ADD", mapped, b.vector("SCALE", own, scale=unset))
    change = b.vector("SUBTRACT", mapped, own)
    ratio = dict(zip("RGB", b.separate(given[ids.SIGMA0_RATIO]), strict=True))
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


def _cosine(b: TreeBuilder, normals: Normals, direction: Any) -> Any:
    """Cosine of the light with the one normal, or a vector of one for each channel."""
    each = {
        shared: b.vector("DOT_PRODUCT", normal, direction) for shared, normal in normals.items()
    }
    if len(each) == 1:
        return next(iter(each.values()))
    return b.combine(*(each[_set_of(channel, each)] for channel in "RGB"))


def _per_set(b: TreeBuilder, normals: Normals, value: Callable[[Any], Any]) -> Any:
    """A colour that depends on the normal, each channel taken at its own."""
    if len(normals) <= 1:
        return value(next(iter(normals.values()), None))
    parts = {
        shared: dict(zip("RGB", b.separate(value(normal)), strict=True))
        for shared, normal in normals.items()
    }
    return b.combine(*(parts[_set_of(channel, parts)][channel] for channel in "RGB"))


def _set_of(channel: str, sets: Iterable[str]) -> str:
    return next(shared for shared in sets if channel in shared)


def _skin_variance(b: TreeBuilder, variant: Variant, given: Any) -> Any:
    """Square of sigma = sigma0 kappa per channel, as a vector."""
    if variant.source == FLAT:
        return (0.0, 0.0, 0.0)
    if variant.source == CONSTANT:
        sigma = b.math("MULTIPLY", given[ids.SIGMA0], given[ids.CURVATURE])
        width = b.vector("SCALE", given[ids.SIGMA0_RATIO], scale=sigma)
    else:
        width = _diffused_sigma(b, variant, given)
    return b.vector("MULTIPLY", width, width)


def _diffused_sigma(b: TreeBuilder, variant: Variant, given: Any) -> Any:
    """Sigma per channel, each from the curvature at the channel's own diffusion length."""
    levels = level_nodes(b)
    sigma0 = given[ids.SIGMA0]
    if variant.source == SCALED:
        # An object twice as large is the measured one seen with half the scatter distance.
        sigma0 = b.math("MULTIPLY", sigma0, size_node(b))
    ratio = dict(zip("RGB", b.separate(given[ids.SIGMA0_RATIO]), strict=True))
    sigma = {}
    for shared in variant.channels.split():
        own = b.math("MULTIPLY", sigma0, ratio[shared[0]])
        sigma.update(dict.fromkeys(shared, b.math("MULTIPLY", own, diffused_node(b, levels, own))))
    return b.combine(sigma["R"], sigma["G"], sigma["B"])


def level_nodes(b: TreeBuilder) -> dict[str, Any]:
    """What a mesh stores of its diffused curvature, by the sockets of `diffused_group`."""
    levels = b.node("ShaderNodeAttribute", attribute_name=ids.DIFFUSED_ATTRIBUTE)
    length = b.node("ShaderNodeAttribute", attribute_name=ids.LENGTH_ATTRIBUTE)
    return {
        ids.LEVELS: levels.outputs["Color"],
        ids.LEVELS_ALPHA: levels.outputs["Alpha"],
        ids.LENGTH: length.outputs["Fac"],
    }


def diffused_node(b: TreeBuilder, levels: dict[str, Any], sigma0: Any) -> Any:
    """Kappa at the diffusion length of a sigma0, both in the measured mesh's size."""
    node = b.group(diffused_group(), "Diffused Curvature", **levels, Sigma0=sigma0)
    return node.outputs[ids.CURVATURE]


def size_node(b: TreeBuilder) -> Any:
    """Size of the mesh as measured over the size it is seen in, as an instance or by itself.

    Wiring:

        object's X axis -> to world -> length --+
        object property: the same, as measured -+-> divide
    """
    axis = b.node(
        "ShaderNodeVectorTransform", vector_type="VECTOR", convert_from="OBJECT", convert_to="WORLD"
    )
    b.feed(axis.inputs["Vector"], (1.0, 0.0, 0.0))
    measured = b.node(
        "ShaderNodeAttribute", attribute_type="OBJECT", attribute_name=ids.SCALE_KEY
    ).outputs["Fac"]
    return b.math("DIVIDE", measured, b.vector("LENGTH", axis.outputs["Vector"]))


def curvature_nodes(b: TreeBuilder, *, scaled: bool, signed: bool) -> Any:
    """Kappa or signed mean from the mesh; where objects of several sizes share it, corrected."""
    attribute = b.node("ShaderNodeAttribute", attribute_name=ids.CURVATURE_ATTRIBUTE)
    value = attribute.outputs["Alpha"]
    if not signed:
        parts = b.node("ShaderNodeSeparateColor")
        b.feed(parts.inputs["Color"], attribute.outputs["Color"])
        value = parts.outputs["Red"]
    return b.math("MULTIPLY", value, size_node(b)) if scaled else value
