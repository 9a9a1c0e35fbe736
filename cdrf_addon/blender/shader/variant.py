# SPDX-License-Identifier: GPL-3.0-or-later
"""What decides the content of a shader group apart from its lights and world, and its name.

From material to group and back:

    ratio -> channels (RGB, R GB, ...) --+
    mesh -> source of kappa -------------+-> Variant -> stamped on the group -> read back
    material -> model, shadows, ... -----+
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from ... import ids
from ...core.reflectance.model import RING, name_of

FLAT, CONSTANT, ATTRIBUTE, SCALED = "flat", "constant", "attribute", "scaled attribute"
"""Source of kappa: none, the Curvature input, the mesh, the mesh and the object's size."""


@dataclass(frozen=True)
class ShadowChoice:
    """Which cast shadows a material gets."""

    cast: bool = False
    edges: bool = False
    """Whether their edges are blurred and coloured as far as light scatters."""


NO_SHADOWS = ShadowChoice()


@dataclass(frozen=True)
class Variant:
    """What decides the content of a shader group, apart from its lights and world."""

    channels: str
    """Look-ups: one of CHANNEL_SETS in nodes/reflectance.py."""
    source: str
    """FLAT, CONSTANT, ATTRIBUTE or SCALED."""
    model: str
    """Key of the reflectance model."""
    mapped: bool = False
    """Whether a normal or bump map feeds the Normal input."""
    occluded: bool = False
    """Whether ambient occlusion darkens the world's light."""
    shadows: ShadowChoice = NO_SHADOWS
    """Whether the lights' cast shadows fall on the surface, and how."""
    links: str = ""
    """The group's lights with light linking (`links_of` in material/linking.py); empty for none."""
    walk: str = ""
    """The random walk that makes it depend on the view (core/walk/view.py); empty for none."""

    @property
    def name(self) -> str:
        """Name of the node group."""
        lookups = "+".join(self.channels.split())
        source = "" if self.source == ATTRIBUTE else f" {self.source}"
        extras = (
            (self.mapped, " mapped"),
            (self.occluded, " occluded"),
            (self.shadows.cast, " shadows"),
            (self.shadows.edges, " coloured"),
            (self.links, " linked"),
            (self.walk, " view"),
        )
        return f"CDRF {name_of(self.model)} {lookups}{source}" + "".join(
            text for present, text in extras if present
        )


def variant_of(
    ratio: Sequence[float],
    source: str,
    model: str,
    *,
    mapped: bool = False,
    occluded: bool = False,
    shadows: ShadowChoice = NO_SHADOWS,
    links: str = "",
    walk: str = "",
) -> Variant:
    """Choose the variant with one look-up for each distinct sigma0.

    A flat mesh has sigma = 0 in every channel, whatever the ratio: one look-up, unless a map gives
    each channel a normal of its own.

    Args:
        ratio: Sigma0 of red, green and blue as factors.
        source: FLAT, CONSTANT, ATTRIBUTE or SCALED.
        model: Key of the reflectance model.
        mapped: See `Variant`.
        occluded: See `Variant`.
        shadows: See `Variant`.
        links: See `Variant`.
        walk: See `Variant`.
    """
    if source == FLAT and not mapped:
        return Variant("RGB", FLAT, model, False, occluded, shadows, links, walk)
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
    return Variant(channels, source, model, mapped, occluded, shadows, links, walk)


def is_shader_group(group: bpy.types.ShaderNodeTree | None) -> bool:
    """Return whether a node group is one of ours, even if it was renamed or linked."""
    return group is not None and group.get(ids.ROLE_KEY) == ids.ROLE_SHADER


def stamp_variant(group: bpy.types.ShaderNodeTree, variant: Variant) -> None:
    """Note on a new shader group which variant it is."""
    group[ids.ROLE_KEY] = ids.ROLE_SHADER
    group[ids.CHANNELS_KEY] = variant.channels
    group[ids.SOURCE_KEY] = variant.source
    group[ids.MODEL_KEY] = variant.model
    group[ids.MAPPED_KEY] = variant.mapped
    group[ids.OCCLUDED_KEY] = variant.occluded
    group[ids.SHADOW_KEY] = variant.shadows.cast
    group[ids.EDGE_KEY] = variant.shadows.edges
    group[ids.LINKS_KEY] = variant.links
    group[ids.WALK_KEY] = variant.walk


def stamped_variant(group: bpy.types.ShaderNodeTree) -> Variant:
    """Read back the variant of a shader group.

    Groups older than version 5 have no model stamped: the paper's ring was the only one.
    """
    return Variant(
        group[ids.CHANNELS_KEY],
        group[ids.SOURCE_KEY],
        group.get(ids.MODEL_KEY, RING),
        bool(group.get(ids.MAPPED_KEY, False)),
        bool(group.get(ids.OCCLUDED_KEY, False)),
        ShadowChoice(bool(group.get(ids.SHADOW_KEY, False)), bool(group.get(ids.EDGE_KEY, False))),
        group.get(ids.LINKS_KEY, ""),
        group.get(ids.WALK_KEY, ""),
    )
