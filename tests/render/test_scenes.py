# SPDX-License-Identifier: GPL-3.0-or-later
"""A translucent material seen in several ways: sizes of instances, view layers, scenes."""

from __future__ import annotations

import math
from pathlib import Path

import bpy
import numpy as np
import pytest
from numpy.typing import NDArray
from rig import RESOLUTION, Rig, cdrf_node
from tolerances import WRITTEN

from cdrf_addon import ids
from cdrf_addon.blender import setup, state
from cdrf_addon.blender.material.lighting import lit_elsewhere
from cdrf_addon.blender.material.shadow_choice import choose_shadows
from cdrf_addon.blender.shader.bits import light_bits
from cdrf_addon.core.reflectance.sphere_model import sphere_reflectance

Array = NDArray[np.float64]
SCALE = 3.0
SIGMA0 = 0.12
RADIUS = 0.4
TURNS = {"Key": (1.2, 0.0, 0.5), "Rim": (1.0, 0.0, -1.1)}


def axis(name: str) -> Array:
    return np.array(bpy.data.objects[name].matrix_world)[:3, 2]


def sun(rig: Rig, name: str) -> bpy.types.Object:
    """A sun in a collection of the same name."""
    light = rig.light("SUN", name=name, energy=math.pi / 2.0, angle=0.0, rotation=TURNS[name])
    own = bpy.data.collections.new(name)
    rig.scene.collection.children.link(own)
    rig.scene.collection.objects.unlink(light)
    own.objects.link(light)
    return light


def white_ball(rig: Rig, **place: float) -> bpy.types.Object:
    """A ball of RADIUS, set up, white."""
    rig.camera.data.ortho_scale = SCALE
    ball = rig.sphere(RADIUS, subdivisions=6)
    ball.location.x = place.get("x", 0.0)
    bpy.context.view_layer.update()
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    material = ball.data.materials[0]
    material.cdrf.sigma0 = SIGMA0
    cdrf_node(ball).inputs[ids.BASE_COLOR].default_value = (1.0, 1.0, 1.0, 1.0)
    return ball


def reasons(obj: bpy.types.Object) -> str:
    bpy.context.view_layer.update()
    scene, layer = bpy.context.scene, bpy.context.view_layer
    return " ".join(state.reasons_to_update(obj, scene, layer))


def error(picture: Array, suns: list[str], x: float = 0.0, radius: float = RADIUS) -> float:
    """Worst difference from theory over a ball at x, in front of nothing."""
    steps = ((np.arange(RESOLUTION) + 0.5) / RESOLUTION - 0.5) * SCALE
    across, up = np.meshgrid((steps - x) / radius, steps / radius)
    inside = across**2 + up**2 < 0.9**2  # the picture of a facetted ball lags behind at the rim
    depth = -np.sqrt(np.maximum(1.0 - across**2 - up**2, 0.0))
    normal = np.stack((across, depth, up), axis=-1)[inside]
    expected = np.zeros(len(normal))
    for name in suns:
        angle = np.arccos(np.clip(normal @ axis(name), -1.0, 1.0))
        expected += 0.5 * sphere_reflectance(angle, SIGMA0 / radius)
    return float(np.abs(picture[inside][:, 0] - expected).max())


@pytest.mark.smoke
def test_instances_of_other_sizes_are_as_translucent_as_they_should(rig: Rig) -> None:
    sun(rig, "Key")
    ball = white_ball(rig, x=-1.0)
    inside = bpy.data.collections.new("Balls")
    rig.scene.collection.children.link(inside)
    rig.scene.collection.objects.unlink(ball)
    inside.objects.link(ball)
    inside.instance_offset = (-1.0, 0.0, 0.0)
    for number, (x, size) in enumerate(((-0.2, 0.5), (0.8, 2.0))):
        instance = rig.link(None, location=(x, 0.0, 0.0))
        instance.name = f"Instance {number}"
        instance.instance_type, instance.instance_collection = "COLLECTION", inside
        instance.scale = (size,) * 3
    bpy.context.view_layer.update()
    ball.data.materials[0].cdrf.shadows = "OFF"
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    picture = rig.render()
    off = [
        error(picture, ["Key"], x, size * RADIUS)
        for x, size in ((-1.0, 1.0), (-0.2, 0.5), (0.8, 2.0))
    ]
    print(f"original, half, twice: {off}")
    assert max(off) <= WRITTEN.worst
    assert reasons(ball) == ""
    # Only instances show it now, and one of them shrinks.
    bpy.context.view_layer.layer_collection.children["Balls"].exclude = True
    bpy.data.objects["Instance 0"].scale = (0.4,) * 3
    bpy.context.view_layer.update()
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    picture = rig.render()
    assert picture[:, :20, 3].max() == 0.0
    assert error(picture, ["Key"], -0.2, 0.4 * RADIUS) <= WRITTEN.worst


def layer_picture(rig: Rig, name: str) -> Array:
    for layer in rig.scene.view_layers:
        layer.use = layer.name == name
    picture = rig.render()
    for layer in rig.scene.view_layers:
        layer.use = True
    return picture


