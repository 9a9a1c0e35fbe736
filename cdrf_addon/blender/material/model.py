# SPDX-License-Identifier: GPL-3.0-or-later
"""Which model of reflectance a material has, and how it gets another.

A translucent material's model is stamped on its shader group; one that is not translucent yet
remembers the choice in `material.cdrf`. A profile's or measurement's table lies in the file, so it
renders without what it was made from.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import bpy

from ... import ids
from ...compat import animation_curves, walk_method
from ...core.errors import ParameterError, SceneError
from ...core.reflectance.detail import DETAIL_PER_SIGMA0
from ...core.reflectance.model import (
    DEFAULT_KIND,
    MEASURED,
    PROFILE,
    RING,
    SPHERE,
    Model,
    ring,
    sphere,
)
from ...core.reflectance.profile import SKIN_PROFILE, parse_profile, profile
from ...core.scattering.node_radius import sigma0_per_radius
from ...core.scattering.presets import Preset, in_units
from ..nodes.tables import ensure_table, find_table, table_of
from ..shader.group import ensure_shader_group
from ..shader.variant import (
    ShadowChoice,
    Variant,
    is_shader_group,
    stamped_variant,
    variant_of,
)
from ..world.stamps import stamped
from . import linking
from .install import cdrf_node, install, require_editable
from .scattering import Scattering
from .shadow_choice import choose_shadows


def model_key(material: bpy.types.Material) -> str:
    """Key of the model that a material has, or will have once it is translucent."""
    node = cdrf_node(material)
    if node is not None:
        return stamped_variant(node.node_tree).model
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
    before, after = find_table(model_key(material)), table_of(key)
    settings = material.cdrf
    settings.chosen_model = key
    ratio = tuple(settings.sigma0_ratio)
    if before is not None and after.colour and not before.colour:
        if max(ratio) > 0.0:
            settings.sigma0 *= max(ratio)
        ratio = (1.0, 1.0, 1.0)
    elif before is not None and before.colour and not after.colour:
        ratio = tuple(r * math.sqrt(m) for r, m in zip(ratio, before.moments, strict=True))
    change_variant(material, ratio, key)
    settings.sigma0_ratio = ratio
    remove_unused()


def remove_unused() -> None:
    """Delete our shader groups that no material uses, and what only they used."""
    groups = bpy.data.node_groups
    for group in list(groups):
        if is_shader_group(group) and group.users == 0 and group.library is None:
            groups.remove(group)
    for group in list(groups):
        role = str(group.get(ids.ROLE_KEY, ""))
        if role.startswith(ids.ROLE_REFLECTANCE) and group.users == 0 and group.library is None:
            groups.remove(group)
    for image in list(bpy.data.images):
        ours = image.get(ids.ROLE_KEY) == ids.ROLE_LUT and image.library is None
        if ours and image.users == 0:
            bpy.data.images.remove(image)


def overridden(material: bpy.types.Material) -> str:
    """Say what decides the scatter distance in place of its value; empty if nothing does."""
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


def has_colour(material: bpy.types.Material) -> bool:
    """Tell whether the material's model has a table of its own for each channel."""
    return kind_of_model(material) in {PROFILE, MEASURED}


def set_scattering(material: bpy.types.Material, found: Scattering) -> None:
    """Take the scatter distances from what a Principled or Subsurface node says."""
    factors = sigma0_per_radius(found.albedo, walk_method(found.method))
    sigma0 = [radius * float(factor) for radius, factor in zip(found.radius, factors, strict=True)]
    set_channel_sigma0(material, sigma0)


def channel_sigma0(material: bpy.types.Material) -> list[float]:
    """Scatter distance of red, green and blue, whatever model the material has."""
    moments = table_of(ensure_chosen(material)[0]).moments
    settings = material.cdrf
    return [
        settings.sigma0 * ratio * math.sqrt(moment)
        for ratio, moment in zip(settings.sigma0_ratio, moments, strict=True)
    ]


