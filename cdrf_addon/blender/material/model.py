# SPDX-License-Identifier: GPL-3.0-or-later
"""Which model of reflectance a material has, and how it gets another.

A translucent material's model is stamped on its shader group; one that is not translucent yet
remembers the choice in `material.cdrf`. A profile's or measurement's table lies in the file, so it
renders without what it was made from.
"""

from __future__ import annotations

import math

import bpy

from ...core.errors import ParameterError, SceneError
from ...core.reflectance.model import DEFAULT_KIND, MEASURED, PROFILE, RING, Model, ring, sphere
from ...core.reflectance.profile import parse_profile, profile
from ..nodes.tables import ensure_table, find_table, table_of
from ..shader.variant import stamped_variant
from . import settings
from .install import cdrf_node, require_editable
from .shader_group import change_variant, remove_unused
from .walk import choose_view, walk_for


def model_key(material: bpy.types.Material) -> str:
    """Return the key of the model that a material has, or will have once it is translucent."""
    node = cdrf_node(material)
    if node is not None:
        return stamped_variant(node.node_tree).model
    return material.cdrf.chosen_model or DEFAULT_KIND


def kind_of_model(material: bpy.types.Material) -> str:
    """Return RING, SPHERE, PROFILE or MEASURED."""
    return model_key(material).split()[0]


def has_colour(material: bpy.types.Material) -> bool:
    """Return whether the material's model has a table of its own for each channel."""
    return kind_of_model(material) in {PROFILE, MEASURED}


def model_of_kind(material: bpy.types.Material, kind: str) -> Model | None:
    """Make the model of a kind with the material's own settings; None for a measured one."""
    if kind == MEASURED:
        return None
    if kind == PROFILE:
        return profile(parse_profile(material.cdrf.profile, material.cdrf.profile_base))
    return ring() if kind == RING else sphere()


def profile_problem(material: bpy.types.Material) -> str:
    """Describe what is wrong with the text of a material's profile; empty if nothing is."""
    try:
        parse_profile(material.cdrf.profile)
    except ParameterError as error:
        return str(error)
    return ""


def set_kind(
    material: bpy.types.Material, kind: str, *, view_dependent: bool | None = None
) -> None:
    """Give a material another kind of model.

    Args:
        material: Any.
        kind: RING, SPHERE, PROFILE or MEASURED.
        view_dependent: Whether it depends on the view with the sphere model; None as now.

    Raises:
        ParameterError: The profile is not a list of Gaussians.
        SceneError: The material is linked, or was never measured.
    """
    require_editable(material)
    model = model_of_kind(material, kind)
    if view_dependent is not None:
        choose_view(material, view_dependent)
    if model is not None:
        set_model(material, ensure_table(model).key)
        return
    if find_table(material.cdrf.measured) is None:
        raise SceneError(
            f"'{material.name}' has not been measured in this file: choose Path-Traced Look, or "
            "measure it with bpy.ops.cdrf.measure() first."
        )
    set_model(material, material.cdrf.measured)


def set_model(material: bpy.types.Material, key: str) -> None:
    """Give a material the model with that key, whose table the file holds.

    A model with colour has the ratio of the channels in its table: the material's own becomes 1,
    and is that of the table when it is left again.

    Raises:
        SceneError: The file holds no such table.
    """
    before, after = find_table(model_key(material)), table_of(key)
    material.cdrf.chosen_model = key
    ratio = settings.sigma0_ratio(material)
    if before is not None and after.colour and not before.colour:
        if max(ratio) > 0.0:
            settings.set_sigma0(material, settings.sigma0(material) * max(ratio))
        ratio = (1.0, 1.0, 1.0)
    elif before is not None and before.colour and not after.colour:
        red, green, blue = (r * math.sqrt(m) for r, m in zip(ratio, before.moments, strict=True))
        ratio = (red, green, blue)
    settings.store_sigma0_ratio(material, ratio)
    change_variant(material, model=key, walk=walk_for(material, key))
    remove_unused()


def ensure_chosen(material: bpy.types.Material) -> tuple[str, str]:
    """Make the material's table anew if it was deleted.

    A measured table cannot be made at once, and a profile only of a list of Gaussians: without them
    the default model stands in.

    Returns:
        The key of the model, and a sentence if it is not the one that was chosen.
    """
    key = model_key(material)
    if find_table(key) is not None:
        return key, ""
    kind = key.split()[0]
    try:
        model = model_of_kind(material, kind)
    except ParameterError:
        model = None
    if model is not None:
        key = ensure_table(model).key
        material.cdrf.chosen_model = key
        return key, ""
    key = ensure_table(sphere()).key
    material.cdrf.chosen_model = key
    what = "measured table" if kind == MEASURED else "profile's table"
    remedy = "measure it again with bpy.ops.cdrf.measure()"
    if kind == PROFILE:
        remedy = "mend the profile and choose it again"
    return key, (
        f"The {what} of '{material.name}' was deleted, so it has the Path-Traced Look now: "
        f"{remedy} to have it back."
    )
