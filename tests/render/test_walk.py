# SPDX-License-Identifier: GPL-3.0-or-later
"""View dependence in pixels: the node groups against core/walk/view.py, and its extremes."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from numpy.typing import NDArray
from rig import Rig, cdrf_node
from tolerances import SHADER, WALK

from cdrf_addon import compat, ids
from cdrf_addon.core.reflectance.sphere_model import sphere_reflectance
from cdrf_addon.core.walk.material import MaterialWalk, model_of_key
from cdrf_addon.core.walk.view import kernel

Array = NDArray[np.float64]
TOWARDS_CAMERA = np.array([0.0, -1.0, 0.0])
ALBEDO = (0.9, 0.62, 0.34)
SUN = (math.radians(50.0), 0.0, math.radians(70.0))


def scattering_material(
    radius: tuple[float, float, float], albedo: tuple[float, float, float] = ALBEDO
) -> bpy.types.Material:
    """A Subsurface Scattering node as Blender adds it, with that radius and colour."""
    material = bpy.data.materials.new("Scattering")
    tree = compat.ensure_node_tree(material)
    tree.nodes.clear()
    node = tree.nodes.new("ShaderNodeSubsurfaceScattering")
    node.falloff = "RANDOM_WALK"
    node.inputs["Color"].default_value = (*albedo, 1.0)
    node.inputs["Radius"].default_value = radius
    node.inputs["Scale"].default_value = 1.0
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs["BSSRDF"], output.inputs["Surface"])
    return material


def translucent(obj: bpy.types.Object, material: bpy.types.Material) -> bpy.types.ShaderNode:
    obj.data.materials.clear()
    obj.data.materials.append(material)
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    return cdrf_node(obj)


def sun(rig: Rig) -> tuple[bpy.types.Object, Array]:
    lamp = rig.light("SUN", energy=math.pi, angle=0.0, rotation=SUN)
    bpy.context.view_layer.update()
    return lamp, np.array(lamp.matrix_world)[:3, 2]


def shifted(normals: Array, view: Array, turned: Array, reach: Array) -> Array:
    """N' of one normal for all channels, as the node group has it: what it takes off ends at 1."""
    shift = reach[:, None] * turned
    shift /= np.maximum(np.linalg.norm(shift, axis=1), 1.0)[:, None]
    tilted = normals - shift
    return tilted / np.linalg.norm(tilted, axis=1)[:, None]


def free_paths(node: bpy.types.ShaderNode) -> Array:
    """Mean free path of each channel; Blender 4.5 means another length by the same radius."""
    ratio = np.array(node.inputs[ids.SIGMA0_RATIO].default_value)
    path = np.array(node.inputs[ids.FREE_PATH].default_value)
    return np.asarray(node.inputs[ids.SIGMA0].default_value * ratio * path)


def expected(
    node: bpy.types.ShaderNode, normals: Array, light: Array, curvature: float, albedo: Array
) -> Array:
    """What a sphere of that curvature shows under a sun, by core/walk/view.py, (p, 3)."""
    model = model_of_key(node.node_tree[ids.WALK_KEY])
    lengths = free_paths(node)
    mu = np.clip(normals @ TOWARDS_CAMERA, 0.0, 1.0)[:, None]
    size = lengths * curvature
    tangent = TOWARDS_CAMERA - mu * normals
    k = model.tilt(albedo.mean(), mu[:, 0], size.mean())
    tilted = shifted(normals, TOWARDS_CAMERA, curvature * tangent, k * lengths.mean())
    blur = kernel(
        (tilted @ light)[:, None], model.width(albedo, mu, size), model.haze(albedo, mu, size)
    )
    return np.asarray(model.reflected(albedo, mu, size) * blur)


@pytest.mark.smoke
@pytest.mark.parametrize("radius", [0.02, 0.1, 0.3])
def test_a_sphere_shows_the_models_radiance(rig: Rig, radius: float) -> None:
    _, light = sun(rig)
    obj = rig.sphere()
    node = translucent(obj, scattering_material((radius, 0.7 * radius, 0.5 * radius)))
    assert node.inputs[ids.FREE_PATH].default_value[0] > 0.0
    normals, covered = rig.normals(obj)
    value, _ = rig.render_exact(obj, "Shader", -0.01, 1.01)
    wanted = expected(node, normals[covered], light, 1.0, np.array(ALBEDO))
    error = np.abs(value[covered] - wanted)
    assert error.max() <= WALK.worst, error.max()
    assert np.sqrt((error**2).mean()) <= WALK.rms