@pytest.mark.smoke
def test_each_view_layer_has_its_own_lights(rig: Rig) -> None:
    first = bpy.context.view_layer
    second = rig.scene.view_layers.new("Second")
    empty = rig.scene.view_layers.new("Backdrop")
    sun(rig, "Key"), sun(rig, "Rim")
    stage = bpy.data.collections.new("Stage")
    rig.scene.collection.children.link(stage)
    second.layer_collection.children["Rim"].exclude = True
    ball = white_ball(rig)
    rig.scene.collection.objects.unlink(ball)
    stage.objects.link(ball)
    empty.layer_collection.children["Stage"].exclude = True
    first.layer_collection.children["Key"].exclude = True
    assert "'Key'" in reasons(ball)
    assert bpy.ops.cdrf.update() == {"FINISHED"} and reasons(ball) == ""
    group = cdrf_node(ball).node_tree
    assert all(curve.driver.is_simple_expression for curve in group.animation_data.drivers)
    assert error(layer_picture(rig, first.name), ["Rim"]) <= WRITTEN.worst
    assert error(layer_picture(rig, "Second"), ["Key"]) <= WRITTEN.worst
    # A flag that changes is followed without a click.
    second.layer_collection.children["Rim"].exclude = False
    assert error(layer_picture(rig, "Second"), ["Key", "Rim"]) <= WRITTEN.worst
    # Shown nowhere else, the material needs no such driver.
    second.layer_collection.children["Stage"].exclude = True
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    assert [node.name for node in cdrf_node(ball).node_tree.nodes if ids.LIGHT_KEY in node] == [
        "Rim"
    ]


def test_another_scene_does_not_take_the_lights_away(rig: Rig, capfd) -> None:
    sun(rig, "Key")
    ball = white_ball(rig)
    here = rig.render()
    first = rig.scene
    second = first.copy()
    second.name = "Second"
    for child in list(second.collection.children):
        second.collection.children.unlink(child)
    bpy.context.window.scene = second
    sun(Other(rig, second), "Rim")
    bpy.context.view_layer.update()
    assert f"lights of the scene '{first.name}'" in reasons(ball)
    with pytest.raises(RuntimeError, match="Make Single User"):
        bpy.ops.cdrf.update()
    bpy.context.window.scene = first
    assert reasons(ball) == "" and np.array_equal(rig.render(), here)
    # A copy of its own is this scene's.
    bpy.context.window.scene = second
    copy = ball.copy()
    copy.data = ball.data.copy()
    copy.data.materials[0] = ball.data.materials[0].copy()
    second.collection.objects.unlink(ball)
    second.collection.objects.link(copy)
    assert bpy.ops.cdrf.update() == {"FINISHED"} and reasons(copy) == ""
    rig.scene = second
    assert error(rig.render(), ["Rim"]) <= WRITTEN.worst
    bpy.context.window.scene = rig.scene = first
    assert reasons(ball) == "" and np.array_equal(rig.render(), here)
    # Make Translucent, on the object that both show, takes it over and reports so.
    bpy.context.window.scene = second
    second.collection.objects.link(ball)
    second.collection.objects.unlink(copy)
    ball.select_set(True)
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    assert f"in the scene '{first.name}' too" in capfd.readouterr().out
    assert reasons(ball) == ""
    bpy.context.window.scene = first
    assert "lights of the scene 'Second'" in reasons(ball)


class Other(Rig):
    """The same rig in another scene."""

    def __init__(self, rig: Rig, scene: bpy.types.Scene) -> None:
        self.scene, self.camera = scene, rig.camera


@pytest.mark.smoke
def test_a_linked_character_is_lit_by_this_file(rig: Rig, tmp_path: Path) -> None:
    """Its mesh stays linked; a library override gets a copy of the material, which is saved."""
    sun(rig, "Key")
    ball = white_ball(rig)
    ball.name = "Hero"
    cast = bpy.data.collections.new("Cast")
    rig.scene.collection.children.link(cast)
    cast.objects.link(ball)
    library, shot = tmp_path / "hero.blend", tmp_path / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(library), copy=True)

    fresh = Rig()
    fresh.camera.data.ortho_scale = SCALE
    sun(fresh, "Rim")
    with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
        wanted.collections = ["Cast"]
    instance = fresh.link(None)
    instance.instance_type, instance.instance_collection = "COLLECTION", wanted.collections[0]
    instance.select_set(True)
    with pytest.raises(RuntimeError, match="Library Override"):
        bpy.ops.cdrf.setup()
    wanted.collections[0].override_hierarchy_create(
        fresh.scene, bpy.context.view_layer, reference=instance, do_fully_editable=True
    )
    bpy.data.objects.remove(instance)
    bpy.context.view_layer.update()
    hero = next(obj for obj in bpy.context.view_layer.objects if obj.type == "MESH")
    assert hero.override_library is not None and hero.data.library is not None
    assert "lights of its own file" in reasons(hero)
    bpy.ops.object.select_all(action="DESELECT")
    hero.select_set(True)
    assert bpy.ops.cdrf.setup() == {"FINISHED"} and reasons(hero) == ""
    assert error(fresh.render(), ["Rim"]) <= WRITTEN.worst
    sun(fresh, "Key")
    bpy.context.view_layer.update()
    assert bpy.ops.cdrf.update() == {"FINISHED"} and reasons(hero) == ""
    bpy.ops.wm.save_as_mainfile(filepath=str(shot))
    bpy.ops.wm.open_mainfile(filepath=str(shot))
    fresh.scene = bpy.context.scene
    assert error(fresh.render(), ["Key", "Rim"]) <= WRITTEN.worst


