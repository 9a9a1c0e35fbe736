# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights that change are followed without a click, in the background, without the extension."""

from __future__ import annotations

import math
import subprocess
import sys
import textwrap
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import bpy
import numpy as np
import pytest
from rig import Rig, cdrf_node
from tolerances import WRITTEN

from cdrf_addon import ids
from cdrf_addon.core.reflectance.sphere_model import sphere_reflectance

SIGMA = 0.3


@dataclass
class Lit:
    """A white sphere of sigma 0.3 under one sun, with its normals measured."""

    rig: Rig
    sun: bpy.types.Object
    ball: bpy.types.Object
    normal: np.ndarray
    covered: np.ndarray


@pytest.fixture
def lit(rig: Rig) -> Lit:
    sun = rig.light("SUN", name='The "Key" \\ 1', energy=math.pi, angle=0.0)
    ball = rig.sphere()
    bpy.context.view_layer.update()
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    ball.data.materials[0].cdrf.sigma0 = SIGMA
    cdrf_node(ball).inputs["Base Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    return Lit(rig, sun, ball, *rig.normals(ball))


def assert_lit_from(lit: Lit, direction: np.ndarray, energy: float = 1.0) -> None:
    cosine = np.clip(lit.normal[lit.covered] @ (direction / np.linalg.norm(direction)), -1.0, 1.0)
    expected = energy * sphere_reflectance(np.arccos(cosine), SIGMA)
    error = lit.rig.render()[lit.covered][:, 0] - expected
    assert np.abs(error).max() <= WRITTEN.worst * max(energy, 1.0)


def axis_of(obj: bpy.types.Object) -> np.ndarray:
    bpy.context.view_layer.update()
    return np.array(obj.matrix_world)[:3, 2]


@pytest.mark.smoke
def test_rotated_parented_constrained_and_scaled(lit: Lit) -> None:
    lit.sun.rotation_euler = (0.9, 0.2, 0.7)
    assert_lit_from(lit, axis_of(lit.sun))

    parent = lit.rig.link(None, rotation=(0.3, -0.8, 0.4))
    lit.sun.parent = parent
    parent.scale = (1.5, 1.5, 1.5)
    assert_lit_from(lit, axis_of(lit.sun))

    target = lit.rig.link(None, location=(-2.0, 3.0, -1.5))
    constraint = lit.sun.constraints.new("TRACK_TO")
    constraint.target, constraint.track_axis, constraint.up_axis = (
        target,
        "TRACK_NEGATIVE_Z",
        "UP_Y",
    )
    direction = axis_of(lit.sun)
    assert direction @ np.array((2.0, -3.0, 1.5)) > 3.5  # the constraint does aim it
    assert_lit_from(lit, direction)


def test_animated_energy_and_rotation_and_visibility(lit: Lit) -> None:
    for frame, angle, energy, hidden in ((1, 0.4, 1.0, False), (11, 1.4, 2.0, True)):
        lit.sun.rotation_euler = (angle, 0.0, 0.3)
        lit.sun.data.energy = energy * math.pi
        lit.sun.hide_render = hidden
        lit.sun.keyframe_insert("rotation_euler", frame=frame)
        lit.sun.data.keyframe_insert("energy", frame=frame)
        lit.sun.keyframe_insert("hide_render", frame=frame)
    lit.rig.scene.frame_set(6)
    assert 1.2 < lit.sun.data.energy / math.pi < 1.8
    assert_lit_from(lit, axis_of(lit.sun), lit.sun.data.energy / math.pi)
    lit.rig.scene.frame_set(11)
    assert lit.rig.render()[lit.covered].max(axis=0)[0] == 0.0  # its hidden frame is black


def test_keyframed_sigma0_plays(lit: Lit) -> None:
    node = cdrf_node(lit.ball)
    for frame, value in ((1, 0.0), (3, 2.0 * SIGMA)):
        node.inputs["Sigma0"].default_value = value
        node.inputs["Sigma0"].keyframe_insert("default_value", frame=frame)
    curves = lit.ball.data.materials[0].node_tree.animation_data.action
    assert curves is not None
    lit.rig.scene.frame_set(2)
    assert abs(node.inputs["Sigma0"].default_value - SIGMA) < 1e-6
    assert_lit_from(lit, axis_of(lit.sun))


def test_moved_recoloured_and_stronger_point_light(rig: Rig) -> None:
    lamp = rig.light("POINT", energy=1.0, location=(0.0, -3.0, 0.0))
    ball = rig.sphere()
    bpy.ops.cdrf.setup()
    ball.data.materials[0].cdrf.sigma0 = SIGMA
    cdrf_node(ball).inputs["Base Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    normal, covered = rig.normals(ball)
    point, _ = rig.render_exact(ball, "Position", -1.01, 1.01)
    lamp.location = (2.0, -1.0, 1.0)
    lamp.data.energy = 4.0 * math.pi**2 * 6.0
    lamp.data.use_custom_distance, lamp.data.cutoff_distance = True, 1e3
    lamp.data.color = colour = (1.0, 0.5, 0.25)
    to_light = np.array(lamp.location) - point[covered]
    distance = np.linalg.norm(to_light, axis=1)
    cosine = (normal[covered] * to_light).sum(axis=1) / distance
    expected = 6.0 / distance**2 * sphere_reflectance(np.arccos(np.clip(cosine, -1.0, 1.0)), SIGMA)
    error = rig.render()[covered][:, :3] - expected[:, None] * colour
    assert np.abs(error).max() <= WRITTEN.worst * expected.max()


RENDER_ELSEWHERE = textwrap.dedent(
    """
    import sys
    import bpy
    assert not bpy.context.preferences.filepaths.use_scripts_auto_execute
    bpy.ops.wm.open_mainfile(filepath=sys.argv[1], use_scripts=False)
    assert not hasattr(bpy.types.Material, "cdrf")
    scene = bpy.context.scene
    scene.objects["Mover"].rotation_euler = (0.0, 0.0, 0.0)
    scene.render.filepath = sys.argv[2]
    bpy.ops.render.render(write_still=True)
    """
)


@pytest.mark.smoke
def test_file_renders_right_without_the_extension(lit: Lit, tmp_path: Path) -> None:
    """Saved, opened in a Blender that has never heard of CDRF, a light turned there, rendered."""
    mover = lit.rig.link(None, rotation=(0.5, 0.5, 0.5))
    mover.name = "Mover"
    lit.sun.rotation_euler = (1.1, 0.0, 0.6)
    lit.sun.parent = mover
    file, picture = tmp_path / "skin.blend", tmp_path / "frame.exr"
    bpy.ops.wm.save_as_mainfile(filepath=str(file), copy=True)
    script = tmp_path / "elsewhere.py"
    script.write_text(RENDER_ELSEWHERE)
    subprocess.run(
        [sys.executable, str(script), str(file), str(picture)],
        check=True,
        timeout=300,
        cwd=tmp_path,
    )
    image = bpy.data.images.load(str(picture))
    width, height = image.size
    pixels = np.array(image.pixels).reshape(height, width, 4)
    mover.rotation_euler = (0.0, 0.0, 0.0)
    direction = axis_of(lit.sun)
    cosine = np.clip(lit.normal[lit.covered] @ direction, -1.0, 1.0)
    error = pixels[lit.covered][:, 0] - sphere_reflectance(np.arccos(cosine), SIGMA)
    assert np.abs(error).max() <= WRITTEN.worst


def test_appended_material_brings_its_lights(lit: Lit, tmp_path: Path) -> None:
    lit.sun.rotation_euler = (1.0, 0.0, 0.5)
    direction = axis_of(lit.sun)
    here = lit.rig.render()
    file = tmp_path / "library.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file), copy=True)
    fresh = Rig()
    with bpy.data.libraries.load(str(file)) as (source, wanted):
        wanted.objects = [lit_name for lit_name in source.objects if "sphere" in lit_name.lower()]
    ball = wanted.objects[0]
    fresh.scene.collection.objects.link(ball)
    lamp = next(obj for obj in bpy.data.objects if obj.type == "LIGHT")
    fresh.scene.collection.objects.link(lamp)
    bpy.context.view_layer.update()
    assert np.allclose(axis_of(lamp), direction, atol=1e-6)
    assert np.abs(fresh.render() - here).max() <= WRITTEN.worst


RENDER_FRAMES = textwrap.dedent(
    """
    import sys
    import bpy
    assert not bpy.context.preferences.filepaths.use_scripts_auto_execute
    bpy.ops.wm.open_mainfile(filepath=sys.argv[1], use_scripts=False)
    assert not hasattr(bpy.types.Material, "cdrf")
    bpy.context.scene.render.filepath = sys.argv[2]
    bpy.ops.render.render(animation=True)
    """
)


def stage_of_moving_lights(rig: Rig) -> None:
    """Four kinds of light; parented, constrained and animated, in ways that add up."""
    rig.scene.frame_start, rig.scene.frame_end = 1, 3
    carousel = rig.link(None)
    for frame in (1, 3):
        carousel.rotation_euler = (0.2, 0.1, 0.8 * frame)
        carousel.keyframe_insert("rotation_euler", frame=frame)
    target = rig.link(None, location=(0.3, 0.0, 0.2))
    for frame in (1, 3):
        target.location.x = 0.4 * frame - 0.8
        target.keyframe_insert("location", frame=frame)

    sun = rig.light("SUN", name="Key", energy=1.0, angle=0.0, rotation=(1.0, 0.0, 0.4))
    sun.parent = carousel
    sun.scale = (2.0, 2.0, 2.0)
    spot = rig.light("SPOT", name="Spot", energy=150.0, location=(-2.0, -2.5, 1.0))
    spot.parent = carousel
    spot.data.spot_size = 0.8
    aim = spot.constraints.new("TRACK_TO")
    aim.target, aim.track_axis, aim.up_axis = target, "TRACK_NEGATIVE_Z", "UP_Y"
    point = rig.light("POINT", name="Point", energy=40.0, location=(0.0, -2.0, -1.5))
    follow = point.constraints.new("COPY_LOCATION")
    follow.target, follow.use_offset = target, True
    area = rig.light("AREA", name="Area", energy=60.0, location=(2.0, -2.0, 0.0), shape="DISK")
    turn = area.constraints.new("DAMPED_TRACK")
    turn.target, turn.track_axis = target, "TRACK_NEGATIVE_Z"
    for frame in (1, 3):
        point.data.color = (1.0, 0.3 * frame, 0.1)
        point.data.keyframe_insert("color", frame=frame)
        area.data.size = 0.2 * frame
        area.data.keyframe_insert("size", frame=frame)
        spot.data.energy = 100.0 * frame
        spot.data.keyframe_insert("energy", frame=frame)
    flicker = sun.data.driver_add("energy").driver
    variable = flicker.variables.new()
    variable.name, variable.type = "x", "TRANSFORMS"
    variable.targets[0].id = target
    flicker.expression = "1 + x"


@pytest.mark.smoke
def test_moving_mixed_lights_are_the_same_without_the_extension(rig: Rig, tmp_path: Path) -> None:
    """Three frames rendered here and in a Blender that knows nothing of CDRF, Auto-Run off."""
    rig.scene.render.resolution_x = rig.scene.render.resolution_y = 64
    stage_of_moving_lights(rig)
    ball = rig.sphere()
    bpy.context.view_layer.update()
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    ball.data.materials[0].cdrf.sigma0 = SIGMA
    file = tmp_path / "moving.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file), copy=True)
    script = tmp_path / "elsewhere.py"
    script.write_text(RENDER_FRAMES)
    command = [sys.executable, str(script), str(file), str(tmp_path / "frame")]
    subprocess.run(command, check=True, timeout=300, cwd=tmp_path)
    seen = []
    for frame in (1, 2, 3):
        rig.scene.frame_set(frame)
        here = rig.render()
        image = bpy.data.images.load(str(tmp_path / f"frame{frame:04d}.exr"))
        there = np.array(image.pixels).reshape(here.shape)
        assert np.abs(here - there).max() <= 1e-6
        seen.append(here[..., :3])
    # Every frame differs from the one before, and no light has come to rest.
    assert all(np.abs(b - a).max() > 0.1 for a, b in pairwise(seen))
    group = cdrf_node(ball).node_tree
    assert sum(ids.LIGHT_KEY in node for node in group.nodes) == 4