def test_the_radius_of_the_node_is_the_mean_free_path(rig: Rig) -> None:
    node = translucent(rig.sphere(), scattering_material((0.2, 0.1, 0.05)))
    assert free_paths(node) == pytest.approx((0.2, 0.1, 0.05), rel=1e-5)


@pytest.mark.smoke
def test_a_white_world_gives_what_a_white_furnace_gives(rig: Rig) -> None:
    compat.set_uses_nodes(rig.scene.world, True)
    background = rig.scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    background.inputs["Strength"].default_value = 1.0
    obj = rig.sphere()
    node = translucent(obj, scattering_material((0.1, 0.1, 0.1)))
    normals, covered = rig.normals(obj)
    value, _ = rig.render_exact(obj, "Shader", -0.01, 1.51)
    mu = np.clip(normals[covered] @ TOWARDS_CAMERA, 0.0, 1.0)[:, None]
    model = model_of_key(node.node_tree[ids.WALK_KEY])
    wanted = model.reflected(np.array(ALBEDO), mu, free_paths(node))
    assert np.abs(value[covered] - wanted).max() <= WALK.worst
    # The opaque limit gives the colour itself.
    node.inputs[ids.SIGMA0].default_value = 0.0
    value, _ = rig.render_exact(obj, "Shader", -0.01, 1.51)
    assert np.abs(value[covered] - ALBEDO).max() <= SHADER.worst


@pytest.mark.smoke
def test_without_scattering_it_is_lambert_and_off_it_is_the_sphere_model(rig: Rig) -> None:
    _, light = sun(rig)
    obj = rig.sphere()
    material = scattering_material((0.1, 0.1, 0.1))
    node = translucent(obj, material)
    normals, covered = rig.normals(obj)
    theta = np.arccos(np.clip(normals[covered] @ light, -1.0, 1.0))
    sigma0, ratio = material.cdrf.sigma0, np.array(material.cdrf.sigma0_ratio)
    material.cdrf.view_dependence = False
    assert ids.FREE_PATH not in cdrf_node(obj).inputs
    value, _ = rig.render_exact(obj, "Shader", -0.01, 1.01)
    for channel, albedo in enumerate(ALBEDO):
        wanted = albedo * sphere_reflectance(theta, sigma0 * ratio[channel])
        assert np.abs(value[covered][:, channel] - wanted).max() <= SHADER.worst
    material.cdrf.view_dependence = True
    material.cdrf.sigma0 = 0.0
    value, _ = rig.render_exact(obj, "Shader", -0.01, 1.01)
    wanted = np.maximum(np.cos(theta), 0.0)[:, None] * ALBEDO
    assert np.abs(value[covered] - wanted).max() <= SHADER.worst
    assert node is not None


@pytest.mark.smoke
def test_the_tilt_follows_the_object_turned_scaled_and_mirrored(rig: Rig) -> None:
    """The shape operator is stored in the object's axes; a torus bends across, not along."""
    sun(rig)

    def picture(scale: float, *, mirrored: bool = False, applied: bool = False) -> Array:
        bpy.ops.mesh.primitive_torus_add(
            major_segments=96, minor_segments=48, major_radius=0.7, minor_radius=0.3
        )
        obj = bpy.context.object
        bpy.ops.object.shade_smooth()
        obj.scale = (-scale if mirrored else scale, scale, scale)
        obj.rotation_euler = (math.radians(60.0), 0.0, math.radians(25.0))
        rig.camera.data.ortho_scale = 2.3 * scale
        bpy.context.view_layer.update()
        if applied:
            bpy.ops.object.transform_apply(rotation=True)
        translucent(obj, scattering_material((0.08 * scale,) * 3))
        value, covered = rig.render_exact(obj, "Shader", -0.01, 1.01)
        bpy.data.objects.remove(obj)
        return np.where(covered[..., None], value, 0.0)

    whole = picture(1.0)
    for other in (picture(1.0, applied=True), picture(0.5), picture(1.0, mirrored=True)):
        differ = np.abs(other - whole).max(axis=-1)
        # A few pixels of the silhouette differ, and a mirror turns the diagonals of the quads.
        assert np.quantile(differ, 0.98) <= 2e-3


