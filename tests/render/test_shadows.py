# SPDX-License-Identifier: GPL-3.0-or-later
"""Cast shadows: where a ray to the light is blocked by another object, and nowhere else."""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy
import numpy as np
import pytest
from mathutils import Vector
from mathutils.bvhtree import BVHTree
from numpy.typing import NDArray
from rig import RESOLUTION, Rig, cdrf_node
from tolerances import SHADOW, SHADOW_OF_HAT, SHADOW_OF_MANY, SHADOW_WORLD

from cdrf_addon import ids
from cdrf_addon.blender import state
from cdrf_addon.compat import HAS_RAYCAST
from cdrf_addon.core.reflectance.sphere_model import sphere_reflectance

SIGMA = 0.2
SCALE = 2.3
# The key faces the camera from the right, the second comes from the left, and so on.
SUNS = ((0.6, -0.7, 0.35), (-0.75, -0.5, 0.2), (0.1, -0.45, -0.85), (-0.2, -0.6, 0.75))
EDGE = 0.06
"""Pixels this near to a shadow's edge are not compared: EEVEE's shadow maps have texels."""

Array = NDArray[np.float64]


def directions(count: int, suns: Sequence[Sequence[float]] = SUNS) -> Array:
    found = np.array(suns[:count])
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def light_from(rig: Rig, towards: Array) -> None:
    """Suns of one half, one third ..., hard, with shadows."""
    rig.camera.data.ortho_scale = SCALE
    for number, direction in enumerate(towards):
        turn = Vector(direction).to_track_quat("Z", "Y").to_euler()
        sun = rig.light("SUN", energy=math.pi / (number + 2), angle=0.0, rotation=turn)
        sun.data.use_shadow = True


def scene_of(rig: Rig, count: int) -> tuple[bpy.types.Object, bpy.types.Object]:
    """A unit sphere under the first SUNS, and a bar in the way of the first."""
    light_from(rig, directions(count))
    toward = Vector(directions(1)[0])
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=1.35 * toward)
    bar = bpy.context.object
    bar.scale = (0.3, 1.6, 0.2)
    bar.rotation_euler = toward.to_track_quat("Z", "Y").to_euler()
    # What the camera sees of it must not hide the sphere.
    bar.visible_camera = False
    ball = rig.sphere(subdivisions=6)
    make_white(ball, SIGMA)
    return ball, bar


def make_white(obj: bpy.types.Object, sigma0: float) -> None:
    """Set up the selected object, white and without coloured edges."""
    bpy.context.view_layer.update()
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    material = obj.data.materials[0]
    material.cdrf.shadow_edges = False
    material.cdrf.sigma0 = sigma0
    cdrf_node(obj).inputs[ids.BASE_COLOR].default_value = (1.0, 1.0, 1.0, 1.0)


def points() -> tuple[Array, NDArray[np.bool_]]:
    """Where on the unit sphere the pixels lie, (height, width, 3), and which are on it."""
    steps = ((np.arange(RESOLUTION) + 0.5) / RESOLUTION - 0.5) * SCALE
    x, z = np.meshgrid(steps, steps)
    inside = x**2 + z**2 < 0.97**2
    y = -np.sqrt(np.maximum(1.0 - x**2 - z**2, 0.0))
    return np.stack((x, y, z), axis=-1), inside


def blocked(bar: bpy.types.Object, places: Array, direction: Array) -> NDArray[np.bool_]:
    mesh = bar.data.copy()
    mesh.transform(bar.matrix_world)
    tree = BVHTree.FromPolygons(
        [v.co for v in mesh.vertices], [tuple(p.vertices) for p in mesh.polygons]
    )
    toward = Vector(direction)
    return np.array([tree.ray_cast(Vector(place), toward)[0] is not None for place in places])


