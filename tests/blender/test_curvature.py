# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator's curvature: how it is measured, and what is left out."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from rig import Rig, cdrf_node

from cdrf_addon import ids
from cdrf_addon.core.curvature.estimators import METHODS
from cdrf_addon.core.curvature.summary import FLAT, VARYING


def ring() -> bpy.types.Object:
    bpy.ops.mesh.primitive_torus_add(
        major_radius=1.0, minor_radius=0.4, major_segments=96, minor_segments=48
    )
    return bpy.context.object


def stored(mesh: bpy.types.Mesh, name: str) -> np.ndarray:
    values = np.empty(4 * len(mesh.vertices), dtype=np.float32)
    mesh.attributes[name].data.foreach_get("color", values)
    return values.reshape(-1, 4)


@pytest.mark.smoke
@pytest.mark.parametrize("method", list(METHODS))
def test_every_method_from_the_operator(rig: Rig, method: str) -> None:
    obj = ring()
    assert bpy.ops.cdrf.setup(method=method) == {"FINISHED"}
    k1 = stored(obj.data, ids.CURVATURE_ATTRIBUTE)[:, 1]
    assert np.abs(k1 - 2.5).max() <= 0.1
    assert obj.data.cdrf.method == method
    # Update keeps the method; nothing has changed, so nothing is measured again.
    obj.data.attributes[ids.CURVATURE_ATTRIBUTE].data[0].color = (9.0, 9.0, 9.0, 9.0)
    bpy.ops.cdrf.update()
    assert obj.data.attributes[ids.CURVATURE_ATTRIBUTE].data[0].color[0] == 9.0
    obj.data.vertices[5].co *= 1.01
    obj.data.update()
    bpy.ops.cdrf.update()
    assert obj.data.cdrf.method == method
    assert obj.data.attributes[ids.CURVATURE_ATTRIBUTE].data[0].color[0] < 9.0


@pytest.mark.smoke
def test_levels_are_stored_in_world_units(rig: Rig) -> None:
    obj = ring()
    bpy.ops.cdrf.setup()
    area = 4.0 * math.pi**2 * 0.4
    length = obj.data.attributes[ids.LENGTH_ATTRIBUTE].data[7].value
    assert length == pytest.approx(math.sqrt(area) / 256.0, rel=0.01)
    levels = stored(obj.data, ids.DIFFUSED_ATTRIBUTE)
    kappa = stored(obj.data, ids.CURVATURE_ATTRIBUTE)[:, 0]
    assert np.abs(levels[:, 0] - kappa).max() <= 0.02 * kappa.max()
    assert (np.diff(levels.std(axis=0)) < 0.0).all()
    assert levels.mean(axis=0) == pytest.approx(np.full(4, kappa.mean()), rel=0.05)


@pytest.mark.parametrize("kind", ["plane", "cube", "prism"])
def test_flat_faces_have_no_curvature(rig: Rig, kind: str) -> None:
    if kind == "plane":
        bpy.ops.mesh.primitive_grid_add(x_subdivisions=20, y_subdivisions=20)
    elif kind == "cube":
        bpy.ops.mesh.primitive_cube_add()
    else:
        bpy.ops.mesh.primitive_cylinder_add(vertices=5)
    obj = bpy.context.object
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    assert obj.data.cdrf.kind == FLAT
    assert ids.CURVATURE_ATTRIBUTE not in obj.data.attributes
    assert ids.DIFFUSED_ATTRIBUTE not in obj.data.attributes


def test_a_rounded_cube_bends(rig: Rig) -> None:
    bpy.ops.mesh.primitive_cube_add()
    obj = bpy.context.object
    obj.modifiers.new("Bevel", "BEVEL").segments = 4
    bpy.ops.object.modifier_apply(modifier="Bevel")
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    assert obj.data.cdrf.kind == VARYING


def drum() -> bpy.types.Object:
    """A flat ring from radius 0.2 to 1, and from its rim a cylinder of radius 1 downwards."""
    profile = [(0.2 + 0.1 * i, 0.0) for i in range(8)] + [(1.0, -0.1 * i) for i in range(9)]
    around = np.arange(64) * 2.0 * np.pi / 64
    vertices = [(r * np.cos(a), r * np.sin(a), z) for r, z in profile for a in around]
    faces = [
        (64 * i + j, 64 * (i + 1) + j, 64 * (i + 1) + (j + 1) % 64, 64 * i + (j + 1) % 64)
        for i in range(len(profile) - 1)
        for j in range(64)
    ]
    mesh = bpy.data.meshes.new("Drum")
    mesh.from_pydata(vertices, [], faces)
    obj = bpy.data.objects.new("Drum", mesh)
    bpy.context.scene.collection.objects.link(obj)
    obj.select_set(True)
    return obj


