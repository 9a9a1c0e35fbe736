# SPDX-License-Identifier: GPL-3.0-or-later
"""Which random walk under its surface a material shows, and how long its mean free path is.

What was read from the artist's node or from a preset is remembered in `material.cdrf.chosen_walk`
and `chosen_free_path`; the node's Free Path input holds the latter while it is translucent.
"""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from ... import ids
from ...core.reflectance.model import SPHERE
from ...core.walk.material import DEFAULT_WALK, MaterialWalk, free_path_ratio
from .install import cdrf_node

UNSET, OFF, ON = -1, 0, 1
"""Values of `chosen_view`."""


def store_walk(material: bpy.types.Material, walk: MaterialWalk, albedo: Sequence[float]) -> None:
    """Remember the walk that a material stands for, and show it.

    Args:
        material: Whose model may show it or not.
        walk: Method, roughness, index and anisotropy.
        albedo: Of red, green and blue, which decides the mean free path.
    """
    settings = material.cdrf
    settings.chosen_view = ON
    settings.chosen_walk = walk.key
    settings.chosen_free_path = free_path_ratio(albedo, walk)


def walk_for(material: bpy.types.Material, model: str) -> str:
    """Return the key of the walk that a material shows with a model; empty for none.

    Only the sphere model has it: the paper's ring stays as it is in the paper, and a profile or a
    measurement has its own way of bringing light out.
    """
    settings = material.cdrf
    if model != SPHERE or settings.chosen_view != ON:
        return ""
    return settings.chosen_walk or DEFAULT_WALK.key


def write_free_path(material: bpy.types.Material) -> None:
    """Give the node, if it has a walk, the mean free path over the scatter distance."""
    node = cdrf_node(material)
    if node is None or ids.FREE_PATH not in node.inputs:
        return
    ratio = tuple(material.cdrf.chosen_free_path)
    if not any(ratio):
        ratio = free_path_ratio(node.inputs[ids.BASE_COLOR].default_value[:3], DEFAULT_WALK)
    node.inputs[ids.FREE_PATH].default_value = ratio
