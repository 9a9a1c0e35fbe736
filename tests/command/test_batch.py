# SPDX-License-Identifier: GPL-3.0-or-later
"""The batch renderer: its arguments, pictures, summary, and what failures lead to."""

from __future__ import annotations

import json
import subprocess
import sys
from argparse import ArgumentTypeError
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from rig import Rig

from cdrf_addon.command import batch_run
from cdrf_addon.command.batch_job import SceneJob, sigma0_label, unique_stems
from cdrf_addon.command.batch_options import parse_frames, parse_options, parse_resolution
from cdrf_addon.command.batch_summary import PictureRecord, SceneRecord

ROOT = Path(__file__).resolve().parents[2]
SMALL = ["--resolution", "32", "--samples", "1"]


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "cdrf_addon.batch_render", *map(str, arguments)]
    return subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=600
    )


def summary(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "summary.json").read_text())


def picture(path: Path) -> np.ndarray:
    image = bpy.data.images.load(str(path))
    width, height = image.size
    pixels = np.array(image.pixels).reshape(height, width, 4)
    bpy.data.images.remove(image)
    return pixels


@pytest.fixture
def meshes(rig: Rig, tmp_path: Path) -> dict[str, Path]:
    """One torus in each supported mesh format."""
    bpy.ops.mesh.primitive_torus_add()
    paths = {kind: tmp_path / f"ring.{kind}" for kind in ("obj", "ply", "stl", "glb")}
    bpy.ops.wm.obj_export(filepath=str(paths["obj"]), export_materials=False)
    bpy.ops.wm.ply_export(filepath=str(paths["ply"]))
    bpy.ops.wm.stl_export(filepath=str(paths["stl"]))
    bpy.ops.export_scene.gltf(filepath=str(paths["glb"]))
    return paths


@pytest.mark.parametrize(
    ("text", "frames"),
    [("7", [7]), ("1-3", [1, 2, 3]), ("1-9:4", [1, 5, 9]), ("1,4,8-9", [1, 4, 8, 9]), ("-2", [-2])],
)
def test_frames(text: str, frames: list[int]) -> None:
    assert parse_frames(text) == frames


@pytest.mark.parametrize("text", ["", "a", "5-1", "1-2-3", "1:0"])
def test_frames_that_are_none(text: str) -> None:
    with pytest.raises(ArgumentTypeError):
        parse_frames(text)


@pytest.mark.parametrize("text", ["0", "x", "640x", "10x10x10", "1x1", "99999"])
def test_resolutions_that_are_none(text: str) -> None:
    with pytest.raises(ArgumentTypeError):
        parse_resolution(text)


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["x.png"],
        ["x.obj", "--sigma0", "nan"],
        ["x.obj", "--sigma0", "-1"],
        ["x.obj", "--nonsense"],
    ],
)
def test_wrong_command_lines_exit_with_2(arguments: list[str], tmp_path: Path) -> None:
    assert batch_run.main([*arguments, "--output", str(tmp_path)]) == 2


@pytest.mark.smoke
def test_every_mesh_format_and_a_failure_among_them(
    meshes: dict[str, Path], tmp_path: Path
) -> None:
    broken = tmp_path / "broken.obj"
    broken.write_text("v 0 0 0\nv 1 0 0\n")
    out = tmp_path / "out"
    inputs = [meshes["obj"], broken, meshes["ply"], tmp_path / "absent.blend", meshes["stl"]]
    result = run(*inputs, meshes["glb"], "--output", out, *SMALL)
    assert result.returncode == 1, result.stdout + result.stderr
    found = summary(out)
    assert [s["state"] for s in found["scenes"]] == [
        "done",
        "failed",
        "done",
        "failed",
        "done",
        "done",
    ]
    assert found["failed"] == 2
    assert "no mesh with faces" in found["scenes"][1]["error"]
    assert "does not exist" in found["scenes"][3]["error"]
    for scene in found["scenes"]:
        for image in scene["images"]:
            assert np.isfinite(picture(Path(image["path"]))).all()
            assert picture(Path(image["path"]))[..., :3].max() > 0.2
        if scene["state"] == "done":
            assert set(scene["seconds"]) == {"load", "curvature and nodes", "render CDRF"}
    assert "3/6" in result.stdout


def test_sigma0_list_lambert_and_resume(meshes: dict[str, Path], tmp_path: Path) -> None:
    out = tmp_path / "out"
    arguments = (meshes["obj"], "--sigma0", "0.05", "0.3", "--frames", "1-2", "--lambert", *SMALL)
    first = run(*arguments, "--output", out)
    assert first.returncode == 0, first.stdout + first.stderr
    names = {path.name for path in out.iterdir()}
    assert "ring_s0.05_0001.png" in names and "ring_s0.3_0002.png" in names
    joined = picture(out / "ring_s0.3_0001_beside_lambert.png")
    assert joined.shape == (32, 64, 4)
    assert np.array_equal(joined[:, 32:], picture(out / "ring_s0.3_0001.png"))
    left, right = joined[:, :32, :3], joined[:, 32:, :3]
    assert np.abs(left - right).max() > 0.02, "translucency shows"
    assert len(summary(out)["scenes"][0]["images"]) == 4

    # As after a kill: one picture is missing. Only that one is made again.
    stamps = {p.name: p.stat().st_mtime_ns for p in out.glob("*_s0.05_*.png")}
    (out / "ring_s0.3_0002.png").unlink()
    second = run(*arguments, "--output", out)
    assert second.returncode == 0
    assert [i["resumed"] for i in summary(out)["scenes"][0]["images"]] == [True, True, True, False]
    assert stamps == {p.name: p.stat().st_mtime_ns for p in out.glob("*_s0.05_*.png")}


