# SPDX-License-Identifier: GPL-3.0-or-later
"""What is out of date, in words; cheap enough to ask at every redraw of the panel.

A depsgraph handler only notes which meshes were touched; their positions are hashed once after
that, when somebody asks, and never during playback or outside Object Mode.
"""

from __future__ import annotations

import bpy
import numpy as np

from .. import ids
from .lights.scene_lights import SceneLight
from .material import linking
from .material import specular as gloss
from .material.install import cdrf_node, skin_output
from .material.lighting import lights_on_skin, lit_elsewhere
from .material.shadow_choice import choose_shadows
from .mesh.attributes import base_fingerprint, has_curvature, is_measured, linear_part
from .nodes.tables import Table, find_table
from .shader.bits import bits_due
from .shader.due import is_current, layers_due, shadows_due
from .shader.variant import ATTRIBUTE, SCALED, stamped_variant, variant_of
from .shader.wired import wanted_light, wired_lights
from .world.light import clear_captured
from .world.stamps import is_due
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
def forget_worlds(*_args: object) -> None:
    """Handler: another file was loaded."""
    clear_captured()


@bpy.app.handlers.persistent
def forget_all(*_args: object) -> None:
    """Handler: another file was loaded, or undo replaced the data."""
    _touched.clear()
    _changed.clear()


def mark_current(mesh: bpy.types.Mesh) -> None:
    """Take a mesh as up to date: its curvature was just written."""
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


def lights_due(group: bpy.types.ShaderNodeTree, lights: list[SceneLight]) -> str:
    """Say how the scene's lights differ from those the group was made for; empty if they do not."""
    if is_current(group, lights):
        return ""
    wired = wired_lights(group)
    now = {light.source: light for light in lights}
    before = {branch.source: branch for branch in wired if branch.object is not None}
    table = find_table(stamped_variant(group).model)
    if table is None:
        return "the reflectance table was deleted; choose the model again"
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


def _other_lookups(group: bpy.types.ShaderNodeTree, table: Table, light: SceneLight) -> bool:
    wanted = wanted_light(table, stamped_variant(group), light)
    return wanted not in wired_lights(group)


def reasons_to_update(
    item: bpy.types.Object,
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    *,
    playing: bool = False,
) -> list[str]:
    """List what is out of date about a translucent object, a sentence each; empty if nothing is."""
    reasons = []
    lights = lights_on_skin(scene, view_layer)
    for slot in item.material_slots:
        node = cdrf_node(slot.material)
        if node is None:
            continue
        group = node.node_tree
        if not slot.material.is_editable:
            here = linking.reaching(lights, slot.material, view_layer)
            if {one.source for one in wired_lights(group)} != {one.source for one in here}:
                reasons.append(
                    f"'{slot.material.name}' is linked and has the lights of its own file: Make "
                    "Translucent gives a library override of the object a copy lit by this scene."
                )
            continue
        if skin_output(slot.material) is None:
            reasons.append("The CDRF Material Output was deleted.")
        if gloss.is_due(slot.material):
            reasons.append("The Principled node was changed: its gloss is that of before.")
        other = lit_elsewhere(slot.material, scene)
        if other is not None:
            reasons.append(
                f"'{slot.material.name}' has the lights of the scene '{other.name}', where it is "
                "seen too: make it single-user here and update, or press Make Translucent."
            )
            continue
        if group.get(ids.SCENE_KEY) != scene.name:
            reasons.append(f"'{slot.material.name}' was set up in another scene.")
        due = lights_due(group, linking.reaching(lights, slot.material, view_layer))
        if due:
            reasons.append(f"Lights: {due}.")
        elif linking.unlit_is_due(item):
            reasons.append(f"Lights: '{item.name}' receives others now.")
        if not playing and is_due(group, scene_world(scene, view_layer)):
            reasons.append("The world's light was changed.")
        variant = stamped_variant(group)
        if node.inputs[ids.NORMAL].is_linked != variant.mapped:
            done = "taken off" if variant.mapped else "connected to"
            reasons.append(f"A normal map was {done} the CDRF node.")
        ratio = tuple(node.inputs[ids.SIGMA0_RATIO].default_value)
        shadowed = choose_shadows(slot.material, view_layer).cast
        if shadowed and not variant.shadows.cast:
            reasons.append("Shadows: an object that can cast one is new.")
        elif variant.shadows.cast and not shadowed:
            reasons.append("Shadows: nothing casts one any more.")
        wanted = variant_of(
            ratio,
            variant.source,
            variant.model,
            mapped=variant.mapped,
            occluded=variant.occluded,
            shadows=variant.shadows,
            links=variant.links,
        )
        if wanted != variant:
            reasons.append("The colour ratio was changed in the node.")
        if variant.source in {ATTRIBUTE, SCALED} and not has_curvature(item.data):
            reasons.append(f"'{item.name}' has no curvature yet.")
    reasons += _shape_reasons(item, view_layer, playing)
    return list(dict.fromkeys(reasons))


def _shape_reasons(
    item: bpy.types.Object, view_layer: bpy.types.ViewLayer, playing: bool
) -> list[str]:
    known = item.data.cdrf
    if is_measured(item.data) and not item.data.is_editable:
        return []
    if not known.fingerprint:
        return [f"The curvature of '{item.name}' was never computed."]
    if _mesh_changed(item.data, playing):
        return ["The mesh was edited since its curvature was computed."]
    depsgraph = view_layer.depsgraph
    evaluated = item.evaluated_get(depsgraph) if depsgraph is not None and item.modifiers else item
    count = len(evaluated.data.vertices)
    # Only what is on screen is evaluated; a hidden object shows its bare mesh.
    if evaluated.is_evaluated and item.visible_get() and count != known.evaluated_vertices:
        return ["The modifiers were changed since the curvature was computed."]
    linear = linear_part(item)
    then = np.array(known.metric).reshape(3, 3)
    now = linear.T @ linear
    if ids.SCALE_KEY in item:  # the shader sees to the size, not to the proportions
        now *= np.trace(then) / max(np.trace(now), 1e-30)
    if not np.allclose(now, then, rtol=0.0, atol=1e-3 * max(np.trace(now), np.trace(then))):
        return ["The object was scaled since its curvature was computed."]
    return []
