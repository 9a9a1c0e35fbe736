# SPDX-License-Identifier: GPL-3.0-or-later
"""Automatic updates of the lights of translucent materials, while the preference is on.

A handler compares the list of lights after every change that may concern it. If the list differs, a
timer updates the materials: handlers must not change data, and nothing may while Blender renders.
After undo, redo and loading, the lights of then become the baseline, so that an update can be
undone.
"""

from __future__ import annotations

import bpy

from .. import ids
from ..blender import state
from ..blender.lights.scene_lights import scene_lights
from ..blender.material import linking
from ..blender.material.install import cdrf_node
from ..blender.material.lighting import lights_of_translucent
from ..blender.material.shader_group import refresh_lights
from ..blender.material.translucent import translucent_materials_of
from ..core.errors import CdrfError

DELAY_SECONDS = 0.2
WAIT_SECONDS = 1.0
"""Time between looks whether a render has ended, and whether Blender is in Object Mode again."""

_baseline: dict[int, tuple[object, ...]] = {}
"""Lights of each scene, by its session_uid, when they were last compared."""


def _rendering() -> bool:
    return bool(bpy.app.is_job_running("RENDER"))


def _signature(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> tuple[object, ...]:
    lights = scene_lights(scene, layer)
    return tuple(
        (light.name, light.object.session_uid, light.kind, light.casts, light.soft)
        for light in lights
    )


def _concerns_lights(depsgraph: bpy.types.Depsgraph) -> bool:
    """Whether an update may have added, removed or retyped a light, not only moved one."""
    return any(
        isinstance(update.id, bpy.types.Scene | bpy.types.Collection | bpy.types.Light)
        or (
            isinstance(update.id, bpy.types.Object)
            and update.id.type == "LIGHT"
            and not update.is_updated_transform
        )
        for update in depsgraph.updates
    )


@bpy.app.handlers.persistent
def watch_lights(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Handler: schedule an update if the list of lights has changed; change nothing here."""
    if _rendering() or not _concerns_lights(depsgraph):
        return
    layer = scene.view_layers.get(depsgraph.view_layer.name)
    if layer is None:
        return
    now = _signature(scene, layer)
    if _baseline.get(scene.session_uid) != now:
        schedule()
    _baseline[scene.session_uid] = now


@bpy.app.handlers.persistent
def reset_baseline(*_args: object) -> None:
    """Handler: undo, redo or loading has replaced both the lights and the materials."""
    _unschedule()
    _baseline.clear()
    scene, layer = bpy.context.scene, bpy.context.view_layer
    if scene is not None and layer is not None:
        _baseline[scene.session_uid] = _signature(scene, layer)


_HANDLERS = (
    ("depsgraph_update_post", watch_lights),
    ("load_post", reset_baseline),
    ("undo_post", reset_baseline),
    ("redo_post", reset_baseline),
)


def update_lights(context: bpy.types.Context) -> int:
    """Give the scene's lights to its translucent materials; return how many materials changed."""
    scene, layer = context.scene, context.view_layer
    lights = lights_of_translucent(scene, layer)
    changed = 0
    for material in translucent_materials_of(layer):
        node = cdrf_node(material)
        if node is None or node.node_tree.get(ids.SCENE_KEY) != scene.name:
            continue
        if state.lights_due(node.node_tree, linking.lights_reaching(lights, material, layer)):
            refresh_lights(material)
            changed += 1
    return changed


def _tick() -> float | None:
    """Timer: update the lights of every window's scene once Blender is idle in Object Mode."""
    # Each window may show another scene; a Blender without windows has one scene open.
    changed = 0
    for window in list(bpy.context.window_manager.windows) or [None]:
        with bpy.context.temp_override(window=window):
            if _rendering() or bpy.context.mode != "OBJECT":
                return WAIT_SECONDS
            try:
                changed += update_lights(bpy.context)
            except CdrfError:
                continue  # the panel still offers Update, which reports the reason
    if changed:
        bpy.ops.ed.undo_push(message="Update Translucent Lights")
    return None


def schedule() -> None:
    """Update the lights soon."""
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=DELAY_SECONDS)


def _unschedule() -> None:
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)


def start() -> None:
    """Watch the lights from now on."""
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def stop() -> None:
    """Stop watching, and drop an update that is scheduled."""
    _unschedule()
    _baseline.clear()
    for name, handler in _HANDLERS:
        handlers = getattr(bpy.app.handlers, name)
        if handler in handlers:
            handlers.remove(handler)
