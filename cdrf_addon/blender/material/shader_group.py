# SPDX-License-Identifier: GPL-3.0-or-later
"""Which shader group a translucent material has, and how it gets another."""

from __future__ import annotations

from dataclasses import replace

import bpy

from ... import ids
from ...core.curvature.summary import CONSTANT
from ..shader.group import ensure_shader_group
from ..shader.variant import ShadowChoice, Variant, is_shader_group, stamped_variant, variant_of
from ..world.stamps import stamped_world
from . import linking
from .install import cdrf_node, install
from .shadow_choice import choose_shadows
from .translucent import materials_on
from .walk import keep_free_path, write_free_path, write_mean_curvature

# Roles of the groups that only shader groups use, and of which each material may have its own.
_PARTS = (ids.ROLE_REFLECTANCE, ids.ROLE_WALK, ids.ROLE_HAZE)


def change_variant(
    material: bpy.types.Material,
    *,
    model: str | None = None,
    occluded: bool | None = None,
    shadows: ShadowChoice | None = None,
    walk: str | None = None,
) -> None:
    """Swap a translucent material's shader group where its node or what is given asks for another.

    Args:
        material: Nothing happens if it is not translucent.
        model: Key of another model; None for the present one.
        occluded: Whether it has Ambient Occlusion; None as now.
        shadows: What shadows its lights get; None as now.
        walk: Key of the walk that it shows; None as now.

    Raises:
        SceneError: The material's table was deleted.
    """
    node = cdrf_node(material)
    if node is None:
        return
    now = stamped_variant(node.node_tree)
    wanted = variant_of(
        tuple(node.inputs[ids.SIGMA0_RATIO].default_value),
        now.source,
        now.model if model is None else model,
        mapped=now.mapped,
        occluded=now.occluded if occluded is None else occluded,
        shadows=now.shadows if shadows is None else shadows,
        links=now.links,
        walk=now.walk if walk is None else walk,
    )
    if wanted != now:
        _install(material, node.node_tree, wanted)


def refresh_shadows(material: bpy.types.Material) -> None:
    """Give a translucent material's group shadows, or take them out, as its setting asks."""
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
    lights = linking.lights_of_material(material, scene, layer)
    wanted = replace(wanted, links=linking.links_of(lights))
    # The world's light as it was at the last Update: a slider must not render anything.
    light = stamped_world(group)
    keep_free_path(material)
    install(material, ensure_shader_group(wanted, scene, lights, light))
    write_free_path(material)
    write_mean_curvature(material, _meshes(material))
    linking.write_unlit()


def _meshes(material: bpy.types.Material) -> set[bpy.types.Mesh]:
    """Return the meshes that show a material and have one curvature everywhere."""
    return {
        obj.data
        for obj in bpy.data.objects
        if obj.type == "MESH" and obj.data.cdrf.kind == CONSTANT and material in materials_on(obj)
    }


def _scene(group: bpy.types.ShaderNodeTree) -> bpy.types.Scene | None:
    """Return the scene a shader group was made for; the open one if it is gone."""
    return bpy.data.scenes.get(group.get(ids.SCENE_KEY, "")) or bpy.context.scene


def _view_layer(group: bpy.types.ShaderNodeTree) -> bpy.types.ViewLayer | None:
    scene = _scene(group)
    if scene is None or bpy.context.scene == scene:
        return bpy.context.view_layer
    return scene.view_layers[0]


def remove_unused() -> None:
    """Delete our shader groups that no material uses, and what only they used."""
    groups = bpy.data.node_groups
    for group in list(groups):
        if is_shader_group(group) and group.users == 0 and group.library is None:
            groups.remove(group)
    for group in list(groups):
        role = str(group.get(ids.ROLE_KEY, ""))
        if role.startswith(_PARTS) and group.users == 0 and group.library is None:
            groups.remove(group)
    for image in list(bpy.data.images):
        ours = image.get(ids.ROLE_KEY) == ids.ROLE_LUT and image.library is None
        if ours and image.users == 0:
            bpy.data.images.remove(image)
