# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure and Fit without Cycles: what they ask for, what they write, what survives."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np
import pytest
from rig import Rig, cdrf_node

from cdrf_addon import ids
from cdrf_addon.blender.material.model import ensure_chosen, profile_problem
from cdrf_addon.blender.material.scatter_distance import channel_sigma0, overridden
from cdrf_addon.blender.nodes.tables import ensure_table, find_table
from cdrf_addon.compat import ensure_node_tree
from cdrf_addon.core.measured.measurement import SphereMeasurement
from cdrf_addon.core.measured.model import measured_model
from cdrf_addon.core.reflectance.model import MEASURED, RING, SPHERE
from cdrf_addon.core.reflectance.sphere_model import sphere_reflectance
from cdrf_addon.measuring.request import Request
from cdrf_addon.ui.operators import measure as ops_measure

COSINE = np.linspace(-0.96, 0.96, 64)
SCALES = 2.0 ** np.arange(-8.0, 3.0, 0.5)
# Blue has the smallest radius and scatters furthest: its albedo is the highest.
SLOPES, RADIUS = (0.5, 1.0, 3.0), (0.02, 0.02, 0.015)
WIDTHS = np.multiply(SLOPES, RADIUS)
# A fit to exact data whose widths saturate: the median of what is not yet bent.
FITTED = 0.03
asked: list[Request] = []


def spheres(request: Request) -> SphereMeasurement:
    theta = np.arccos(COSINE)
    values = [
        [sphere_reflectance(theta, 0.6 * np.tanh(slope * scale / 0.6)) for slope in SLOPES]
        for scale in SCALES
    ]
    errors = np.full((len(SCALES), 3, len(COSINE)), 1e-4)
    return SphereMeasurement(request.albedo, SCALES, COSINE, values, errors)  # type: ignore[arg-type]