def expected(
    bar: bpy.types.Object, towards: Array, sigma: float = SIGMA, edge: float = EDGE
) -> tuple[Array, NDArray[np.bool_]]:
    """What theory shows, and the pixels clear of every edge."""
    places, clear = points()
    flat = places.reshape(-1, 3)
    shown = np.zeros(len(flat))
    for number, direction in enumerate(towards):
        cosine = flat @ direction
        light = sphere_reflectance(np.arccos(np.clip(cosine, -1.0, 1.0)), sigma) / (number + 2)
        side = np.cross(direction, (0.0, 0.0, 1.0))
        side /= np.linalg.norm(side)
        up = np.cross(side, direction)
        shadow = blocked(bar, flat, direction)
        for step in (side, -side, up, -up):
            same = blocked(bar, flat + edge * step, direction) == shadow
            clear &= same.reshape(clear.shape)
        shown += np.where(shadow, 0.0, light)
    return shown.reshape(clear.shape), clear


def errors(rig: Rig, bar: bpy.types.Object, count: int, world: float = 0.0) -> Array:
    wanted, clear = expected(bar, directions(count))
    picture = rig.render()[..., 0] - world
    off = np.abs(picture - wanted)[clear]
    print(f"{count} lights: worst {off.max():.2e}, RMS {np.sqrt((off**2).mean()):.2e}")
    return off


@pytest.mark.smoke
def test_one_light_is_blocked_by_others_and_not_by_the_surface_itself(rig: Rig) -> None:
    _, bar = scene_of(rig, 1)
    off = errors(rig, bar, 1)
    assert off.max() <= SHADOW.worst
    assert np.sqrt((off**2).mean()) <= SHADOW.rms


@pytest.mark.parametrize("count", [2, 3])
def test_two_and_three_lights_have_their_own_shadows(rig: Rig, count: int) -> None:
    _, bar = scene_of(rig, count)
    off = errors(rig, bar, count)
    assert off.max() <= SHADOW.worst
    assert np.sqrt((off**2).mean()) <= SHADOW.rms


def group_of(*items: bpy.types.Object) -> bpy.types.Collection:
    found = bpy.data.collections.new("Linked")
    for obj in items:
        found.objects.link(obj)
    return found


@pytest.mark.smoke
def test_a_light_not_received_leaves_the_others_shadows_alone(rig: Rig) -> None:
    """Of two casting lights one shines only on another object of the same material."""
    ball, bar = scene_of(rig, 2)
    other = rig.link(ball.data)
    other.location = (50.0, 0.0, 0.0)
    second = next(obj for obj in rig.scene.objects if obj.name.startswith("Sun."))
    second.light_linking.receiver_collection = group_of(other)
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    assert ids.UNLIT_KEY in ball and ids.UNLIT_KEY not in other
    off = errors(rig, bar, 1)
    assert off.max() <= SHADOW.worst
    assert np.sqrt((off**2).mean()) <= SHADOW.rms


@pytest.mark.smoke
def test_shadow_linking(rig: Rig) -> None:
    """The bar does not block the light: neither its shadow nor the coloured edge of one is seen."""
    ball, bar = scene_of(rig, 1)
    sun = next(obj for obj in rig.scene.objects if obj.type == "LIGHT")
    material = ball.data.materials[0]
    material.cdrf.shadow_edges = True
    blockers = sun.light_linking.blocker_collection = group_of(bar)
    blockers.collection_objects[0].light_linking.link_state = "EXCLUDE"
    assert ("block light 'Sun'" in reasons(ball)) == HAS_RAYCAST
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    assert reasons(ball) == ""
    assert shadow_nodes(ball) == 1  # the mask; its rays would meet the bar
    picture = rig.render()[..., 0]
    bar.location = (50.0, 0.0, 0.0)  # in theory it might as well be far away
    bpy.context.view_layer.update()
    wanted, clear = expected(bar, directions(1))
    off = np.abs(picture - wanted)[clear]
    print(f"worst {off.max():.2e}, RMS {np.sqrt((off**2).mean()):.2e}")
    assert off.max() <= SHADOW.worst
    assert np.sqrt((off**2).mean()) <= SHADOW.rms