@pytest.mark.smoke
def test_linking_of_a_skin_in_an_instance_is_that_of_the_empty(rig: Rig) -> None:
    first, second = sun(rig, "Key"), sun(rig, "Rim")
    ball = white_ball(rig, x=-0.75)
    chars = bpy.data.collections.new("Chars")
    rig.scene.collection.children.link(chars)
    rig.scene.collection.objects.unlink(ball)
    chars.objects.link(ball)
    empty = rig.link(None, location=(1.5, 0.0, 0.0))
    empty.instance_type, empty.instance_collection = "COLLECTION", chars
    receivers = bpy.data.collections.new("Receivers")
    receivers.objects.link(ball)
    receivers.collection_objects[0].light_linking.link_state = "EXCLUDE"
    second.light_linking.receiver_collection = receivers
    assert "linked to other objects" in reasons(ball)
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    assert reasons(ball) == ""
    picture = rig.render()
    assert error(picture, ["Key"], -0.75) <= WRITTEN.worst
    assert error(picture, ["Key", "Rim"], 0.75) <= WRITTEN.worst
    # The other way round.
    receivers.objects.unlink(ball)
    receivers.objects.link(empty)
    receivers.collection_objects[0].light_linking.link_state = "EXCLUDE"
    assert reasons(ball) != ""
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    picture = rig.render()
    assert error(picture, ["Key", "Rim"], -0.75) <= WRITTEN.worst
    assert error(picture, ["Key"], 0.75) <= WRITTEN.worst
    assert first.light_linking.receiver_collection is None


def test_shadows_do_not_depend_on_which_view_layer_is_open(rig: Rig) -> None:
    sun(rig, "Key").data.use_shadow = True
    ball = white_ball(rig)
    hat = rig.sphere(0.2)
    hat.location.z = 0.8
    own = bpy.data.collections.new("Hats")
    rig.scene.collection.children.link(own)
    rig.scene.collection.objects.unlink(hat)
    own.objects.link(hat)
    bare = rig.scene.view_layers.new("Bare")
    bare.layer_collection.children["Hats"].exclude = True
    material = ball.data.materials[0]
    assert (
        choose_shadows(material, rig.scene.view_layers[0]).cast
        and choose_shadows(material, bare).cast
    )
    own.hide_render = True
    hat.hide_render = True
    assert not choose_shadows(material, bare).cast


def test_a_renamed_scene_keeps_its_skins(rig: Rig) -> None:
    sun(rig, "Key")
    ball = white_ball(rig)
    material = ball.data.materials[0]
    other = bpy.data.scenes.new("Other")
    other.collection.objects.link(ball)
    home, name = rig.scene, rig.scene.name
    assert lit_elsewhere(material, home) is None and lit_elsewhere(material, other) == home
    home.name = "Renamed"
    assert lit_elsewhere(material, home) is None and lit_elsewhere(material, other) == home
    home.name = name
    bpy.data.scenes.remove(other)


def test_a_light_in_very_many_excluded_collections_is_told_of(rig: Rig) -> None:
    lamp = sun(rig, "Key")
    rig.sphere(RADIUS)
    for number in range(60):
        part = bpy.data.collections.new(f"Part {number}")
        rig.scene.collection.children.link(part)
        part.objects.link(lamp)
    bare = rig.scene.view_layers.new("Bare")
    for child in bare.layer_collection.children:
        child.exclude = True
    job = setup.Setup(bpy.context, bpy.context.selected_objects)
    report = setup.run(job)
    assert any("more than 30 collections" in line for line in report.warnings)
    assert np.isfinite(rig.render()).all()
    rig.scene.view_layers.remove(bare)


def test_lights_never_share_a_place_in_the_objects_property(rig: Rig) -> None:
    first, second = sun(rig, "Key"), sun(rig, "Rim")
    ball, other = white_ball(rig, x=-0.75), rig.sphere(RADIUS)
    other.data.materials.append(ball.data.materials[0])
    for light, obj in ((first, ball), (second, other)):
        chosen = bpy.data.collections.new(light.name)
        chosen.objects.link(obj)
        light.light_linking.receiver_collection = chosen
    bpy.context.view_layer.update()
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    group = cdrf_node(ball).node_tree
    assert sorted(light_bits(group).values()) == [0, 1]
    # As after appending what another file numbered by itself.
    for node in group.nodes:
        if ids.BIT_KEY in node:
            node[ids.BIT_KEY] = 0
    assert "another place" in reasons(ball)
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    assert len(set(light_bits(cdrf_node(ball).node_tree).values())) == 2
    assert reasons(ball) == ""