@pytest.mark.smoke
def test_split_creases_from_the_operator(rig: Rig) -> None:
    obj = drum()
    bpy.ops.cdrf.setup(crease_angle=math.radians(40.0))
    split = stored(obj.data, ids.CURVATURE_ATTRIBUTE)[:, 0]
    bpy.ops.cdrf.setup()
    whole = stored(obj.data, ids.CURVATURE_ATTRIBUTE)[:, 0]
    # The ring is flat, the cylinder has kappa 1 / sqrt(2), the rim the mean of both.
    assert np.abs(split[: 64 * 8]).max() <= 1e-3
    assert np.abs(split[64 * 9 :] - math.sqrt(0.5)).max() <= 0.01
    assert np.abs(split[64 * 8 : 64 * 9] - math.sqrt(0.5) / 2.0).max() <= 0.01
    assert whole.max() >= 2.0


@pytest.mark.smoke
def test_a_mirrored_instance_is_measured_once(rig: Rig) -> None:
    rig.light("SUN")
    obj = ring()
    other = obj.copy()
    other.scale = (-1.0, 1.0, 1.0)
    other.location.x = 5.0
    rig.scene.collection.objects.link(other)
    other.select_set(True)
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    assert obj.data is other.data
    assert "scaled" not in cdrf_node(obj).node_tree.name
    assert ids.SCALE_KEY not in other


def test_objects_nobody_sees_are_not_measured(rig: Rig) -> None:
    rig.light("SUN")
    obj, other = ring(), ring()
    obj.select_set(True)
    bpy.ops.cdrf.setup()
    for one in (obj, other):
        one.data.vertices[0].co *= 1.1
        one.data.update()
    before = other.data.cdrf.fingerprint
    other.hide_render = True
    other.hide_set(True)
    changed = obj.data.cdrf.fingerprint
    bpy.ops.cdrf.update()
    assert other.data.cdrf.fingerprint == before
    assert obj.data.cdrf.fingerprint != changed
    obj.hide_render = True
    obj.hide_set(True)
    with pytest.raises(RuntimeError, match="hidden: show one"):
        bpy.ops.cdrf.update()


def test_a_finer_mesh_of_the_same_shape_shades_alike(rig: Rig) -> None:
    # The bound is what the two meshes' own shading differs by, times a half.
    rig.light("SUN", energy=math.pi, angle=0.0, rotation=(math.radians(50.0), 0.0, 1.2))
    images = {}
    for segments in (48, 192):
        bpy.ops.mesh.primitive_torus_add(
            major_radius=0.7,
            minor_radius=0.28,
            major_segments=segments,
            minor_segments=segments // 2,
        )
        bpy.ops.object.shade_smooth()
        obj = bpy.context.object
        bpy.ops.cdrf.setup()
        cdrf_node(obj).inputs[ids.BASE_COLOR].default_value = (1.0, 1.0, 1.0, 1.0)
        for sigma0 in (0.0, 0.15):
            obj.data.materials[0].cdrf.sigma0 = sigma0
            images[segments, sigma0] = rig.render()
        bpy.data.objects.remove(obj)
    covered = np.minimum(images[48, 0.0][..., 3], images[192, 0.0][..., 3]) > 0.999
    added = [
        (images[segments, 0.15] - images[segments, 0.0])[covered][:, 0] for segments in (48, 192)
    ]
    assert math.sqrt((added[1] ** 2).mean()) > 0.05
    assert math.sqrt(((added[0] - added[1]) ** 2).mean()) <= 0.01


@pytest.mark.smoke
@pytest.mark.parametrize("kind", ["TRIANGULATE", "MIRROR", "SOLIDIFY", "ARRAY", "EDGE_SPLIT"])
def test_lengths_reach_the_shader_through_modifiers(rig: Rig, kind: str) -> None:
    obj = ring()
    obj.modifiers.new("Modifier", kind)
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    stored_length = obj.data.attributes[ids.LENGTH_ATTRIBUTE].data[0].value
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    values = np.empty(len(mesh.vertices), dtype=np.float32)
    mesh.attributes[ids.LENGTH_ATTRIBUTE].data.foreach_get("value", values)
    evaluated.to_mesh_clear()
    assert values == pytest.approx(np.full(len(values), stored_length), rel=1e-5)