def set_channel_sigma0(material: bpy.types.Material, sigma0: Sequence[float]) -> None:
    """Set the scatter distance of each channel, for a model without colour."""
    largest = max(sigma0)
    material.cdrf.sigma0 = largest
    material.cdrf.sigma0_ratio = [value / largest if largest > 0.0 else 1.0 for value in sigma0]


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
    if preset.model == PROFILE:
        require_editable(material)
        material.cdrf.profile = SKIN_PROFILE.to_text()
        material.cdrf.profile_base = SPHERE
        set_kind(material, PROFILE)
        ratio = (1.0, 1.0, 1.0)  # a profile has its channels' widths in its table
    elif has_colour(material):
        set_kind(material, DEFAULT_KIND)
    material.cdrf.sigma0 = sigma0
    material.cdrf.sigma0_ratio = ratio
    choose_detail(material)


def choose_detail(material: bpy.types.Material) -> None:
    """Take the detail of the material's normal map as fine as its scatter distance asks for."""
    node = cdrf_node(material)
    if node is not None and ids.DETAIL_SIZE in node.inputs:
        largest = material.cdrf.sigma0 * max(material.cdrf.sigma0_ratio)
        node.inputs[ids.DETAIL_SIZE].default_value = DETAIL_PER_SIGMA0 * largest


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
    return key, (
        f"The {what} of '{material.name}' was deleted; it is shaded by the sphere model now: "
        f"{'press Measure again' if kind == MEASURED else 'mend the profile and choose it again'}."
    )


def change_variant(
    material: bpy.types.Material,
    ratio: Sequence[float] | None = None,
    model: str | None = None,
    occluded: bool | None = None,
    shadows: ShadowChoice | None = None,
) -> None:
    """Swap a translucent material's shader group for another ratio, model, occlusion or shadows."""
    node = cdrf_node(material)
    if node is None:
        return
    now = stamped_variant(node.node_tree)
    channels = node.inputs[ids.SIGMA0_RATIO].default_value if ratio is None else ratio
    wanted = variant_of(
        tuple(channels),
        now.source,
        now.model if model is None else model,
        mapped=now.mapped,
        occluded=now.occluded if occluded is None else occluded,
        shadows=now.shadows if shadows is None else shadows,
        links=now.links,
    )
    if wanted != now:
        _install(material, node.node_tree, wanted)


def refresh_shadows(material: bpy.types.Material) -> None:
    """Give a translucent material's group shadows, or take them out, as its setting says."""
    node = cdrf_node(material)
    if node is None or not material.is_editable:
        return
    layer = _view_layer(node.node_tree)
    if layer is not None:
        change_variant(material, shadows=choose_shadows(material, layer))


def refresh_lights(material: bpy.types.Material) -> None:
    """Give a translucent material's group the lights that its scene has now."""
    node = cdrf_node(material)
    if node is not None and material.is_editable:
        _install(material, node.node_tree, stamped_variant(node.node_tree))


def _install(
    material: bpy.types.Material, group: bpy.types.ShaderNodeTree, wanted: Variant
) -> None:
    """Put the variant of a group, with the lights that its scene has now, in the group's place."""
    scene, layer = _scene(group), _view_layer(group)
    if scene is None or layer is None:
        return
    lights = linking.material_lights(material, scene, layer)
    wanted = replace(wanted, links=linking.links_of(lights))
    # The world's light as it was at the last Update: a slider must not render anything.
    light = stamped(group)
    install(material, ensure_shader_group(wanted, scene, lights, light))
    linking.write_unlit()


def _scene(group: bpy.types.ShaderNodeTree) -> bpy.types.Scene | None:
    """Return the scene a shader group was made for; the open one if it is gone."""
    return bpy.data.scenes.get(group.get(ids.SCENE_KEY, "")) or bpy.context.scene


def _view_layer(group: bpy.types.ShaderNodeTree) -> bpy.types.ViewLayer | None:
    scene = _scene(group)
    if scene is None or bpy.context.scene == scene:
        return bpy.context.view_layer
    return scene.view_layers[0]
