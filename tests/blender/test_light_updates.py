# SPDX-License-Identifier: GPL-3.0-or-later
"""The preference that updates lights automatically: off, on, undone, and gone."""

from __future__ import annotations

from collections.abc import Iterator

import bpy
import pytest
from rig import Rig

from cdrf_addon import ids
from cdrf_addon.blender.material.install import cdrf_node
from cdrf_addon.ui import light_updates, preferences


def own_preferences() -> bpy.types.AddonPreferences:
    return bpy.context.preferences.addons["cdrf_addon"].preferences


@pytest.fixture
def switch(rig: Rig) -> Iterator[bpy.types.AddonPreferences]:
    """The preferences, and a translucent ball under one sun."""
    rig.light("SUN", name="Key")
    rig.sphere().name = "Ball"
    bpy.context.view_layer.update()
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="set up")
    assert not own_preferences().auto_update, "off until asked for"
    yield own_preferences()
    own_preferences().auto_update = False


def wired() -> set[str]:
    node = cdrf_node(bpy.data.objects["Ball"].data.materials[0])
    assert node is not None
    return {n[ids.LIGHT_KEY] for n in node.node_tree.nodes if ids.LIGHT_KEY in n}


def pending() -> bool:
    return bool(bpy.app.timers.is_registered(light_updates._tick))


def settle() -> None:
    """What the event loop, which a background Blender lacks, would do next."""
    bpy.context.view_layer.update()
    if pending():
        bpy.app.timers.unregister(light_updates._tick)
        assert light_updates._tick() is None


def watching() -> int:
    names = ("depsgraph_update_post", "load_post", "undo_post", "redo_post")
    return sum(
        handler.__module__ == light_updates.__name__
        for name in names
        for handler in getattr(bpy.app.handlers, name)
    )


@pytest.mark.smoke
def test_added_retyped_and_deleted_lights_come_and_go(rig: Rig, switch) -> None:
    fill = rig.light("POINT", name="Fill")
    settle()
    assert wired() == {"SUN"} and watching() == 0, "off, nothing runs"
    switch.auto_update = True
    settle()
    assert wired() == {"SUN", "POINT"} and watching() == 4
    fill.data.type = "SPOT"
    settle()
    assert wired() == {"SUN", "SPOT"}
    fill.location.x += 1.0
    bpy.context.view_layer.update()
    assert not pending(), "drivers follow that"
    fill.hide_render = True
    settle()
    assert wired() == {"SUN"}
    fill.hide_render = False
    settle()
    assert wired() == {"SUN", "SPOT"}
    bpy.data.objects.remove(fill)
    settle()
    assert wired() == {"SUN"}
    switch.auto_update = False
    rig.light("AREA")
    settle()
    assert wired() == {"SUN"} and watching() == 0


def test_an_update_can_be_undone(rig: Rig, switch) -> None:
    switch.auto_update = True
    settle()
    rig.light("POINT", name="Fill")
    bpy.ops.ed.undo_push(message="add light")
    settle()
    assert wired() == {"SUN", "POINT"}
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    assert wired() == {"SUN"} and "Fill" in bpy.data.objects
    assert not pending(), "or undo would never get any further"
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    assert "Fill" not in bpy.data.objects and not pending()
    bpy.ops.ed.redo()
    bpy.ops.ed.redo()
    assert wired() == {"SUN", "POINT"}


def test_it_waits_for_object_mode_and_for_renders(rig: Rig, switch, monkeypatch) -> None:
    switch.auto_update = True
    settle()
    rig.light("POINT")
    bpy.context.view_layer.objects.active = bpy.data.objects["Ball"]
    bpy.ops.object.mode_set(mode="EDIT")
    assert pending() and light_updates._tick() == light_updates.WAIT_SECONDS
    bpy.ops.object.mode_set(mode="OBJECT")
    with monkeypatch.context() as patch:
        patch.setattr(light_updates, "_rendering", lambda: True)
        assert light_updates._tick() == light_updates.WAIT_SECONDS
        assert wired() == {"SUN"}
    settle()
    assert wired() == {"SUN", "POINT"}


def test_unregistering_leaves_nothing_behind(rig: Rig, switch) -> None:
    switch.auto_update = True
    rig.light("POINT")
    bpy.context.view_layer.update()
    assert pending() and watching() == 4
    preferences.unregister()
    try:
        assert not pending() and watching() == 0
    finally:
        preferences.register()
    assert watching() == 4, "the preference was on"


def test_a_light_that_is_only_moved_is_not_compared(
    rig: Rig, switch, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Listing the lights of a large scene at every step of a drag would be felt."""
    lamp = rig.light("POINT")
    switch.auto_update = True
    settle()
    listed: list[str] = []
    signature = light_updates._signature

    def note(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> tuple[object, ...]:
        listed.append(scene.name)
        return signature(scene, layer)

    monkeypatch.setattr(light_updates, "_signature", note)
    for _ in range(20):
        lamp.location.x += 0.1
        bpy.context.view_layer.update()
    assert listed == []
    lamp.data.type = "SPOT"
    bpy.context.view_layer.update()
    assert listed
