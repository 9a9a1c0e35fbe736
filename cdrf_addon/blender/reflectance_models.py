# SPDX-License-Identifier: GPL-3.0-or-later
"""Which model of reflectance a material has, and how it gets another.

A translucent material's model is stamped on its shader group; one that is not translucent yet
remembers the choice in `material.cdrf`. A profile's or measurement's table lies in the file, so it
renders without what it was made from.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy

from .. import ids
from ..core.errors import ParameterError, SceneError
from ..core.models import (
    DEFAULT_KIND,
    MEASURED,
    PROFILE,
    RING,
    Model,
    parse_profile,
    profile,
    ring,
    sphere,
)
from ..core.presets import Preset, in_units
from ..core.scattering import sigma0_per_radius
from . import shader
from .image import ensure_table, find_table, table_of
from .lights import SceneLight, scene_lights
from .materials import cdrf_node, install, require_editable
from .read_material import Scattering
from .shadows import Choice, choose


def model_key(material: bpy.types.Material) -> str:
    """Key of the model that a material has, or will have once it is translucent."""
    node = cdrf_node(material)
    if node is not None:
        return shader.stamped_variant(node.node_tree).model
    return material.cdrf.chosen_model or DEFAULT_KIND


def kind_of_model(material: bpy.types.Material) -> str:
    """RING, SPHERE, PROFILE or MEASURED."""
    return model_key(material).split()[0]


def model_of_kind(material: bpy.types.Material, kind: str) -> Model | None:
    """Make the model of a kind with the material's own settings; None for a measured one."""
    settings = material.cdrf
    if kind == MEASURED:
        return None
    if kind == PROFILE:
        return profile(parse_profile(settings.profile, settings.profile_base))
    return ring() if kind == RING else sphere()


def profile_problem(material: bpy.types.Material) -> str:
    """Say what is wrong with the text of a material's profile; empty if nothing is."""
    try:
        parse_profile(material.cdrf.profile)
    except ParameterError as error:
        return str(error)
    return ""


def set_kind(material: bpy.types.Material, kind: str) -> None:
    """Give a material another kind of model.

    Raises:
        ParameterError: The profile is not a list of Gaussians.
        SceneError: The material is linked, or was never measured.
    """
    require_editable(material)
    model = model_of_kind(material, kind)
    if model is not None:
        set_model(material, ensure_table(model).key)
        return
    if find_table(material.cdrf.measured) is None:
        raise SceneError(
            f"'{material.name}' has not been measured in this file: press Measure first."
        )
    set_model(material, material.cdrf.measured)


def set_model(material: bpy.types.Material, key: str) -> None:
    """Give a material the model with that key, whose table the file holds.

    A model with colour has the ratio of the channels in its table: the material's own becomes 1,
    and is that of the table when it is left again.
    """
    before, after = table_of(ensure_chosen(material)), table_of(key)
    settings = material.cdrf
    settings.chosen_model = key
    ratio = tuple(settings.sigma0_ratio)
    if after.colour and not before.colour:
        settings.sigma0 *= max(ratio)
        ratio = (1.0, 1.0, 1.0)
    elif before.colour and not after.colour:
        ratio = tuple(r * math.sqrt(m) for r, m in zip(ratio, before.moments, strict=True))
    change_variant(material, ratio, key)
    settings.sigma0_ratio = ratio


def has_colour(material: bpy.types.Material) -> bool:
    """Tell whether the material's model has a table of its own for each channel."""
    return table_of(ensure_chosen(material)).colour


def set_scattering(material: bpy.types.Material, found: Scattering) -> None:
    """Take the scatter distances from what a Principled or Subsurface node says."""
    factors = sigma0_per_radius(found.albedo, found.method)
    sigma0 = [radius * float(factor) for radius, factor in zip(found.radius, factors, strict=True)]
    largest = max(sigma0)
    material.cdrf.sigma0 = largest
    material.cdrf.sigma0_ratio = [value / largest for value in sigma0]


def metres_of(scene: bpy.types.Scene) -> float:
    """Metres in a unit of the scene; 1 where it has no units, as elsewhere in Blender."""
    units = scene.unit_settings
    return 1.0 if units.system == "NONE" else float(units.scale_length)


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
    set_kind(material, preset.model)
    material.cdrf.sigma0 = sigma0
    # A profile has its channels' widths in its table.
    material.cdrf.sigma0_ratio = (1.0, 1.0, 1.0) if preset.model == PROFILE else ratio


def ensure_chosen(material: bpy.types.Material) -> str:
    """Return the key of the material's model, its table made anew if it was deleted.

    A measured table cannot be made at once: without it the default model stands in.
    """
    key = model_key(material)
    if find_table(key) is None:
        model = model_of_kind(material, key.split()[0])
        key = ensure_table(model if model is not None else sphere()).key
        material.cdrf.chosen_model = key
    return key


def change_variant(
    material: bpy.types.Material,
    ratio: Sequence[float] | None = None,
    model: str | None = None,
    shadows: Choice | None = None,
) -> None:
    """Swap a translucent material's shader group for one of another ratio, model or shadows."""
    node = cdrf_node(material)
    if node is None:
        return
    now = shader.stamped_variant(node.node_tree)
    channels = node.inputs[ids.SIGMA0_RATIO].default_value if ratio is None else ratio
    where = scene_of_group(node.node_tree)
    wanted = shader.variant_of(
        tuple(channels),
        now.source,
        now.model if model is None else model,
        shadows=now.shadows if shadows is None else shadows,
    )
    if wanted != now and where is not None:
        install(material, shader.ensure_shader_group(wanted, *where))


def refresh_shadows(material: bpy.types.Material) -> None:
    """Give a translucent material's group shadows, or take them out, as its setting says."""
    node = cdrf_node(material)
    if node is None or not material.is_editable:
        return
    layer = _view_layer(node.node_tree)
    if layer is not None:
        change_variant(material, shadows=choose(material, layer))


def _view_layer(group: bpy.types.ShaderNodeTree) -> bpy.types.ViewLayer | None:
    scene = bpy.data.scenes.get(group.get(ids.SCENE_KEY, "")) or bpy.context.scene
    if scene is None or bpy.context.scene == scene:
        return bpy.context.view_layer
    return scene.view_layers[0]


def scene_of_group(
    group: bpy.types.ShaderNodeTree,
) -> tuple[bpy.types.Scene, list[SceneLight]] | None:
    """Return the scene a shader group was made for and its lights; the open one if it is gone."""
    scene = bpy.data.scenes.get(group.get(ids.SCENE_KEY, "")) or bpy.context.scene
    if scene is None:
        return None
    return scene, scene_lights(scene, _view_layer(group))