def test_four_lights_share_a_mask(rig: Rig) -> None:
    _, bar = scene_of(rig, 4)
    off = errors(rig, bar, 4)
    assert np.sqrt((off**2).mean()) <= SHADOW_OF_MANY.rms


def test_the_world_does_not_brighten_a_shadow(rig: Rig) -> None:
    background = rig.scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    background.inputs["Strength"].default_value = 0.2
    _, bar = scene_of(rig, 1)
    # An even world sends its strength to all of a white surface, in shadow and out of it.
    off = errors(rig, bar, 1, world=0.2)
    assert np.sqrt((off**2).mean()) <= SHADOW_WORLD.rms


# Hats are worn in the sun: the key and the second from above, the third from below the brim.
HAT_SUNS = ((0.4, -0.65, 0.65), (-0.6, -0.6, 0.5), (0.75, -0.6, -0.2))
BRIM = 0.6
HAT_SIGMA = 0.1
HAT_EDGE = 0.14
"""Shadows under a brim fall at a grazing angle: EEVEE's own, on a Diffuse BSDF, fray as far."""


def bald_head(rig: Rig, count: int) -> bpy.types.Object:
    """A unit sphere under the first HAT_SUNS, translucent before it has a hat."""
    light_from(rig, directions(count, HAT_SUNS))
    head = rig.sphere(subdivisions=6)
    make_white(head, HAT_SIGMA)
    return head


def hat() -> bpy.types.Object:
    """The brim of a straw hat, flat, on the sphere's forehead."""
    bpy.ops.mesh.primitive_cylinder_add(
        vertices=96, radius=1.35, depth=0.03, location=(0.0, 0.0, BRIM)
    )
    bpy.context.view_layer.update()
    return bpy.context.object


def below_the_brim(rig: Rig, brim: bpy.types.Object, count: int, *, shadow: bool = True) -> Array:
    """Differences from theory over the surface that the camera sees under the hat."""
    towards = directions(count, HAT_SUNS)
    wanted, clear = expected(brim, towards, HAT_SIGMA, HAT_EDGE)
    places, _ = points()
    if not shadow:
        places, clear = points()
        cosine = np.clip(places @ towards[0], -1.0, 1.0)
        wanted = 0.5 * sphere_reflectance(np.arccos(cosine), HAT_SIGMA)
    clear &= places[..., 2] < BRIM - 0.1
    off = np.abs(rig.render()[..., 0] - wanted)[clear]
    print(f"worst {off.max():.2e}, RMS {np.sqrt((off**2).mean()):.2e}, {clear.sum()} pixels")
    return off


@pytest.mark.parametrize("count", [pytest.param(1, marks=pytest.mark.smoke), 3])
def test_a_hat_is_noticed_and_shades_the_face(rig: Rig, count: int) -> None:
    head = bald_head(rig, count)
    assert shadow_nodes(head) == 0 and reasons(head) == ""
    brim = hat()
    assert "can cast one is new" in reasons(head)
    assert bpy.ops.cdrf.update() == {"FINISHED"} and reasons(head) == ""
    off = below_the_brim(rig, brim, count)
    assert off.max() <= SHADOW_OF_HAT.worst
    assert np.sqrt((off**2).mean()) <= SHADOW_OF_HAT.rms
    # A hat that is taken off is followed at once.
    brim.location.y += 200.0
    bpy.context.view_layer.update()
    bare = below_the_brim(rig, brim, count)
    assert bare.max() <= SHADOW_OF_HAT.worst
    assert np.sqrt((bare**2).mean()) <= SHADOW.rms


def test_what_the_camera_does_not_see_may_shade(rig: Rig) -> None:
    """Holdouts and shadow-only objects shade; what casts no shadow needs no shadow nodes."""
    head = bald_head(rig, 1)
    brim = hat()
    for setting, value, shades in (
        ("is_holdout", True, True),
        ("visible_camera", False, True),
        ("visible_shadow", False, False),
        ("hide_render", True, False),
    ):
        before = getattr(brim, setting)
        setattr(brim, setting, value)
        bpy.context.view_layer.update()
        assert bpy.ops.cdrf.update() == {"FINISHED"}
        assert (shadow_nodes(head) > 0) == shades
        worst = below_the_brim(rig, brim, 1, shadow=shades).max()
        assert worst <= (SHADOW_OF_HAT if shades else SHADOW).worst
        setattr(brim, setting, before)


