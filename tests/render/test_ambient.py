# SPDX-License-Identifier: GPL-3.0-or-later
"""The world's light on translucent surfaces: theory, Cycles, and EEVEE's own Diffuse BSDF."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from mathutils import Vector
from rig import Rig, cdrf_node, diffuse_material
from tolerances import WORLD_CYCLES, WRITTEN

from cdrf_addon import compat, ids
from cdrf_addon.blender import state
from cdrf_addon.blender.world.capture import capture
from cdrf_addon.blender.world.stamps import stamped
from cdrf_addon.blender.world.surface import is_animated
from cdrf_addon.core.errors import SceneError
from cdrf_addon.core.reflectance.environment import band_factors, lit_by, panorama_directions
from cdrf_addon.core.reflectance.model import PROFILE, RING, ring, sphere
from cdrf_addon.core.reflectance.profile import profile


@pytest.fixture
def rig(rig: Rig) -> Rig:
    """The world's light is smooth: fewer pixels show as much."""
    rig.scene.render.resolution_x = rig.scene.render.resolution_y = 64
    return rig


def background(rig: Rig) -> bpy.types.ShaderNode:
    return rig.scene.world.node_tree.nodes["Background"]


def plain(rig: Rig, colour: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> bpy.types.ShaderNode:
    node = background(rig)
    node.inputs["Color"].default_value = (*colour, 1.0)
    node.inputs["Strength"].default_value = 1.0
    return node


def picture(rig: Rig, pixels: np.ndarray) -> None:
    """Let a panorama light the world; its centre is +X, as Blender lays pictures out."""
    height, width, _ = pixels.shape
    image = bpy.data.images.new("HDRI", width, height, float_buffer=True)
    rgba = np.ones((height, width, 4), dtype=np.float32)
    rgba[..., :3] = pixels
    image.pixels.foreach_set(rgba.ravel())
    image.update()
    tree = rig.scene.world.node_tree
    texture = tree.nodes.get("HDRI") or tree.nodes.new("ShaderNodeTexEnvironment")
    texture.name, texture.image = "HDRI", image
    tree.links.new(texture.outputs["Color"], background(rig).inputs["Color"])
    background(rig).inputs["Strength"].default_value = 1.0


def white(rig: Rig) -> bpy.types.Object:
    ball = rig.sphere()
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    cdrf_node(ball).inputs[ids.BASE_COLOR].default_value = (1.0, 1.0, 1.0, 1.0)
    return ball


def due(rig: Rig, obj: bpy.types.Object) -> list[str]:
    return state.reasons_to_update(obj, rig.scene, bpy.context.view_layer)


def kinds(obj: bpy.types.Object) -> list[str]:
    return [node.bl_idname for node in cdrf_node(obj).node_tree.nodes]


@pytest.mark.smoke
def test_white_world_is_one_and_followed(rig: Rig) -> None:
    node = plain(rig)
    ball = white(rig)
    ball.data.materials[0].cdrf.sigma0 = 0.5
    pixels = rig.render()
    covered = pixels[..., 3] > 0.999
    assert np.abs(pixels[covered][:, :3] - 1.0).max() <= 0.005
    # No more than the driven colour and what turns it into light.
    assert len(kinds(ball)) <= 7 and "ShaderNodeNewGeometry" not in kinds(ball)
    node.inputs["Strength"].default_value = 0.5
    node.inputs["Color"].default_value = (1.0, 0.5, 0.25, 1.0)
    assert due(rig, ball) == []
    assert rig.render()[covered][:, :3].mean(axis=0) == pytest.approx((0.5, 0.25, 0.125), rel=1e-3)


def test_no_node_for_a_black_or_missing_world(rig: Rig) -> None:
    ball = white(rig)
    group = cdrf_node(ball).node_tree
    assert ids.WORLD_NODE not in group.nodes and stamped(group) is None
    assert due(rig, ball) == []
    plain(rig)
    assert any("world" in line for line in due(rig, ball))
    assert bpy.ops.cdrf.update() == {"FINISHED"} and due(rig, ball) == []
    assert ids.WORLD_NODE in cdrf_node(ball).node_tree.nodes
    rig.scene.world = None
    assert any("world" in line for line in due(rig, ball))
    assert bpy.ops.cdrf.update() == {"FINISHED"} and due(rig, ball) == []
    assert ids.WORLD_NODE not in cdrf_node(ball).node_tree.nodes


@pytest.mark.smoke
def test_gradient_sky_is_filtered_by_every_model(rig: Rig) -> None:
    z = panorama_directions(64, 128)[..., 2:]
    picture(rig, 0.5 + 0.3 * z * np.array([1.0, 0.5, -1.0]) + 0.05 * (3.0 * z**2 - 1.0))
    ball = white(rig)
    material = ball.data.materials[0]
    light = stamped(cdrf_node(ball).node_tree)
    assert light is not None and light.environment.sun is None
    normals, covered = rig.normals(ball)
    material.cdrf.sigma0_ratio = (1.0, 0.5, 0.1)
    for kind, model in ((None, sphere()), (RING, ring()), (PROFILE, profile())):
        if kind:
            material.cdrf.model = kind
        material.cdrf.sigma0 = 0.6
        sigma = 0.6 * np.array(material.cdrf.sigma0_ratio)
        factors = band_factors(model, sigma)
        if model.colour:
            factors = factors[range(3), range(3)]
        expected = lit_by(light.environment.harmonics, normals[covered], factors)
        error = rig.render()[covered][:, :3] - expected
        print(f"{model.kind}: {np.abs(error).max():.1e}")
        assert np.abs(error).max() <= WRITTEN.worst
    # And the harmonics are those of the sky: 2/3 of the gradient is left at sigma 0.
    up = lit_by(light.environment.harmonics, (0.0, 0.0, 1.0), np.ones((3, 3)))
    assert up == pytest.approx(0.525 + 0.2 * np.array([1.0, 0.5, -1.0]), abs=2e-3)


def sunny(height: int = 512, width: int = 1024) -> np.ndarray:
    """A blue sky over dark ground, and a sun of 2 degrees: a few hundred texels."""
    d = panorama_directions(height, width)
    sky = np.where(d[..., 2:] > 0.0, (0.4, 0.6, 0.9), 0.1)
    axis = np.array([-0.6, 0.7, 0.5]) / np.linalg.norm((-0.6, 0.7, 0.5))
    return sky + (d @ axis >= math.cos(math.radians(1.0)))[..., None] * (2500.0, 2200.0, 1800.0)


def window(height: int = 256, width: int = 512) -> np.ndarray:
    """A dim room with one window of 45 by 45 degrees."""
    d = panorama_directions(height, width)
    inside = (np.abs(np.arctan2(d[..., 0], d[..., 1]) + 0.8) < 0.4) & (
        np.abs(d[..., 2] - 0.3) < 0.4
    )
    return np.where(inside[..., None], (6.0, 5.5, 5.0), 0.15)


@pytest.mark.parametrize("sky", [sunny, window], ids=["sun", "window"])
def test_against_cycles_and_the_diffuse_bsdf(rig: Rig, sky) -> None:
    """Also: the sun of a picture is there, once."""
    picture(rig, sky())
    ball = white(rig)
    ball.data.materials[0].cdrf.sigma0 = 0.0
    light = stamped(cdrf_node(ball).node_tree)
    assert light is not None and light.environment.sun is not None
    ours = rig.render()
    ball.data.materials[0] = diffuse_material()
    theirs = rig.render()
    rig.scene.render.engine = "CYCLES"
    rig.scene.cycles.samples = 128
    rig.scene.cycles.device = "CPU"
    rig.scene.cycles.use_denoising = rig.scene.cycles.use_adaptive_sampling = False
    rig.scene.cycles.max_bounces = 0
    traced = rig.render()
    rig.scene.render.engine = compat.EEVEE
    covered = (ours[..., 3] > 0.999) & (traced[..., 3] > 0.999)
    peak = traced[covered][:, :3].max()
    bound = WORLD_CYCLES
    error = (ours - traced)[covered][:, :3] / peak
    own = (theirs - traced)[covered][:, :3] / peak
    rms, own_rms = np.sqrt((error**2).mean()), np.sqrt((own**2).mean())
    print(f"ours: worst {np.abs(error).max():.3f}, RMS {rms:.4f}, mean {error.mean():+.4f}")
    print(f"EEVEE: worst {np.abs(own).max():.3f}, RMS {own_rms:.4f}, mean {own.mean():+.4f}")
    assert np.abs(error).max() <= bound.worst and rms <= bound.rms
    assert abs(error.mean()) <= 0.01
    assert rms <= own_rms  # never worse than what EEVEE's own surfaces show


def test_worlds_are_rendered_once_and_their_strength_is_followed(rig: Rig, monkeypatch) -> None:
    picture(rig, np.full((64, 128, 3), (0.8, 0.4, 0.2)) * (1.0 + 0.0))
    counted: list[str] = []

    def counting(*arguments):
        counted.append("x")
        return capture(*arguments)

    monkeypatch.setattr("cdrf_addon.blender.world.light.capture", counting)
    before = {kind: len(getattr(bpy.data, kind)) for kind in ("scenes", "worlds", "cameras")}
    ball = white(rig)
    assert len(counted) == 1
    assert before == {kind: len(getattr(bpy.data, kind)) for kind in before}
    background(rig).inputs["Strength"].default_value = 0.25
    assert due(rig, ball) == []
    ball.data.materials[0].cdrf.sigma0_ratio = (1.0, 0.5, 0.2)
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    assert len(counted) == 1
    pixels = rig.render()
    covered = pixels[..., 3] > 0.999
    expected = np.array([0.2, 0.1, 0.05])
    assert pixels[covered][:, :3].mean(axis=0) == pytest.approx(expected, rel=2e-3)
    tree = rig.scene.world.node_tree
    tree.nodes["HDRI"].interpolation = "Closest"
    assert any("world" in line for line in due(rig, ball))
    assert bpy.ops.cdrf.update() == {"FINISHED"} and due(rig, ball) == []
    assert len(counted) == 2
    group = cdrf_node(ball).node_tree
    assert all(curve.driver.is_simple_expression for curve in group.animation_data.drivers)


def test_without_cycles_the_lights_still_work(rig: Rig, monkeypatch, capfd) -> None:
    picture(rig, np.linspace(0.1, 1.0, 8 * 16 * 3).reshape(8, 16, 3))
    rig.light("SUN")

    def refuse(*_arguments):
        raise SceneError("The world's light could not be read, as Cycles is switched off: enable")

    monkeypatch.setattr("cdrf_addon.blender.world.light.capture", refuse)
    ball = white(rig)
    assert stamped(cdrf_node(ball).node_tree) is None
    assert "Sun" in cdrf_node(ball).node_tree.nodes
    assert any("world" in line for line in due(rig, ball))
    assert "enable" in capfd.readouterr().out


def test_a_saved_file_knows_its_world(rig: Rig, tmp_path, monkeypatch) -> None:
    picture(rig, np.full((8, 16, 3), (0.8, 0.4, 0.2)) * np.linspace(0.5, 1.0, 8)[:, None, None])
    rig.scene.world.node_tree.nodes["HDRI"].image.pack()
    ball = white(rig)
    name = ball.name
    before = stamped(cdrf_node(ball).node_tree)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "world.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "world.blend"))
    ball = bpy.data.objects[name]
    scene, layer = bpy.context.scene, bpy.context.view_layer
    assert state.reasons_to_update(ball, scene, layer) == []

    def refuse(*_arguments):
        raise AssertionError("rendered again")

    monkeypatch.setattr("cdrf_addon.blender.world.light.capture", refuse)
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    after = stamped(cdrf_node(ball).node_tree)
    assert before is not None and after is not None
    assert np.array_equal(before.environment.harmonics, after.environment.harmonics)
    assert after.world == scene.world


def test_a_flat_mesh_is_lit_by_a_pictures_sun_alone(rig: Rig) -> None:
    """Without a light of the scene nothing but the sun depends on the variance."""
    picture(rig, sunny())
    bpy.ops.mesh.primitive_plane_add(size=1.0)
    plane = bpy.context.object
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    node = cdrf_node(plane)
    node.inputs[ids.BASE_COLOR].default_value = (1.0, 1.0, 1.0, 1.0)
    light = stamped(node.node_tree)
    assert light is not None and light.environment.sun is not None
    sun = light.environment.sun
    # Turned halfway from the sun to the camera, so that both see it.
    normal = (Vector(sun.direction) + Vector((0.0, -1.0, 0.0))).normalized()
    plane.rotation_euler = normal.to_track_quat("Z", "Y").to_euler()
    expected = lit_by(light.environment.harmonics, tuple(normal), np.ones((3, 3)))
    expected = expected + np.array(sun.radiance) * normal.dot(Vector(sun.direction))
    pixels = rig.render()
    found = pixels[pixels[..., 3] > 0.999][:, :3]
    assert np.abs(found / expected - 1.0).max() <= 2e-3
    assert due(rig, plane) == []


def test_the_camera_may_see_another_world(rig: Rig) -> None:
    """Light Path > Is Camera Ray hides the light from the camera, not from the surface."""
    tree = rig.scene.world.node_tree
    path = tree.nodes.new("ShaderNodeLightPath")
    mix = tree.nodes.new("ShaderNodeMix")
    mix.data_type = "RGBA"
    tree.links.new(path.outputs["Is Camera Ray"], mix.inputs["Factor"])
    mix.inputs[6].default_value = (0.5, 0.5, 0.5, 1.0)
    mix.inputs[7].default_value = (0.0, 0.0, 0.0, 1.0)
    tree.links.new(mix.outputs[2], background(rig).inputs["Color"])
    background(rig).inputs["Strength"].default_value = 1.0
    ball = white(rig)
    light = stamped(cdrf_node(ball).node_tree)
    assert light is not None
    white_in = lit_by(light.environment.harmonics, (0.0, 0.0, 1.0), np.ones((3, 3)))
    assert white_in == pytest.approx((0.5,) * 3, rel=1e-3)


def test_occlusion_darkens_a_corner_and_is_absent_otherwise(rig: Rig) -> None:
    """EEVEE's own node, which sees what is on screen: a floor before a wall, from above."""
    plain(rig)
    rig.scene.eevee.fast_gi_thickness_near = 10.0
    bpy.ops.mesh.primitive_plane_add(size=4.0, location=(0.0, 1.0, 1.0))
    bpy.context.object.rotation_euler = (math.pi / 2.0, 0.0, 0.0)
    bpy.ops.mesh.primitive_plane_add(size=4.0)
    floor = bpy.context.object
    rig.camera.data.ortho_scale = 2.0
    rig.camera.rotation_euler = (0.8, 0.0, 0.0)
    rig.camera.location = (0.0, 0.6 - 5.0 * math.sin(0.8), 5.0 * math.cos(0.8))
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    cdrf_node(floor).inputs[ids.BASE_COLOR].default_value = (1.0, 1.0, 1.0, 1.0)
    material = floor.data.materials[0]
    assert "ShaderNodeAmbientOcclusion" not in kinds(floor)
    material.cdrf.ambient_occlusion = True
    assert "ShaderNodeAmbientOcclusion" in kinds(floor)
    rows = rig.render()[:, 24:40, 0].mean(axis=1)
    lit = rows[rows > 0.01]
    print("from afar to the corner:", lit[::4].round(2))
    assert lit[:4].mean() > 0.95 and lit.min() < 0.78
    assert bpy.ops.cdrf.update() == {"FINISHED"} and material.cdrf.ambient_occlusion
    material.cdrf.ambient_occlusion = False
    assert "ShaderNodeAmbientOcclusion" not in kinds(floor)


def hazy(height: int = 128, width: int = 256) -> np.ndarray:
    """A sky of several colours with a sun in haze: as smooth as its pixels, wherever they lie."""
    d = panorama_directions(height, width)
    axis = np.array([-0.6, 0.5, 0.6]) / np.linalg.norm((-0.6, 0.5, 0.6))
    sky = 0.4 + 0.2 * d * (1.0, -1.0, 0.7) + 0.1 * (d[..., :1] * d[..., 2:])
    return sky + np.exp(40.0 * (d @ axis - 1.0))[..., None] * (20.0, 18.0, 14.0)


def mapped(rig: Rig, *, kind: str = "POINT") -> bpy.types.ShaderNode:
    """Put Texture Coordinate -> Mapping before the world's picture."""
    tree = rig.scene.world.node_tree
    start, turn = (tree.nodes.new(f"ShaderNode{name}") for name in ("TexCoord", "Mapping"))
    turn.name, turn.vector_type = 'The "Turn"', kind
    tree.links.new(start.outputs["Generated"], turn.inputs["Vector"])
    tree.links.new(turn.outputs["Vector"], tree.nodes["HDRI"].inputs["Vector"])
    return turn


@pytest.mark.parametrize("kind", [pytest.param("POINT", marks=pytest.mark.smoke), "TEXTURE"])
def test_a_turned_picture_is_followed(rig: Rig, kind: str) -> None:
    """As a fresh Update sees the same world where the pattern is hidden behind another node.

    Cycles looks at the picture with eight samples for each pixel, so the picture must be smooth.
    """
    rig.scene.render.resolution_x = rig.scene.render.resolution_y = 32
    picture(rig, hazy())
    turn = mapped(rig, kind=kind)
    turn.inputs["Rotation"].default_value = (0.1, 0.2, 0.3)
    ball = white(rig)
    ball.data.materials[0].cdrf.sigma0 = 0.2
    light = stamped(cdrf_node(ball).node_tree)
    assert light is not None and light.mapping == turn.name and light.environment.sun is not None
    for frame, angles in ((1, (0.0, 0.0, 0.0)), (3, (0.8, -1.4, 4.4))):
        turn.inputs["Rotation"].default_value = angles
        turn.inputs["Rotation"].keyframe_insert("default_value", frame=frame)
    rig.scene.frame_set(2)
    assert turn.inputs["Rotation"].default_value[2] == pytest.approx(2.2)
    assert due(rig, ball) == [] and not is_animated(rig.scene.world)
    group = cdrf_node(ball).node_tree
    assert all(curve.driver.is_simple_expression for curve in group.animation_data.drivers)
    followed = rig.render()
    covered = followed[..., 3] > 0.999

    tree = rig.scene.world.node_tree
    same = tree.nodes.new("ShaderNodeVectorMath")
    tree.links.new(turn.outputs["Vector"], same.inputs[0])
    tree.links.new(same.outputs["Vector"], tree.nodes["HDRI"].inputs["Vector"])
    assert any("world" in line for line in due(rig, ball))
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    light = stamped(cdrf_node(ball).node_tree)
    assert light is not None and not light.mapping
    assert "ShaderNodeMapping" not in kinds(ball)
    fresh = rig.render()
    peak = fresh[covered][:, :3].max()
    off = np.abs(followed - fresh)[covered][:, :3] / peak
    print(
        f"{kind}: worst {off.max():.1e}, RMS {np.sqrt((off**2).mean()):.1e} of the peak {peak:.2f}"
    )
    assert off.max() <= 1e-3


def test_only_a_picture_that_is_merely_turned_is_followed(rig: Rig) -> None:
    picture(rig, sunny(64, 128))
    turn = mapped(rig)
    ball = white(rig)

    def follows() -> bool:
        assert bpy.ops.cdrf.update() == {"FINISHED"}
        return "ShaderNodeMapping" in kinds(ball)

    assert follows()
    turn.inputs["Scale"].default_value = (1.0, 1.0, -1.0)
    assert any("world" in line for line in due(rig, ball)) and not follows()
    turn.inputs["Scale"].default_value = (1.0, 1.0, 1.0)
    turn.inputs["Location"].default_value = (0.0, 0.0, 0.5)
    assert not follows()
    turn.inputs["Location"].default_value = (0.0, 0.0, 0.0)
    assert follows()
    turn.vector_type = "VECTOR"
    assert follows()
    turn.mute = True
    assert not follows()
