# SPDX-License-Identifier: GPL-3.0-or-later
"""The shader groups of a scene: found, made, and rebuilt when their lights or world change.

(variant, scene) -> stamps -> found? -- no --> new, stamped --+
                                |                             +-> build -> stamped, returned
                                yes -> current? -- no --------+
                                          yes -> returned as it is
"""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from ... import ids
from ..lights.scene_lights import SceneLight
from ..nodes.tables import table_of
from ..nodes.tree import rebuild
from ..world.light import WorldLight
from ..world.stamps import is_same, stamp, stamped
from ..world.surface import world_shines
from .build import VERSION, build
from .due import is_current
from .variant import Variant, is_shader_group, stamp_variant, stamped_variant


def ensure_shader_group(
    variant: Variant,
    scene: bpy.types.Scene,
    lights: Sequence[SceneLight],
    world: WorldLight | None = None,
) -> bpy.types.ShaderNodeTree:
    """Return the scene's group of a variant, with exactly these lights and this world.

    Args:
        variant: Which group.
        scene: Whose lights it has.
        lights: All that a material with the group receives.
        world: The world's light; None where it is black.

    Raises:
        SceneError: The model's look-up table was deleted; the text names a remedy.
    """
    group = _find(variant, scene)
    if group is None:
        group = bpy.data.node_groups.new(variant.name, "ShaderNodeTree")
        stamp_variant(group, variant)
        group[ids.SCENE_KEY] = scene.name
        group.color_tag = "SHADER"
        group.description = "Curvature-dependent translucency (Kubo et al. 2011), made by CDRF"
    elif is_current(group, lights) and is_same(stamped(group), world):
        return group
    table = table_of(variant.model)
    rebuild(group, lambda builder: build(builder, variant, lights, world, table))
    stamp(group, world)
    group[ids.SHADOW_WORLD_KEY] = world_shines(scene.world)
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