def test_prepared_scene_keeps_its_settings(rig: Rig, tmp_path: Path) -> None:
    rig.light("SUN", rotation=(1.0, 0.0, 0.5))
    bpy.ops.mesh.primitive_torus_add()
    obj = bpy.context.object
    bpy.ops.cdrf.setup()
    obj.data.materials[0].cdrf.sigma0 = 0.2
    rig.scene.render.resolution_x = rig.scene.render.resolution_y = 24
    file = tmp_path / "prepared.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file), copy=True)
    expected = rig.render()
    # A light added after the set-up is part of the batch's picture: it updates by itself.
    out = tmp_path / "out"
    result = run(file, "--output", out, "--format", "EXR", "--save-blend")
    assert result.returncode == 0, result.stdout + result.stderr
    made = picture(Path(summary(out)["scenes"][0]["images"][0]["path"]))
    assert np.abs(made - expected).max() <= 1e-3
    assert (out / "prepared.blend").exists()


def test_unique_stems() -> None:
    paths = [Path("a/x.obj"), Path("b/x.obj"), Path("x-2.ply")]
    assert unique_stems(paths) == ["x", "x-2", "x-2-2"]


def test_animated_sigma0_is_replaced_and_display_taken_off(rig: Rig, tmp_path: Path) -> None:
    rig.light("SUN", rotation=(1.0, 0.0, 0.9))
    bpy.ops.mesh.primitive_torus_add()
    obj = bpy.context.object
    bpy.ops.cdrf.setup()
    node = obj.data.materials[0].node_tree.nodes["CDRF"]
    for frame, value in ((1, 0.0), (3, 0.1)):
        node.inputs["Sigma0"].default_value = value
        node.inputs["Sigma0"].keyframe_insert("default_value", frame=frame)
    rig.scene.render.image_settings.file_format = "PNG"
    if hasattr(rig.scene.render.image_settings, "media_type"):
        rig.scene.render.image_settings.media_type = "VIDEO"
    bpy.ops.cdrf.show_curvature(display="ON")
    file = tmp_path / "animated.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file), copy=True)
    kept, forced = tmp_path / "kept", tmp_path / "forced"
    common = ("--frames", "3", "--lambert", *SMALL)
    assert run(file, "--output", kept, *common).returncode == 0
    assert run(file, "--output", forced, "--sigma0", "0.1", *common).returncode == 0
    notes = " ".join(summary(forced)["scenes"][0]["warnings"])
    assert "animated or connected" in notes and "showing its curvature" in notes
    lambert = picture(kept / "animated_lambert_0003.png")
    translucent = picture(kept / "animated_cdrf_0003.png")
    assert np.abs(lambert - translucent).max() > 0.02
    assert np.array_equal(translucent, picture(forced / "animated_s0.1_0003.png"))
    assert np.array_equal(lambert, picture(forced / "animated_lambert_0003.png"))


def test_journal_survives_a_kill_and_any_summary(meshes: dict[str, Path], tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run(meshes["obj"], "--frames", "1", "--output", out, *SMALL).returncode == 0
    (out / "summary.json").write_text('{"scenes": [{"images": [{"path": 1}]}]}')
    again = run(meshes["obj"], "--frames", "1-2", "--output", out, *SMALL)
    assert again.returncode == 0, again.stdout + again.stderr
    assert [image["resumed"] for image in summary(out)["scenes"][0]["images"]] == [True, False]


def test_close_sigmas_have_files_of_their_own() -> None:
    labels = {sigma0_label(value) for value in (0.123456789, 0.12345678, 0.1, 1.0, 1e-7)}
    assert labels == {"s0.123456789", "s0.12345678", "s0.1", "s1", "s1e-07"}


def test_the_order_and_the_answer_of_a_process_survive_json() -> None:
    line = ["a/x.obj", "y.blend", "--sigma0", "0.1", "0.2", "--ratio", "1", "0.5", "0"]
    line += ["--frames", "1-3", "--resolution", "64x32", "--output", "out", "--curvature"]
    options = parse_options(line)
    assert options.inputs == (Path("a/x.obj"), Path("y.blend"))
    assert (options.frames, options.resolution) == ((1, 2, 3), (64, 32))
    job = SceneJob(options.inputs[0], "x", options, {"out/x_s0.1_0001.png": "key"})
    assert SceneJob.from_json(json.dumps(job.as_json())) == job
    rendered = PictureRecord("p.png", "key", 1.5, frame=3, lambert="l.png", side_by_side="s.png")
    images = [PictureRecord("c.png", "key", resumed=True), rendered]
    record = SceneRecord("x.obj", "done", warnings=["a note"], images=images)
    written = json.loads(json.dumps(record.as_json()))
    assert set(written["images"][0]) == {"path", "key", "seconds", "resumed"}
    # The file's own scatter distance is null, and there.
    assert written["images"][1]["sigma0"] is None
    assert SceneRecord.from_json(written) == record