@pytest.fixture
def material(rig: Rig, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> bpy.types.Material:
    """A translucent material on a torus, and a path tracer that answers at once."""

    def steps(request: Request, _folder: Path) -> Iterator[tuple[float, str]]:
        asked.append(request)
        yield 0.5, "half"
        return spheres(request)  # type: ignore[return-value]

    asked.clear()
    monkeypatch.setattr(ops_measure, "measure_steps", steps)
    monkeypatch.setattr(ops_measure, "cache_folder", lambda: tmp_path)
    rig.light("SUN", angle=0.0)
    bpy.ops.mesh.primitive_torus_add(major_segments=32, minor_segments=16)
    obj = bpy.context.object
    material = bpy.data.materials.new("Skin")
    tree = ensure_node_tree(material)
    tree.nodes.clear()
    node = tree.nodes.new("ShaderNodeSubsurfaceScattering")
    node.falloff = "RANDOM_WALK"
    node.inputs["Color"].default_value = (0.3, 0.5, 0.9, 1.0)
    node.inputs["Radius"].default_value = RADIUS
    node.inputs["Scale"].default_value = 1.0
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    obj.data.materials.append(material)
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    return material


def own_sigma0(material: bpy.types.Material) -> np.ndarray:
    return np.array(channel_sigma0(material))


def test_a_script_gets_the_materials_own_scattering(material: bpy.types.Material) -> None:
    assert bpy.ops.cdrf.measure() == {"FINISHED"}
    assert asked[0].albedo == pytest.approx((0.3, 0.5, 0.9))
    assert asked[0].method == "RANDOM_WALK"
    assert asked[0].all_views  # a torus is no sphere
    assert bpy.ops.cdrf.measure(albedo=(0.7, 0.7, 0.7), energy="MEASURED") == {"FINISHED"}
    assert asked[1].albedo == pytest.approx((0.7, 0.7, 0.7))
    assert not asked[1].all_views


def test_measured_means_the_sigma0_of_the_widest_channel(material: bpy.types.Material) -> None:
    assert bpy.ops.cdrf.measure(energy="MEASURED") == {"FINISHED"}
    assert material.cdrf.model == MEASURED
    assert material.cdrf.sigma0 == pytest.approx(WIDTHS.max(), rel=FITTED)
    table = find_table(material.cdrf.measured)
    assert table is not None and max(table.moments) == pytest.approx(1.0)
    assert own_sigma0(material) == pytest.approx(WIDTHS, rel=FITTED)


def test_changing_the_model_again_and_again_leaves_the_slider(material: bpy.types.Material) -> None:
    bpy.ops.cdrf.measure(energy="MEASURED")
    first = material.cdrf.sigma0, own_sigma0(material)
    for kind in (SPHERE, MEASURED, RING, MEASURED) * 2:
        assert bpy.ops.cdrf.set_model(model=kind) == {"FINISHED"}
        assert material.cdrf.sigma0 == pytest.approx(first[0], rel=1e-5)
        assert own_sigma0(material) == pytest.approx(first[1], rel=1e-5)


def test_the_fit_is_right_at_the_middle_curvature(material: bpy.types.Material) -> None:
    assert bpy.ops.cdrf.fit() == {"FINISHED"}
    kappa = bpy.context.object.data.cdrf.median
    expected = 0.6 * np.tanh(WIDTHS * kappa / 0.6) / kappa
    assert own_sigma0(material) == pytest.approx(expected, rel=FITTED)
    assert material.cdrf.model == SPHERE
    picture = bpy.data.images[ids.FIT_IMAGE]
    assert picture.packed_file is not None and min(picture.size) > 500


def test_the_fit_leaves_the_walks_mean_free_path(material: bpy.types.Material) -> None:
    assert material.cdrf.view_dependence
    node = cdrf_node(bpy.context.object)

    def lengths() -> np.ndarray:
        return own_sigma0(material) * np.array(node.inputs[ids.FREE_PATH].default_value)

    before, fitted = lengths(), own_sigma0(material)
    assert bpy.ops.cdrf.fit() == {"FINISHED"}
    assert np.abs(own_sigma0(material) - fitted).max() > 0.01 * fitted.max()
    assert lengths() == pytest.approx(before, rel=1e-5)


def test_the_measured_table_stays_in_the_file_while_another_model_is_used(
    material: bpy.types.Material, tmp_path: Path
) -> None:
    bpy.ops.cdrf.measure(energy="MEASURED")
    bpy.ops.cdrf.set_model(model=SPHERE)
    path = tmp_path / "kept.blend"
    for _ in range(3):
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        bpy.ops.wm.open_mainfile(filepath=str(path))
    assert bpy.ops.cdrf.set_model(model=MEASURED) == {"FINISHED"}


def test_a_deleted_measured_table_is_said(material: bpy.types.Material) -> None:
    bpy.ops.cdrf.measure()
    table = find_table(material.cdrf.measured)
    assert table is not None
    bpy.data.images.remove(table.image)
    key, sentence = ensure_chosen(material)
    assert key == SPHERE and "measure it again" in sentence
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    assert material.cdrf.model == SPHERE


def test_a_deleted_profile_with_unreadable_text_is_a_way_out_too(
    material: bpy.types.Material,
) -> None:
    material.cdrf.model = "PROFILE"
    material.cdrf.profile = "garbage"
    node = cdrf_node(bpy.context.object)
    table = find_table(node.node_tree[ids.MODEL_KEY])
    assert table is not None
    bpy.data.images.remove(table.image)
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    assert material.cdrf.model == SPHERE
    assert bpy.ops.cdrf.preset(preset="SKIN_LAYERED") == {"FINISHED"}
    assert material.cdrf.model == "PROFILE"
    assert profile_problem(material) == ""


def test_what_moves_sigma0_is_named(material: bpy.types.Material) -> None:
    assert overridden(material) == ""
    socket = cdrf_node(bpy.context.object).inputs[ids.SIGMA0]
    socket.default_value = 0.1
    socket.keyframe_insert("default_value", frame=1)
    assert "animated" in overridden(material)
    value = material.node_tree.nodes.new("ShaderNodeValue")
    material.node_tree.links.new(value.outputs[0], socket)
    assert "connected" in overridden(material)


def test_presets_leave_the_papers_model(material: bpy.types.Material) -> None:
    bpy.ops.cdrf.set_model(model=RING)
    bpy.ops.cdrf.preset(preset="MARBLE")
    assert material.cdrf.model == RING


def test_tables_that_nobody_uses_are_removed(material: bpy.types.Material) -> None:
    material.cdrf.model = "PROFILE"
    for width in range(2, 6):
        material.cdrf.profile = f"1 0.5 1 1; {width} 0.5 0 0"
    tables = [image for image in bpy.data.images if image.get(ids.ROLE_KEY) == ids.ROLE_LUT]
    assert len(tables) == 1


@pytest.mark.parametrize("radius", [(0.0, 0.0, 0.0), (float("inf"), 1.0, 1.0)])
def test_impossible_radii_are_refused(
    material: bpy.types.Material, radius: tuple[float, float, float]
) -> None:
    with pytest.raises(RuntimeError, match="scatter radius"):
        bpy.ops.cdrf.measure(radius=radius)
    assert not asked


def test_energy_kept_is_the_mean_of_lambert() -> None:
    model, _ = measured_model(spheres(Request((0.3, 0.5, 0.9))), RADIUS, keep_energy=True)
    node, weight = np.polynomial.legendre.leggauss(200)
    for sigma in (1e-6, 1e-3, 0.03, 0.3, 1.0, 5.0):
        values = model.evaluate(np.arccos(node), sigma)
        # The corner of Lambert between two of the nodes.
        assert (weight @ values) / 2.0 == pytest.approx([0.25] * 3, abs=2e-4)
        assert np.diff(values, axis=0).min() >= -1e-9  # node and cosine rise together
    assert ensure_table(model).colour
