# SPDX-License-Identifier: GPL-3.0-or-later
"""Which random walk under its surface a material shows, and how long its mean free path is.

What was read from the artist's node or from a preset is remembered in `material.cdrf.chosen_walk`
and `chosen_free_path`; the node's Free Path input holds the latter while it is translucent.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import bpy

from ... import ids
from ...core.reflectance.model import SPHERE
from ...core.walk.material import DEFAULT_WALK, MaterialWalk, free_path_ratio
from .install import cdrf_node
from .scattering import read_scattering

UNSET, OFF, ON = -1, 0, 1
"""Values of `chosen_view`."""


def store_walk(material: bpy.types.Material, walk: MaterialWalk, albedo: Sequence[float]) -> None:
    """Remember the walk that a material stands for, and show it.

    Christensen and Burley's method has none: it stays off, and its colours walk as by default once
    it is switched on.

    Args:
        material: Whose model may show it or not.
        walk: Method, roughness, index and anisotropy.
        albedo: Of red, green and blue, which decides the mean free path.
    """
    settings = material.cdrf
    settings.chosen_view = ON if walk.key else OFF
    settings.chosen_walk = walk.key
    settings.chosen_free_path = free_path_ratio(albedo, walk if walk.key else DEFAULT_WALK)
    write_free_path(material)


def choose_view(material: bpy.types.Material, value: bool) -> None:
    """Remember whether a material depends on the view; the first time also by which walk.

    Files of older versions know none yet: it is that of the artist's own node, where one scatters,
    else the default.
    """
    settings = material.cdrf
    if value and not any(settings.chosen_free_path):
        found = read_scattering(material)
        if found is not None:
            store_walk(material, found.walk, found.albedo)
        else:
            store_walk(material, DEFAULT_WALK, _base_colour(material))
    settings.chosen_view = ON if value else OFF


def _base_colour(material: bpy.types.Material) -> Sequence[float]:
    node = cdrf_node(material)
    source = material.diffuse_color if node is None else node.inputs[ids.BASE_COLOR].default_value
    red, green, blue, _ = source
    return red, green, blue


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
    if node is not None and ids.FREE_PATH in node.inputs:
        node.inputs[ids.FREE_PATH].default_value = material.cdrf.chosen_free_path


def keep_free_path(material: bpy.types.Material) -> None:
    """Remember what the artist made of it in the node, which may be about to lose it."""
    node = cdrf_node(material)
    if node is not None and ids.FREE_PATH in node.inputs:
        material.cdrf.chosen_free_path = node.inputs[ids.FREE_PATH].default_value


def rescale_free_path(
    material: bpy.types.Material, before: Sequence[float], after: Sequence[float]
) -> None:
    """Keep the mean free path where the scatter distance of each colour is replaced."""
    keep_free_path(material)
    ratio = zip(material.cdrf.chosen_free_path, before, after, strict=True)
    material.cdrf.chosen_free_path = [
        path * old / new if new > 0.0 else path for path, old, new in ratio
    ]
    write_free_path(material)


def write_mean_curvature(material: bpy.types.Material, meshes: Iterable[bpy.types.Mesh]) -> None:
    """Give the node, if it asks for one, the mean curvature of meshes that have one everywhere."""
    node = cdrf_node(material)
    if node is None or ids.MEAN not in node.inputs:
        return
    means = [mesh.cdrf.mean_values[3] for mesh in meshes]
    if means:
        node.inputs[ids.MEAN].default_value = math.fsum(means) / len(means)
