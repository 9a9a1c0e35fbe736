# SPDX-License-Identifier: GPL-3.0-or-later
"""Scatter distances of a material's channels: from its nodes, from a preset, and what follows."""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy

from ... import ids
from ...compat import animation_curves, walk_method
from ...core.reflectance.detail import DETAIL_PER_SIGMA0
from ...core.reflectance.model import DEFAULT_KIND, PROFILE, SPHERE
from ...core.reflectance.profile import SKIN_PROFILE
from ...core.scattering.node_radius import sigma0_per_radius
from ...core.scattering.presets import Preset, in_units
from ...core.walk.material import DEFAULT_WALK
from ..nodes.tables import table_of
from . import settings
from .install import cdrf_node, require_editable
from .model import ensure_chosen, has_colour, model_key, set_kind
from .scattering import Scattering
from .shader_group import change_variant
from .walk import store_walk, walk_for, write_free_path


def channel_sigma0(material: bpy.types.Material) -> list[float]:
    """Return the scatter distance of red, green and blue, whatever model the material has."""
    moments = table_of(ensure_chosen(material)[0]).moments
    sigma0 = settings.sigma0(material)
    return [
        sigma0 * ratio * math.sqrt(moment)
        for ratio, moment in zip(settings.sigma0_ratio(material), moments, strict=True)
    ]


def set_channel_sigma0(material: bpy.types.Material, sigma0: Sequence[float]) -> None:
    """Set the scatter distance of each channel, for a model without colour."""
    largest = max(sigma0)
    settings.set_sigma0(material, largest)
    ratio = [value / largest if largest > 0.0 else 1.0 for value in sigma0]
    settings.set_sigma0_ratio(material, ratio)


def set_scattering(material: bpy.types.Material, found: Scattering) -> None:
    """Take the scatter distances from what a Principled or Subsurface Scattering node has."""
    factors = sigma0_per_radius(found.albedo, walk_method(found.method))
    sigma0 = [radius * float(factor) for radius, factor in zip(found.radius, factors, strict=True)]
    store_walk(material, found.walk, found.albedo)
    set_channel_sigma0(material, sigma0)
    show_walk(material)


def show_walk(material: bpy.types.Material) -> None:
    """Give a translucent material the walk that was stored for it."""
    change_variant(material, walk=walk_for(material, model_key(material)))
    write_free_path(material)


def apply_preset(material: bpy.types.Material, preset: Preset, metres: float, size: float) -> None:
    """Give a material the model and scatter distances of a preset.

    Args:
        material: Any editable material.
        preset: In millimetres.
        metres: In a unit of the scene.
        size: Size of the object in the scene over its real size.

    Raises:
        SceneError: The material is linked.
    """
    sigma0, ratio = in_units(preset.sigma0, metres, size)
    if preset.model == PROFILE:
        require_editable(material)
        material.cdrf.profile = SKIN_PROFILE.to_text()
        material.cdrf.profile_base = SPHERE
        set_kind(material, PROFILE)
        ratio = (1.0, 1.0, 1.0)  # a profile has its channels' widths in its table
    elif has_colour(material):
        set_kind(material, DEFAULT_KIND)
    settings.set_sigma0(material, sigma0)
    if preset.model != PROFILE:
        store_walk(material, DEFAULT_WALK, preset.albedo)
    settings.set_sigma0_ratio(material, ratio)
    show_walk(material)
    choose_detail(material)


def choose_detail(material: bpy.types.Material) -> None:
    """Make the detail of the material's normal map as fine as its scatter distance asks for."""
    node = cdrf_node(material)
    if node is not None and ids.DETAIL_SIZE in node.inputs:
        largest = settings.sigma0(material) * max(settings.sigma0_ratio(material))
        node.inputs[ids.DETAIL_SIZE].default_value = DETAIL_PER_SIGMA0 * largest


def overridden(material: bpy.types.Material) -> str:
    """Describe what decides the scatter distance in place of its value; empty if nothing does."""
    node = cdrf_node(material)
    if node is None:
        return ""
    for name in (ids.SIGMA0, ids.SIGMA0_RATIO):
        socket = node.inputs[name]
        moved = animation_curves(material.node_tree, socket.path_from_id("default_value"))
        if socket.is_linked or moved:
            how = "connected to a node" if socket.is_linked else "animated"
            return (
                f"{name} of '{material.name}' is {how}, and that decides what is seen: "
                f"{'disconnect it' if socket.is_linked else 'clear its keyframes'} to use this."
            )
    return ""
