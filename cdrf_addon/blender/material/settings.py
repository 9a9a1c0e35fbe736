# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist has set of a material: the one place that reads and writes it.

A translucent material has its settings in its node, where they render and can be animated; one that
is not translucent yet remembers them in `material.cdrf.chosen_*`. The functions here read the one
or the other and write both. The properties of `material.cdrf` and all of blender/ call them;
nothing in blender/ writes a property that has a setter (tests/blender/test_settings.py).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy

from ... import ids
from ..shader.variant import stamped_variant
from . import specular
from .install import cdrf_node, require_editable
from .shader_group import change_variant
from .walk import ON, choose_view, walk_for, write_free_path

SIGMA0_MAX = 1e6
RATIO_MAX = 1e3
UNSET = -1.0
"""Value of `chosen_sigma0` while nobody has chosen a scatter distance."""

Ratio = tuple[float, float, float]


def _clamped(value: float, high: float) -> float:
    """Clamp to 0 and `high`; a NaN becomes 0."""
    return min(max(value, 0.0), high) if math.isfinite(value) else (high if value > 0.0 else 0.0)


def sigma0(material: bpy.types.Material) -> float:
    """Return the scatter distance, in world units."""
    node = cdrf_node(material)
    if node is not None:
        return float(node.inputs[ids.SIGMA0].default_value)
    return max(float(material.cdrf.chosen_sigma0), 0.0)


def set_sigma0(material: bpy.types.Material, value: float) -> None:
    """Set the scatter distance, clamped to what makes sense."""
    material.cdrf.chosen_sigma0 = _clamped(value, SIGMA0_MAX)
    node = cdrf_node(material)
    if node is not None:
        node.inputs[ids.SIGMA0].default_value = material.cdrf.chosen_sigma0


def is_sigma0_chosen(material: bpy.types.Material) -> bool:
    """Return whether anybody has chosen a scatter distance yet."""
    return bool(material.cdrf.chosen_sigma0 >= 0.0)


def sigma0_ratio(material: bpy.types.Material) -> Ratio:
    """Return the scatter distance of red, green and blue as factors of sigma0."""
    node = cdrf_node(material)
    source = material.cdrf.chosen_ratio
    if node is not None:
        source = node.inputs[ids.SIGMA0_RATIO].default_value
    red, green, blue = source
    return red, green, blue


def set_sigma0_ratio(material: bpy.types.Material, ratio: Sequence[float]) -> None:
    """Set the ratio of red, green and blue, and give the node as many look-ups as it asks for."""
    store_sigma0_ratio(material, ratio)
    change_variant(material)


def store_sigma0_ratio(material: bpy.types.Material, ratio: Sequence[float]) -> None:
    """Set the ratio and leave the node's look-ups to a `change_variant` that follows."""
    material.cdrf.chosen_ratio = [_clamped(factor, RATIO_MAX) for factor in ratio]
    node = cdrf_node(material)
    if node is not None:
        node.inputs[ids.SIGMA0_RATIO].default_value = material.cdrf.chosen_ratio


def write_to_node(material: bpy.types.Material) -> None:
    """Give a node that was just made the distances that were chosen before."""
    node = cdrf_node(material)
    assert node is not None
    node.inputs[ids.SIGMA0_RATIO].default_value = material.cdrf.chosen_ratio
    node.inputs[ids.SIGMA0].default_value = max(material.cdrf.chosen_sigma0, 0.0)
    write_free_path(material)


def is_occluded(material: bpy.types.Material) -> bool:
    """Return whether the material has Ambient Occlusion."""
    node = cdrf_node(material)
    return stamped_variant(node.node_tree).occluded if node else material.cdrf.chosen_occlusion


def set_occluded(material: bpy.types.Material, value: bool) -> None:
    """Switch Ambient Occlusion.

    Raises:
        SceneError: The material's table was deleted.
    """
    material.cdrf.chosen_occlusion = value
    change_variant(material, occluded=value)


def is_view_dependent(material: bpy.types.Material) -> bool:
    """Return whether the surface depends on the view as path-traced scattering does."""
    node = cdrf_node(material)
    if node is not None:
        return bool(stamped_variant(node.node_tree).walk)
    return bool(material.cdrf.chosen_view == ON)


def set_view_dependent(material: bpy.types.Material, value: bool) -> None:
    """Switch the dependence on the view.

    Raises:
        SceneError: The material is linked, or its table was deleted.
    """
    require_editable(material)
    choose_view(material, value)
    node = cdrf_node(material)
    if node is not None:
        model = stamped_variant(node.node_tree).model
        change_variant(material, walk=walk_for(material, model))


def is_specular(material: bpy.types.Material) -> bool:
    """Return whether the surface has its specular half, or will have it once translucent."""
    if cdrf_node(material) is None:
        return wants_specular(material)
    return specular.has_specular(material)


def wants_specular(material: bpy.types.Material) -> bool:
    """Return what was chosen; without a choice, whether the artist's node is specular."""
    chosen = material.cdrf.chosen_gloss
    return specular.is_worth_keeping(material) if chosen < 0 else bool(chosen)


def set_specular(material: bpy.types.Material, value: bool) -> None:
    """Switch the specular half of the surface."""
    material.cdrf.chosen_gloss = int(value)
    if cdrf_node(material) is None or not material.is_editable:
        return
    if value:
        specular.add_specular(material)
    else:
        specular.remove_specular(material)
