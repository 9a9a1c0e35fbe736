# SPDX-License-Identifier: GPL-3.0-or-later
"""What is out of date about a translucent object, in sentences; cheap enough for every redraw.

A depsgraph handler only notes which meshes were touched. Their positions are hashed once after
that, when the panel asks, and never during playback or outside Object Mode.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import bpy
import numpy as np

from .. import ids
from .lights.scene_lights import SceneLight
from .material import linking, specular
from .material.install import cdrf_node, cdrf_output
from .material.lighting import lights_of_translucent, lit_elsewhere
from .material.shadow_choice import choose_shadows
from .mesh.attributes import has_curvature, has_walk_curvature, is_measured
from .mesh.surface import base_fingerprint, metric_of
from .nodes.tables import Table, find_table
from .shader.bits import bits_due
from .shader.due import is_current, layers_due, shadows_due
from .shader.variant import ATTRIBUTE, SCALED, stamped_variant, variant_of
from .shader.wired import wanted_light, wired_lights
from .world.light import clear_captured_worlds
from .world.stamps import is_world_due
from .world.surface import scene_world

_touched: set[int] = set()
"""session_uid of meshes edited since their hash was last compared."""
_changed: dict[int, bool] = {}
"""Outcome of that comparison."""


@bpy.app.handlers.persistent
def note_touched(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Handler: remember edited meshes; nothing else, as this runs at every update."""
    for update in depsgraph.updates:
        if update.is_updated_geometry and isinstance(update.id, bpy.types.Mesh):
            _touched.add(update.id.original.session_uid)


@bpy.app.handlers.persistent
def clear_world_cache(*_args: object) -> None:
    """Handler: another file was loaded."""
    clear_captured_worlds()


@bpy.app.handlers.persistent
def clear_caches(*_args: object) -> None:
    """Handler: another file was loaded, or undo replaced the data."""
    _touched.clear()
    _changed.clear()


def mark_current(mesh: bpy.types.Mesh) -> None:
    """Mark a mesh as up to date: its curvature was just written."""
    _touched.discard(mesh.session_uid)
    _changed[mesh.session_uid] = False


def _mesh_changed(mesh: bpy.types.Mesh, playing: bool) -> bool:
    uid = mesh.session_uid
    if mesh.is_editmode or playing:
        return _changed.get(uid, False)
    if uid in _touched or uid not in _changed:
        _changed[uid] = base_fingerprint(mesh) != mesh.cdrf.base_fingerprint
        _touched.discard(uid)
    return _changed[uid]


# --- lights -------------------------------------------------------------------------------------


def lights_due(group: bpy.types.ShaderNodeTree, lights: list[SceneLight]) -> str:
    """Describe how lights differ from those a group was made for; empty if they do not."""
    if is_current(group, lights):
        return ""
    table = find_table(stamped_variant(group).model)
    if table is None:
        return "the reflectance table was deleted; choose the model again"
    parts = _other_lights(group, lights)
    if not parts:
        resized = [light.name for light in lights if _other_lookups(group, table, light)]
        parts = [f"light '{name}' got another size" for name in resized]
    if not parts:
        due = (
            layers_due(group, lights),
            shadows_due(group, lights),
            bits_due(group),
        )
        parts = [part for part in due if part]
    return "; ".join(parts) or "the node group is incomplete or of an older version"


def _other_lights(group: bpy.types.ShaderNodeTree, lights: Iterable[SceneLight]) -> list[str]:
    """Name the lights that are new, gone, or of another kind."""
    wired = wired_lights(group)
    now = {light.source: light for light in lights}
    before = {branch.source: branch for branch in wired if branch.object is not None}
    parts = []
    for key, light in now.items():
        if key not in before:
            parts.append(f"light '{light.name}' is new")
        elif before[key].kind != light.kind:
            parts.append(f"light '{light.name}' changed its type")
        elif before[key].selective != light.selective:
            parts.append(f"light '{light.name}' is linked to other objects now")
    gone = len(wired) - len(before) + sum(key not in now for key in before)
    if gone:
        plural = "s are" if gone > 1 else " is"
        parts.append(f"{gone} light{plural} gone or hidden, or linked to other objects now")
    return parts


def _other_lookups(group: bpy.types.ShaderNodeTree, table: Table, light: SceneLight) -> bool:
    wanted = wanted_light(table, stamped_variant(group), light)
    return wanted not in wired_lights(group)


# --- objects ------------------------------------------------------------------------------------