def test_a_hat_in_a_collection_instance_shades(rig: Rig) -> None:
    head = bald_head(rig, 1)
    brim = hat()
    wardrobe = bpy.data.collections.new("Wardrobe")
    wardrobe.objects.link(brim)
    rig.scene.collection.objects.unlink(brim)
    assert reasons(head) == ""
    worn = rig.link(None)
    worn.instance_type, worn.instance_collection = "COLLECTION", wardrobe
    assert "can cast one is new" in reasons(head)
    assert bpy.ops.cdrf.update() == {"FINISHED"} and shadow_nodes(head) > 0
    assert below_the_brim(rig, brim, 1).max() <= SHADOW_OF_HAT.worst


def shadow_nodes(ball: bpy.types.Object) -> int:
    tree = cdrf_node(ball).node_tree
    return sum(node.name.startswith("Shadow") for node in tree.nodes)


def reasons(ball: bpy.types.Object) -> str:
    context = bpy.context
    context.view_layer.update()
    return " ".join(state.reasons_to_update(ball, context.scene, context.view_layer))


@pytest.mark.smoke
def test_auto_needs_an_occluder_and_a_light_that_casts(rig: Rig) -> None:
    sun = rig.light("SUN", use_shadow=True)
    ball = rig.sphere()
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    assert shadow_nodes(ball) == 0
    assert reasons(ball) == ""

    rig.link(bpy.data.meshes.new("Hat"))
    bpy.context.view_layer.update()
    assert "can cast one" in reasons(ball)
    bpy.ops.cdrf.update()
    assert shadow_nodes(ball) > 0
    assert ids.THICKNESS in cdrf_node(ball).outputs
    assert cdrf_node(ball).outputs[ids.THICKNESS].is_linked
    assert reasons(ball) == ""

    sun.data.use_shadow = False
    assert "casts shadows now, or no more" in reasons(ball)
    bpy.ops.cdrf.update()
    assert shadow_nodes(ball) == 0
    assert reasons(ball) == ""


def test_the_setting_changes_the_group_at_once(rig: Rig) -> None:
    rig.light("SUN", use_shadow=True)
    ball = rig.sphere()
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    material = ball.data.materials[0]
    material.cdrf.shadows = "ON"
    assert shadow_nodes(ball) == 1
    material.cdrf.shadow_edges = True
    assert (shadow_nodes(ball) > 1) == HAS_RAYCAST  # the light's mask, and its edge
    material.cdrf.shadow_edges = False
    assert shadow_nodes(ball) == 1
    material.cdrf.sigma0_ratio = (1.0, 0.5, 0.2)
    assert shadow_nodes(ball) == 1
    material.cdrf.shadows = "OFF"
    assert shadow_nodes(ball) == 0


def test_world_switched_on_is_noticed(rig: Rig) -> None:
    rig.light("SUN", use_shadow=True)
    ball = rig.sphere()
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    ball.data.materials[0].cdrf.shadows = "ON"
    assert reasons(ball) == ""
    rig.scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 1.0
    assert "world" in reasons(ball)
    bpy.ops.cdrf.update()
    assert reasons(ball) == ""


@pytest.mark.parametrize("count", [1, 2])
def test_black_light_costs_nothing_and_is_noticed_when_turned_up(rig: Rig, count: int) -> None:
    lights: Sequence[bpy.types.Object] = [
        rig.light("POINT", energy=0.0 if i else 10.0) for i in range(count)
    ]
    ball = rig.sphere()
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    tree = cdrf_node(ball).node_tree
    assert sum(ids.LIGHT_KEY in node for node in tree.nodes) == 1
    if count > 1:
        lights[1].data.energy = 5.0
        assert "is new" in reasons(ball)
