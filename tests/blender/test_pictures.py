# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures are rendered whole, read as they were written, and joined side by side."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest
from rig import Rig

from cdrf_addon.blender import pictures, units

# Half a step of an 8-bit channel.
ROUNDED = 0.5 / 255.0 + 1e-6


def written(path: Path, pixels: np.ndarray) -> Path:
    """A file of those pixels, (height, width, 4)."""
    height, width = pixels.shape[:2]
    floating = path.suffix == ".exr"
    image = bpy.data.images.new("Picture", width, height, float_buffer=floating, is_data=True)
    pictures.set_pixels(image, pixels)
    image.file_format = "OPEN_EXR" if floating else "PNG"
    image.filepath_raw = str(path)
    image.save()
    bpy.data.images.remove(image)
    return path


def chequers(seed: int) -> np.ndarray:
    pixels = np.ones((6, 5, 4), dtype=np.float32)
    pixels[..., :3] = np.random.default_rng(seed).random((6, 5, 3), dtype=np.float32)
    return pixels


@pytest.mark.smoke
@pytest.mark.parametrize(("suffix", "error"), [(".png", ROUNDED), (".exr", 1e-3)])
def test_two_pictures_are_joined_left_and_right(
    rig: Rig, tmp_path: Path, suffix: str, error: float
) -> None:
    left, right = (written(tmp_path / f"{n}{suffix}", chequers(n)) for n in (1, 2))
    images = set(bpy.data.images)
    target = tmp_path / f"joined{suffix}"
    pictures.side_by_side(left, right, target)
    joined = pictures.read_picture(target, as_data=True)
    assert np.abs(joined - np.hstack((chequers(1), chequers(2)))).max() <= error
    assert set(bpy.data.images) == images
    assert {path.name for path in tmp_path.iterdir()} == {left.name, right.name, target.name}


def test_a_render_appears_whole_and_leaves_the_settings(rig: Rig, tmp_path: Path) -> None:
    rig.scene.render.filepath, rig.scene.render.use_overwrite = "//elsewhere", False
    path = tmp_path / "picture.exr"
    pictures.render_to(path)
    assert [found.name for found in tmp_path.iterdir()] == [path.name]
    assert pictures.read_picture(path).shape[:2] == (96, 96)
    assert rig.scene.render.filepath == "//elsewhere" and not rig.scene.render.use_overwrite


def test_a_scene_without_units_counts_in_metres(rig: Rig) -> None:
    settings = rig.scene.unit_settings
    settings.system, settings.scale_length = "METRIC", 0.01
    assert units.metres_per_unit(rig.scene) == pytest.approx(0.01)
    settings.system = "NONE"
    assert units.metres_per_unit(rig.scene) == 1.0
    assert "cm" in units.length_text(0.24)
