# SPDX-License-Identifier: GPL-3.0-or-later
"""The fit command: its arguments, its files, its exit codes, and its figure."""

from __future__ import annotations

import json
import time
from pathlib import Path

import bpy
import numpy as np
import pytest
from rig import Rig

from cdrf_addon.command import fit_run
from cdrf_addon.command.fit_options import parse_options
from cdrf_addon.compat import ensure_node_tree
from cdrf_addon.core.errors import MeasurementError
from cdrf_addon.core.measured.material_fit import fit_material
from cdrf_addon.core.measured.measurement import SphereMeasurement, load
from cdrf_addon.core.measured.model import MeasuredModel
from cdrf_addon.core.reflectance.sphere_model import sphere_reflectance
from cdrf_addon.measuring import process
from cdrf_addon.measuring.figure import decades, draw_fit, steps
from cdrf_addon.measuring.plot import open_in_blender
from cdrf_addon.measuring.raster import Raster
from cdrf_addon.measuring.request import QUALITIES, Quality


@pytest.mark.smoke
def test_the_command_writes_its_three_files(
    rig: object,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    # Few paths; many columns, as the fit needs the terminator.
    monkeypatch.setitem(QUALITIES, "preview", Quality((64, 8), 2, 2))
    out = tmp_path / "out"
    arguments = ["--color", "0.9", "0.8", "0.7", "--radius", "1", "0.5", "0", "--scale", "2"]
    arguments += ["--unit", "mm", "--quality", "preview", "--no-cache", "--output", str(out)]
    assert fit_run.main(arguments) == 0
    assert sorted(path.name for path in out.iterdir() if path.suffix != ".npz") == [
        "fit.json",
        "fit.png",
    ]
    found = json.loads((out / "fit.json").read_text())
    red, green, blue = (found["channels"][name] for name in ("red", "green", "blue"))
    assert red["radius_metres"] == pytest.approx(0.002)
    assert red["sigma0_metres"]["ring"] == pytest.approx(
        0.002 * red["sigma0_per_radius"]["ring"], rel=1e-6
    )
    assert red["sigma0_per_radius"]["sphere"] > 0.1
    assert green["radius_metres"] == pytest.approx(0.001)
    assert blue["sigma0_metres"]["sphere"] == 0.0
    measurement = load(out / "measured.npz")
    assert len(red["spheres"]) == len(measurement.scales)
    assert measurement.albedo == pytest.approx([0.9, 0.8, 0.7])
    printed = capsys.readouterr().out
    assert "σ = σ0 κ holds" in printed
    assert "fit.json" in printed
    image = open_in_blender(out / "fit.png", "CDRF Fit")
    assert min(image.size) > 900
    again = open_in_blender(out / "fit.png", "CDRF Fit")
    assert [image.name for image in bpy.data.images] == ["CDRF Fit"]
    assert again.packed_file is not None


@pytest.mark.parametrize(
    "arguments",
    [
        ["--color", "0", "0.5", "0.5"],
        ["--color", "1.2", "0.5", "0.5"],
        ["--color", "0.5", "0.5"],
        ["--radius", "nan", "1", "1"],
        ["--radius", "0", "0", "0"],
        ["--scale", "0"],
        ["--scale", "-1"],
        ["--seed", "-1"],
        ["--quality", "best"],
        ["--unit", "inch"],
        ["--nonsense"],
    ],
)
def test_wrong_command_lines_exit_with_2(arguments: list[str], tmp_path: Path) -> None:
    assert fit_run.main([*arguments, "--output", str(tmp_path)]) == 2
    assert list(tmp_path.iterdir()) == []


def test_help_teaches(capsys: pytest.CaptureFixture[str]) -> None:
    assert fit_run.main(["--help"]) == 0
    printed = capsys.readouterr().out
    for word in ("examples", "--color", "mm", "sigma0", "cache"):
        assert word in printed


def test_a_failure_exits_with_1(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = tmp_path / "broken.py"
    broken.write_text("raise RuntimeError('no such device')\n")
    monkeypatch.setattr(process, "WORKER", broken)
    assert fit_run.main(["--no-cache", "--output", str(tmp_path / "out")]) == 1
    assert "no such device" in capsys.readouterr().out
    assert list((tmp_path / "out").iterdir()) == []


def test_ctrl_c_ends_the_child_and_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupt(_: float) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(time, "sleep", interrupt)
    assert fit_run.main(["--no-cache", "--output", str(tmp_path / "out")]) == 130
    assert "Stopped" in capsys.readouterr().out
    assert list((tmp_path / "out").iterdir()) == []


def test_a_material_of_a_file_is_read(rig: Rig, tmp_path: Path) -> None:
    rig.scene.unit_settings.system = "METRIC"
    rig.scene.unit_settings.scale_length = 0.1
    for name, scale in (("Wax", 0.5), ("Paint", 0.0)):
        material = bpy.data.materials.new(name)
        material.use_fake_user = True
        scatter = ensure_node_tree(material).nodes["Principled BSDF"].inputs
        scatter["Base Color"].default_value = (0.0, 0.6, 0.7, 1.0)
        scatter["Subsurface Weight"].default_value = 1.0 if scale else 0.0
        scatter["Subsurface Radius"].default_value = (1.0, 0.5, 0.2)
        scatter["Subsurface Scale"].default_value = scale
    blend = tmp_path / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    options = fit_run.read_material(parse_options(["--blend", str(blend)]), blend)
    assert options.color == pytest.approx((fit_run.LEAST_ALBEDO, 0.6, 0.7))
    assert options.radius_metres == pytest.approx([0.05, 0.025, 0.01])
    chosen = parse_options(["--blend", str(blend), "--material", "Paint"])
    with pytest.raises(MeasurementError, match=r"'Paint' does not scatter.*Wax"):
        fit_run.read_material(chosen, blend)


def test_the_figure_holds_what_was_drawn(rig: object, tmp_path: Path) -> None:
    cosine = np.linspace(-0.96, 0.96, 60)
    scales = 2.0 ** np.arange(-7.0, 1.0)
    exact = sphere_reflectance(np.arccos(cosine)[None, None, :], 2.0 * scales[:, None, None])
    values = np.repeat(exact, 3, axis=1)
    measurement = SphereMeasurement(
        np.full(3, 0.8), scales, cosine, values, np.full_like(values, 1e-3)
    )
    path = tmp_path / "figure.png"
    draw_fit(MeasuredModel(measurement), fit_material(measurement), path)
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    pixels = np.array(image.pixels).reshape(image.size[1], image.size[0], 4)
    # Paper, ink and all four colours of the curves; something in each third.
    assert (pixels[..., :3].min(axis=-1) > 0.99).mean() > 0.7
    for colour in ((0.84, 0.37, 0.0), (0.0, 0.38, 0.78), (0.13, 0.13, 0.15)):
        near = np.abs(pixels[..., :3] - colour).max(axis=-1) < 0.03
        assert all(part.sum() > 20 for part in np.array_split(near, 3, axis=1))


def test_marks_are_round() -> None:
    assert [text for _, text in steps(0.0, 1.3)] == ["0", "0.5", "1"]
    assert [text for _, text in decades(0.004, 2.0)] == ["0.01", "0.1", "1"]


def test_lines_cover_as_much_as_they_are_wide() -> None:
    raster = Raster(60, 40)
    raster.line([(10.0, 10.3), (50.0, 30.7)], (0.0, 0.0, 0.0), 3.0)
    covered = float((1.0 - raster.pixels[..., 0]).sum())
    length = float(np.hypot(40.0, 20.4))
    assert covered == pytest.approx(3.0 * length + np.pi * 1.5**2, rel=0.05)
    assert raster.pixels.min() >= 0.0
    clipped = Raster(60, 40)
    clipped.line([(-100.0, 20.0), (200.0, 20.0)], (0.0, 0.0, 0.0), 2.0, clip=(10, 0, 30, 40))
    assert (clipped.pixels[:, :10] == 1.0).all()
    assert (clipped.pixels[:, 30:] == 1.0).all()
    assert clipped.pixels[20, 20, 0] < 0.01


def test_dashes_leave_gaps() -> None:
    raster = Raster(100, 9)
    raster.line([(0.0, 4.5), (100.0, 4.5)], (0.0, 0.0, 0.0), 2.0, dash=(10.0, 10.0))
    row = raster.pixels[4, :, 0] < 0.5
    assert row.mean() == pytest.approx(0.6, abs=0.12)  # round ends
    assert np.count_nonzero(np.diff(row.astype(int)) == 1) >= 4