def reasons_to_update(
    obj: bpy.types.Object,
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    *,
    playing: bool = False,
) -> list[str]:
    """List what is out of date about a translucent object, a sentence each; empty if nothing is.

    Args:
        obj: The object.
        scene: The one that is open.
        view_layer: The one that is open.
        playing: Whether an animation is playing, so that only cheap checks are made.
    """
    reasons = []
    lights = lights_of_translucent(scene, view_layer)
    for material in (slot.material for slot in obj.material_slots):
        node = cdrf_node(material)
        if node is None:
            continue
        reaching = linking.lights_reaching(lights, material, view_layer)
        if not material.is_editable:
            reasons += _linked_reasons(material, node, reaching)
            continue
        reasons += _node_reasons(material)
        other = lit_elsewhere(material, scene)
        if other is not None:
            reasons.append(
                f"'{material.name}' has the lights of the scene '{other.name}', where it is "
                "seen too: make it single-user here and update, or press Make Translucent."
            )
            continue
        if node.node_tree.get(ids.SCENE_KEY) != scene.name:
            reasons.append(f"'{material.name}' was set up in another scene.")
        reasons += _light_reasons(obj, node, reaching)
        if not playing and is_world_due(node.node_tree, scene_world(scene, view_layer)):
            reasons.append("The world's light was changed.")
        reasons += _variant_reasons(material, node, view_layer)
        reasons += _attribute_reasons(obj, node)
    reasons += _shape_reasons(obj, view_layer, playing)
    return list(dict.fromkeys(reasons))


def _linked_reasons(
    material: bpy.types.Material, node: bpy.types.ShaderNode, lights: Sequence[SceneLight]
) -> list[str]:
    """Compare the lights of a linked material with those of this scene."""
    wired = {branch.source for branch in wired_lights(node.node_tree)}
    if wired == {light.source for light in lights}:
        return []
    return [
        f"'{material.name}' is linked and has the lights of its own file: Make Translucent gives a "
        "library override of the object a copy lit by this scene."
    ]


def _node_reasons(material: bpy.types.Material) -> list[str]:
    """Check the nodes that we put into a material."""
    reasons = []
    if cdrf_output(material) is None:
        reasons.append("The CDRF Material Output was deleted.")
    if specular.is_outdated(material):
        reasons.append("The Principled BSDF was changed; the gloss is still the former one.")
    return reasons


def _light_reasons(
    obj: bpy.types.Object, node: bpy.types.ShaderNode, lights: list[SceneLight]
) -> list[str]:
    due = lights_due(node.node_tree, lights)
    if due:
        return [f"Lights: {due}."]
    if linking.unlit_is_due(obj):
        return [f"Lights: '{obj.name}' receives others now."]
    return []


def _variant_reasons(
    material: bpy.types.Material,
    node: bpy.types.ShaderNode,
    view_layer: bpy.types.ViewLayer,
) -> list[str]:
    """Check what decides which variant of the shader group a material has."""
    variant = stamped_variant(node.node_tree)
    reasons = []
    if node.inputs[ids.NORMAL].is_linked != variant.mapped:
        done = "taken off" if variant.mapped else "connected to"
        reasons.append(f"A normal map was {done} the CDRF node.")
    shadowed = choose_shadows(material, view_layer).cast
    if shadowed and not variant.shadows.cast:
        reasons.append("Shadows: an object that can cast one is new.")
    elif variant.shadows.cast and not shadowed:
        reasons.append("Shadows: nothing casts one any more.")
    wanted = variant_of(
        tuple(node.inputs[ids.SIGMA0_RATIO].default_value),
        variant.source,
        variant.model,
        mapped=variant.mapped,
        occluded=variant.occluded,
        shadows=variant.shadows,
        links=variant.links,
        walk=variant.walk,
    )
    if wanted != variant:
        reasons.append("The colour ratio was changed in the node.")
    return reasons


def _attribute_reasons(obj: bpy.types.Object, node: bpy.types.ShaderNode) -> list[str]:
    variant = stamped_variant(node.node_tree)
    if variant.source not in {ATTRIBUTE, SCALED}:
        return []
    if not has_curvature(obj.data):
        return [f"'{obj.name}' has no curvature yet."]
    if not variant.walk or has_walk_curvature(obj.data):
        return []
    if obj.data.is_editable:
        return [f"'{obj.name}' has not yet the curvature that View Dependence needs."]
    return [
        f"The mesh of '{obj.name}' is linked from a file without the curvature that View "
        "Dependence needs: press Update there."
    ]


def _shape_reasons(
    obj: bpy.types.Object, view_layer: bpy.types.ViewLayer, playing: bool
) -> list[str]:
    """Check the mesh, its modifiers and the object's scale."""
    known = obj.data.cdrf
    if is_measured(obj.data) and not obj.data.is_editable:
        return []
    if not known.fingerprint:
        return [f"The curvature of '{obj.name}' was never computed."]
    if _mesh_changed(obj.data, playing):
        return ["The mesh was edited since its curvature was computed."]
    depsgraph = view_layer.depsgraph
    evaluated = obj.evaluated_get(depsgraph) if depsgraph is not None and obj.modifiers else obj
    count = len(evaluated.data.vertices)
    # Only what is on screen is evaluated; a hidden object shows its bare mesh.
    if evaluated.is_evaluated and obj.visible_get() and count != known.evaluated_vertices:
        return ["The modifiers were changed since the curvature was computed."]
    then = np.array(known.metric).reshape(3, 3)
    now = metric_of(obj)
    if ids.SCALE_KEY in obj:  # the shader corrects the size, but not the proportions
        now *= np.trace(then) / max(np.trace(now), 1e-30)
    if not np.allclose(now, then, rtol=0.0, atol=1e-3 * max(np.trace(now), np.trace(then))):
        return ["The object was scaled since its curvature was computed."]
    return []
