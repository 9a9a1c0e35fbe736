# SPDX-License-Identifier: GPL-3.0-or-later
"""The preference that updates the lights of translucent materials by itself.

While it is on, a handler compares the list of lights after every change that may concern it, and a
timer does the rest: handlers must not change data, and not while Blender renders. Undo is left
alone: what it brings back is taken as it is, so that an update can be undone.
"""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty

from .. import ids, paths
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
"""How long to wait for the end of a render, or of another mode than Object Mode."""

_known: dict[int, tuple[object, ...]] = {}
"""Lights of each scene, by its session_uid, when they were compared last."""


def _switched(self: CdrfPreferences, _context: bpy.types.Context) -> None:
    _stop()
    if self.auto_update:
        _start()
        _schedule()


class CdrfPreferences(bpy.types.AddonPreferences):
    """Preferences of the extension, whose package may lie inside another's."""

    bl_idname = paths.EXTENSION

    auto_update: BoolProperty(
        name="Update Lights Automatically",
        description=(
            "When a light is added, deleted or changes its type, give it to the translucent "
            "materials without a click. Meshes and the world still wait for Update"
        ),
        default=False,
        update=_switched,
    )

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw the one choice."""
        self.layout.prop(self, "auto_update")


def _rendering() -> bool:
    return bool(bpy.app.is_job_running("RENDER"))


def _signature(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> tuple[object, ...]:
    lights = scene_lights(scene, layer)
    return tuple(
        (light.name, light.object.session_uid, light.kind, light.casts, light.soft)
        for light in lights
    )


def _concerns_lights(depsgraph: bpy.types.Depsgraph) -> bool:
    """Tell whether an update may have added, removed or retyped a light; a moved one has not."""
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
    """Handler: schedule an update if the list of lights is another; changes nothing itself."""
    if _rendering() or not _concerns_lights(depsgraph):
        return
    layer = scene.view_layers.get(depsgraph.view_layer.name)
    if layer is None:
        return
    now = _signature(scene, layer)
    if _known.get(scene.session_uid) != now:
        _schedule()
    _known[scene.session_uid] = now


@bpy.app.handlers.persistent
def take_as_is(*_args: object) -> None:
    """Handler: undo, redo or another file has replaced the lights and the materials alike."""
    _unschedule()
    _known.clear()
    scene, layer = bpy.context.scene, bpy.context.view_layer
    if scene is not None and layer is not None:
        _known[scene.session_uid] = _signature(scene, layer)


_HANDLERS = (
    ("depsgraph_update_post", watch_lights),
    ("load_post", take_as_is),
    ("undo_post", take_as_is),
    ("redo_post", take_as_is),
)


def update_lights(context: bpy.types.Context) -> int:
    """Give the scene's lights to its translucent materials; return to how many they were new."""
    scene, layer = context.scene, context.view_layer
    lights = lights_of_translucent(scene, layer)
    changed = 0
    for skin in translucent_materials_of(layer):
        node = cdrf_node(skin)
        if node is None or node.node_tree.get(ids.SCENE_KEY) != scene.name:
            continue
        if state.lights_due(node.node_tree, linking.lights_reaching(lights, skin, layer)):
            refresh_lights(skin)
            changed += 1
    return changed


def _tick() -> float | None:
    """Timer: update once Blender is idle in Object Mode."""
    # Each window may show another scene; a Blender without windows has one scene open.
    changed = 0
    for window in list(bpy.context.window_manager.windows) or [None]:
        with bpy.context.temp_override(window=window):
            if _rendering() or bpy.context.mode != "OBJECT":
                return WAIT_SECONDS
            try:
                changed += update_lights(bpy.context)
            except CdrfError:
                continue  # the panel goes on offering Update, which says why it cannot be done
    if changed:
        bpy.ops.ed.undo_push(message="Update Translucent Lights")
    return None


def _schedule() -> None:
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=DELAY_SECONDS)


def _unschedule() -> None:
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)


def _start() -> None:
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def _stop() -> None:
    _unschedule()
    _known.clear()
    for name, handler in _HANDLERS:
        handlers = getattr(bpy.app.handlers, name)
        if handler in handlers:
            handlers.remove(handler)


def register() -> None:
    """Register the preferences, and watch the lights if they ask for it."""
    bpy.utils.register_class(CdrfPreferences)
    addon = bpy.context.preferences.addons.get(CdrfPreferences.bl_idname)
    if addon is not None and addon.preferences is not None and addon.preferences.auto_update:
        _start()


def unregister() -> None:
    """Undo `register`."""
    _stop()
    bpy.utils.unregister_class(CdrfPreferences)