@pytest.mark.parametrize("roughness", [0.0, 1.0])
@pytest.mark.parametrize("ior", [1.01, 3.8])
def test_extreme_media_give_finite_pixels(rig: Rig, roughness: float, ior: float) -> None:
    sun(rig)
    obj = rig.sphere(subdivisions=4)
    for albedo, radius in (((0.0, 1.0, 1e-6), 0.1), ((1.0, 1.0, 1.0), 1e6), (ALBEDO, 1e-9)):
        material = scattering_material((radius,) * 3, albedo)
        node = material.node_tree.nodes["Subsurface Scattering"]
        node.inputs["Roughness"].default_value = roughness
        node.inputs["IOR"].default_value = ior
        node.inputs["Anisotropy"].default_value = 0.99
        translucent(obj, material)
        picture = rig.render()
        assert np.isfinite(picture).all()
        assert picture[..., :3].min() >= 0.0 and picture[..., :3].max() <= 1.5


def test_attributes_that_are_no_numbers_give_finite_pixels(rig: Rig) -> None:
    sun(rig)
    bpy.ops.mesh.primitive_torus_add()
    obj = bpy.context.object
    translucent(obj, scattering_material((0.1, 0.1, 0.1)))
    mesh = obj.data
    for name, entry, width in (
        (ids.MEAN_ATTRIBUTE, "color", 4),
        (ids.SHAPE_ATTRIBUTE, "vector", 3),
        (ids.SHAPE_MIXED_ATTRIBUTE, "vector", 3),
        (ids.DIFFUSED_ATTRIBUTE, "color", 4),
    ):
        attribute = mesh.attributes[name]
        kept = np.empty(width * len(attribute.data), dtype=np.float32)
        attribute.data.foreach_get(entry, kept)
        for bad in (np.nan, np.inf, -np.inf, 1e30, -1e30):
            attribute.data.foreach_set(entry, np.full_like(kept, bad))
            mesh.update_tag()
            picture = rig.render()
            assert np.isfinite(picture).all(), (name, bad)
            assert picture[..., :3].max() <= 1.5, (name, bad)
        attribute.data.foreach_set(entry, kept)


def test_the_papers_ring_stays_the_papers(rig: Rig) -> None:
    obj = rig.sphere()
    material = scattering_material((0.1, 0.1, 0.1))
    translucent(obj, material)
    assert bpy.ops.cdrf.set_model(model="RING") == {"FINISHED"}
    assert not material.cdrf.view_dependence
    assert ids.FREE_PATH not in cdrf_node(obj).inputs
    assert bpy.ops.cdrf.set_model(model="SPHERE") == {"FINISHED"}
    assert material.cdrf.view_dependence


def test_the_walk_of_a_material_is_read_from_its_node(rig: Rig) -> None:
    obj = rig.sphere()
    material = bpy.data.materials.new("Skin")
    tree = compat.ensure_node_tree(material)
    node = next(each for each in tree.nodes if each.type == "BSDF_PRINCIPLED")
    node.inputs["Subsurface Weight"].default_value = 1.0
    node.inputs["Roughness"].default_value = 0.5
    node.inputs["IOR"].default_value = 1.33
    node.subsurface_method = "RANDOM_WALK"
    key = translucent(obj, material).node_tree[ids.WALK_KEY]
    method = compat.walk_method("RANDOM_WALK")
    assert key == MaterialWalk(method, 0.25, 1.33, 0.0).key
    scattering = scattering_material((0.1, 0.1, 0.1))
    scattering.node_tree.nodes["Subsurface Scattering"].inputs["Roughness"].default_value = 0.5
    key = translucent(obj, scattering).node_tree[ids.WALK_KEY]
    assert key == MaterialWalk(method, 0.5, 1.4, 0.0).key


def test_colours_above_one_and_distances_below_zero(rig: Rig) -> None:
    sun(rig)
    obj = rig.sphere()
    node = translucent(obj, scattering_material((0.1, 0.1, 0.1), (1.0, 1.0, 1.0)))
    white = rig.render()[..., :3]
    node.inputs[ids.BASE_COLOR].default_value = (5.0, 5.0, 5.0, 1.0)
    assert rig.render()[..., :3] == pytest.approx(5.0 * white, abs=5e-3)
    node.inputs[ids.BASE_COLOR].default_value = (0.5, 0.5, 0.5, 1.0)
    opaque = []
    for sigma0 in (0.0, -0.1):  # a linked value may be negative
        value = node.id_data.nodes.new("ShaderNodeValue")
        value.outputs[0].default_value = sigma0
        node.id_data.links.new(value.outputs[0], node.inputs[ids.SIGMA0])
        opaque.append(rig.render()[..., :3])
    assert opaque[1].max() <= 0.51
