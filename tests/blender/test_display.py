# SPDX-License-Identifier: GPL-3.0-or-later
"""The curvature display: what it shows, its legend, and the way back."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest
from rig import Rig

from cdrf_addon import ids
from cdrf_addon.blender.pictures import read_picture
from cdrf_addon.core.colour_scale import HOT, MARK_COLOUR, SIGNED, colours, srgb, ticks

# Blender keeps a colour ramp as a table of 257 texels.
RAMP = 5e-3


def egg(rig: Rig) -> bpy.types.Object:
    obj = rig.sphere()
    obj.scale = (1.0, 1.0, 1.4)
    bpy.ops.object.transform_apply(scale=True)
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    return obj


@pytest.mark.smoke
def test_colours_and_marks() -> None:
    assert colours((0.0, 1 / 3, 0.5, 1.0), HOT).tolist() == [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 0.5, 0.0],
        [1.0, 1.0, 1.0],
    ]
    assert colours(0.5, SIGNED).tolist() == [0.5, 0.5, 0.5]
    assert srgb(np.array((0.0, 0.0021404, 0.2140411, 1.0))) == pytest.approx(
        (0.0, 0.027654, 0.5, 1.0), abs=1e-4
    )
    # A unit of a millimetre: 0.5 per unit is 500 per metre, a radius of 2 mm.
    assert ticks(-0.5, 0.5, 1e-3)[-1] == (1.0, "500 /m  r 2 mm")
    assert ticks(-0.5, 0.5, 1e-3)[2] == (0.5, "0 /m  flat")
    assert [text for _, text in ticks(0.0, 40.0, 1.0)][1] == "10 /m  r 10 cm"


def test_pixels_have_the_colours_of_the_legend(rig: Rig) -> None:
    obj = egg(rig)
    values = np.tile(np.array((2.0, 2.0, -1.0, 0.5), dtype=np.float32), (len(obj.data.vertices), 1))
    obj.data.attributes[ids.CURVATURE_ATTRIBUTE].data.foreach_set("color", values.ravel())
    known = obj.data.cdrf
    known.low, known.high, known.mean_high = 1.0, 4.0, 1.0
    for quantity, part, scale in (("KAPPA", 1 / 3, HOT), ("MEAN", 0.75, SIGNED)):
        bpy.ops.cdrf.show_curvature(display="ON", quantity=quantity)
        pixels = rig.render()
        covered = pixels[..., 3] > 0.999
        assert np.abs(pixels[covered][:, :3] - colours(part, scale)).max() <= RAMP
    kept = rig.scene[ids.DISPLAY_KEY]
    assert (kept["low"], kept["high"]) == (-1.0, 1.0)


@pytest.mark.smoke
def test_filled_vertices_are_green(rig: Rig) -> None:
    obj = egg(rig)
    marks = obj.data.attributes.new(ids.FILLED_ATTRIBUTE, "FLOAT", "POINT")
    marks.data.foreach_set("value", np.ones(len(obj.data.vertices), dtype=np.float32))
    bpy.ops.cdrf.show_curvature(display="ON")
    pixels = rig.render()
    covered = pixels[..., 3] > 0.999
    assert np.abs(pixels[covered][:, :3] - MARK_COLOUR).max() <= RAMP


def test_a_mesh_with_a_hub_has_its_tip_marked(rig: Rig) -> None:
    bpy.ops.mesh.primitive_cone_add(vertices=400, radius1=1.0, depth=1.0)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.subdivide(number_cuts=3)
    bpy.ops.object.mode_set(mode="OBJECT")
    obj = bpy.context.object
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    marks = np.empty(len(obj.data.vertices), dtype=np.float32)
    obj.data.attributes[ids.FILLED_ATTRIBUTE].data.foreach_get("value", marks)
    assert 0 < marks.sum() < len(marks) / 10
    assert "join too many edges" in obj.data.cdrf.warnings
    bpy.ops.cdrf.remove()
    assert ids.FILLED_ATTRIBUTE not in obj.data.attributes


@pytest.mark.smoke
def test_the_view_comes_back(rig: Rig) -> None:
    obj = egg(rig)
    view = rig.scene.view_settings
    view.view_transform, view.exposure = "AgX", 1.5
    look = view.look
    nodes = {node.name for node in obj.data.materials[0].node_tree.nodes}
    for quantity in ("KAPPA", "DIFFUSED", "MEAN"):
        bpy.ops.cdrf.show_curvature(display="ON", quantity=quantity)
        assert view.view_transform == "Standard"
        assert rig.scene[ids.DISPLAY_KEY]["quantity"] == quantity
    bpy.ops.cdrf.show_curvature(display="OFF")
    assert (view.view_transform, view.look, view.exposure) == ("AgX", look, 1.5)
    assert ids.DISPLAY_KEY not in rig.scene
    assert {node.name for node in obj.data.materials[0].node_tree.nodes} == nodes


def test_removing_the_last_translucent_material_brings_the_view_back(rig: Rig) -> None:
    egg(rig)
    rig.scene.view_settings.view_transform = "AgX"
    bpy.ops.cdrf.show_curvature(display="ON")
    bpy.ops.cdrf.remove()
    assert rig.scene.view_settings.view_transform == "AgX"
    assert ids.DISPLAY_KEY not in rig.scene


def test_the_curvature_as_rendered(rig: Rig) -> None:
    obj = egg(rig)
    mesh = obj.data
    levels = np.tile(np.array((4.0, 3.0, 2.0, 1.0), dtype=np.float32), (len(mesh.vertices), 1))
    mesh.attributes[ids.DIFFUSED_ATTRIBUTE].data.foreach_set("color", levels.ravel())
    mesh.cdrf.low, mesh.cdrf.high = 1.0, 4.0
    for sigma0, part in ((0.0, 1.0), (1e4, 0.0)):
        obj.data.materials[0].cdrf.sigma0 = sigma0
        bpy.ops.cdrf.show_curvature(display="ON", quantity="DIFFUSED")
        pixels = rig.render()
        covered = pixels[..., 3] > 0.999
        assert np.abs(pixels[covered][:, :3] - colours(part, HOT)).max() <= RAMP


@pytest.mark.smoke
def test_a_saved_picture_has_a_legend_and_changes_nothing(rig: Rig, tmp_path: Path) -> None:
    egg(rig)
    rig.scene.render.resolution_x, rig.scene.render.resolution_y = 320, 240
    rig.scene.render.engine = "CYCLES"
    before = rig.scene.render.image_settings.file_format, rig.scene.view_settings.view_transform
    path = tmp_path / "curvature.png"
    assert bpy.ops.cdrf.save_curvature(filepath=str(path)) == {"FINISHED"}
    pixels = read_picture(path)
    assert pixels.shape == (240, 320, 4)
    legend = pixels[:200, 10:18, :3].reshape(-1, 3)
    # Black, red, yellow and white of the bar, and white letters beside it.
    for colour in ((0, 0, 0), (1, 0, 0), (1, 1, 0), (1, 1, 1)):
        assert np.abs(legend - colour).max(axis=1).min() <= 0.05, colour
    letters = pixels[:200, 22:120]
    assert (letters[..., :3].min(axis=-1) > 0.9).sum() > 20
    after = rig.scene.render.image_settings.file_format, rig.scene.view_settings.view_transform
    assert after == before
    assert rig.scene.render.engine == "CYCLES"
    assert ids.DISPLAY_KEY not in rig.scene


def test_without_a_camera_or_a_saved_file_it_says_what_to_do(rig: Rig) -> None:
    egg(rig)
    with pytest.raises(RuntimeError, match="Save the file first"):
        bpy.ops.cdrf.save_curvature(filepath="//curvature.png")
    rig.scene.camera = None
    assert not bpy.ops.cdrf.save_curvature.poll()


def test_video_and_stereo_settings_survive_a_saved_picture(rig: Rig, tmp_path: Path) -> None:
    egg(rig)
    rig.scene.render.resolution_x = rig.scene.render.resolution_y = 100
    settings = rig.scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "VIDEO"
    settings.file_format = "FFMPEG"
    rig.scene.render.use_multiview = True
    assert bpy.ops.cdrf.save_curvature(filepath=str(tmp_path / "head.001")) == {"FINISHED"}
    assert (tmp_path / "head.001.png").exists()
    assert settings.file_format == "FFMPEG"
    assert rig.scene.render.use_multiview
    assert ids.DISPLAY_KEY not in rig.scene
    with pytest.raises(RuntimeError, match="Choose a name"):
        bpy.ops.cdrf.save_curvature(filepath=str(tmp_path))


@pytest.mark.smoke
def test_the_display_can_be_switched_off_whatever_became_of_the_objects(rig: Rig) -> None:
    obj = egg(rig)
    rig.scene.view_settings.view_transform = "AgX"
    bpy.ops.cdrf.show_curvature(display="ON")
    bpy.data.objects.remove(obj)
    assert bpy.ops.cdrf.show_curvature() == {"FINISHED"}
    assert rig.scene.view_settings.view_transform == "AgX"
    assert ids.DISPLAY_KEY not in rig.scene


def test_a_view_chosen_meanwhile_stays(rig: Rig) -> None:
    egg(rig)
    view = rig.scene.view_settings
    view.view_transform = "AgX"
    bpy.ops.cdrf.show_curvature(display="ON")
    view.view_transform = "Filmic"
    bpy.ops.cdrf.show_curvature(display="OFF")
    assert view.view_transform == "Filmic"


def test_nothing_is_shown_without_an_output(rig: Rig) -> None:
    obj = egg(rig)
    tree = obj.data.materials[0].node_tree
    tree.nodes.remove(tree.nodes[ids.OUTPUT_NODE])
    with pytest.raises(RuntimeError, match="press Update first"):
        bpy.ops.cdrf.show_curvature(display="ON")
    assert ids.DISPLAY_KEY not in rig.scene


def test_an_object_set_up_meanwhile_is_shown_too(rig: Rig) -> None:
    egg(rig)
    bpy.ops.cdrf.show_curvature(display="ON")
    other = egg(rig)
    tree = other.data.materials[0].node_tree
    assert ids.DISPLAY_NODE in tree.nodes
