# SPDX-License-Identifier: GPL-3.0-or-later
"""Normal maps blended per channel, and gloss on top: pixels against theory and Blender's own."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from rig import Rig, cdrf_node
from tolerances import SHADER, WRITTEN

from cdrf_addon import compat, ids
from cdrf_addon.blender import state
from cdrf_addon.blender.material import specular
from cdrf_addon.core.reflectance.detail import detail_left
from cdrf_addon.core.reflectance.model import PROFILE
from cdrf_addon.core.reflectance.profile import profile
from cdrf_addon.core.reflectance.sphere_model import sphere_reflectance

FROM_THE_SIDE = (math.radians(50.0), 0.0, math.radians(70.0))
TILT = np.array([0.5, -0.2, 0.3])


def surface(item: bpy.types.Object) -> bpy.types.ShaderNode:
    """Give an object a material of the artist's: a white Principled BSDF without gloss."""
    material = bpy.data.materials.new("Artist's")
    compat.ensure_node_tree(material)
    node = material.node_tree.nodes["Principled BSDF"]
    node.inputs["Base Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    node.inputs["Specular IOR Level"].default_value = 0.0
    item.data.materials.clear()
    item.data.materials.append(material)
    return node


def bent_normal(node: bpy.types.ShaderNode) -> None:
    """Tilt the normal everywhere by the same vector: a map whose result is known."""
    tree = node.id_data
    geometry = tree.nodes.new("ShaderNodeNewGeometry")
    tilt = tree.nodes.new("ShaderNodeVectorMath")
    tilt.inputs[1].default_value = TILT
    unit = tree.nodes.new("ShaderNodeVectorMath")
    unit.operation = "NORMALIZE"
    tree.links.new(geometry.outputs["Normal"], tilt.inputs[0])
    tree.links.new(tilt.outputs["Vector"], unit.inputs[0])
    tree.links.new(unit.outputs["Vector"], node.inputs["Normal"])


def blended(normals: np.ndarray, weight: float) -> np.ndarray:
    mapped = normals + TILT
    mapped /= np.linalg.norm(mapped, axis=1, keepdims=True)
    mixed = normals + weight * (mapped - normals)
    return mixed / np.linalg.norm(mixed, axis=1, keepdims=True)


def textures(group: bpy.types.ShaderNodeTree) -> int:
    """Look-ups of a group, those of the groups in it included."""
    return sum(
        textures(node.node_tree) if node.type == "GROUP" else node.type == "TEX_IMAGE"
        for node in group.nodes
    )


@pytest.mark.smoke
@pytest.mark.parametrize("kind", ["SPHERE", PROFILE])
def test_each_channel_sees_its_part_of_the_map(rig: Rig, kind: str) -> None:
    sun = rig.light("SUN", energy=math.pi, angle=0.0, rotation=FROM_THE_SIDE)
    ball = rig.sphere()
    bent_normal(surface(ball))
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    material = ball.data.materials[0]
    ratio = np.array((1.0, 0.35, 0.2))
    if kind == PROFILE:
        material.cdrf.model = kind
        ratio = np.sqrt(profile().moments)
    else:
        material.cdrf.sigma0_ratio = ratio
    material.cdrf.sigma0 = 0.2
    node = cdrf_node(ball)
    node.inputs[ids.DETAIL_SIZE].default_value = 0.4
    assert textures(node.node_tree) == 3
    normals, covered = rig.normals(ball)
    bpy.context.view_layer.update()
    towards = np.array(sun.matrix_world)[:3, 2]
    value, _ = rig.render_exact(ball, "Shader", -0.01, 1.01)
    for channel, factor in enumerate(ratio):
        weight = float(detail_left(0.2 * factor, 0.4))
        cosine = np.clip(blended(normals[covered], weight) @ towards, -1.0, 1.0)
        if kind == PROFILE:
            expected = profile().evaluate(np.arccos(cosine), 0.2)[:, channel]
        else:
            expected = sphere_reflectance(np.arccos(cosine), 0.2 * factor)
        error = np.abs(value[covered][:, channel] - expected).max()
        print(f"{kind} {channel}: weight {weight:.2f}, worst {error:.1e}")
        assert error <= SHADER.worst


def test_grey_skin_keeps_one_look_up_and_no_map_leaves_no_node(rig: Rig) -> None:
    rig.light("SUN", energy=math.pi)
    ball = rig.sphere()
    node = surface(ball)
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    group = cdrf_node(ball).node_tree
    plain = len(group.nodes)
    assert ids.DETAIL_SIZE not in cdrf_node(ball).inputs
    assert not any("Detail" in item.name for item in group.nodes)
    bent_normal(node)
    skin = cdrf_node(ball)
    skin.id_data.links.new(node.inputs["Normal"].links[0].from_socket, skin.inputs[ids.NORMAL])
    reasons = state.reasons_to_update(ball, rig.scene, bpy.context.view_layer)
    assert any("normal map" in reason for reason in reasons)
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    assert textures(cdrf_node(ball).node_tree) == 1
    assert len(cdrf_node(ball).node_tree.nodes) > plain
    assert cdrf_node(ball).inputs[ids.DETAIL_SIZE].default_value > 0.0
    assert not state.reasons_to_update(ball, rig.scene, bpy.context.view_layer)


def describe(material: bpy.types.Material) -> list[object]:
    """All nodes, values and links of a material."""
    tree = material.node_tree
    nodes = []
    for node in tree.nodes:
        values = [
            tuple(s.default_value) if hasattr(s.default_value, "__iter__") else s.default_value
            for s in node.inputs
            if hasattr(s, "default_value")
        ]
        nodes.append((node.name, node.bl_idname, tuple(node.location), node.mute, values))
    links = [
        (link.from_node.name, link.from_socket.identifier, link.to_node.name,
         link.to_socket.identifier)
        for link in tree.links
    ]  # fmt: skip
    active = [node.is_active_output for node in tree.nodes if node.type == "OUTPUT_MATERIAL"]
    return [sorted(nodes, key=str), sorted(links), active, tree.animation_data]


def test_gloss_comes_off_without_a_trace(rig: Rig) -> None:
    ball = rig.sphere()
    node = surface(ball)
    material = ball.data.materials[0]
    noise = node.id_data.nodes.new("ShaderNodeTexNoise")
    node.id_data.links.new(noise.outputs[0], node.inputs["Roughness"])
    node.inputs["Metallic"].default_value = 0.25
    node.inputs["Coat Weight"].default_value = 0.5
    node.inputs["Alpha"].default_value = 0.9
    assert not specular.is_worth_keeping(material) or node.inputs["Coat Weight"].default_value
    node.inputs["Specular IOR Level"].default_value = 0.5
    before = describe(material)
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    assert material.cdrf.gloss
    assert not state.reasons_to_update(ball, rig.scene, bpy.context.view_layer)
    copies = [n for n in node.id_data.nodes if n.type == "BSDF_PRINCIPLED" and n != node]
    assert len(copies) == 2  # the gloss and the metal
    assert all(copy.inputs["Roughness"].links[0].from_node == noise for copy in copies)
    material.cdrf.gloss = False
    assert not specular.has_specular(material) and not material.cdrf.gloss
    material.cdrf.gloss = True
    node.inputs["Coat Weight"].default_value = 0.0
    reasons = state.reasons_to_update(ball, rig.scene, bpy.context.view_layer)
    assert any("Principled" in reason for reason in reasons)
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    assert not state.reasons_to_update(ball, rig.scene, bpy.context.view_layer)
    node.inputs["Coat Weight"].default_value = 0.5
    assert bpy.ops.cdrf.show_curvature() == {"FINISHED"}
    assert bpy.ops.cdrf.show_curvature() == {"FINISHED"}
    assert bpy.ops.cdrf.remove() == {"FINISHED"}
    assert describe(material) == before


def test_undo_takes_back_world_and_gloss(rig: Rig) -> None:
    ball = rig.sphere()
    ball.name = "Ball"
    node = surface(ball)
    node.inputs["Specular IOR Level"].default_value = 0.5
    sky = rig.scene.world.node_tree.nodes.new("ShaderNodeTexGradient")
    background = rig.scene.world.node_tree.nodes["Background"]
    background.inputs["Strength"].default_value = 1.0
    rig.scene.world.node_tree.links.new(sky.outputs[0], background.inputs["Color"])
    before = describe(ball.data.materials[0])
    bpy.ops.ed.undo_push(message="start")

    def material() -> bpy.types.Material:
        return bpy.data.objects["Ball"].data.materials[0]

    bpy.ops.cdrf.setup()
    bpy.ops.ed.undo_push(message="setup")
    material().cdrf.gloss = False
    bpy.ops.ed.undo_push(message="no gloss")
    assert not specular.has_specular(material())
    bpy.ops.ed.undo()
    assert specular.has_specular(material())
    bpy.ops.ed.undo()
    assert describe(material()) == before
    assert len(bpy.data.scenes) == 1 and len(bpy.data.worlds) == 1
    bpy.ops.ed.redo()
    assert specular.has_specular(material())
    item = bpy.data.objects["Ball"]
    assert not state.reasons_to_update(item, bpy.context.scene, bpy.context.view_layer)


def test_gloss_is_offered_where_there_is_some(rig: Rig) -> None:
    ball = rig.sphere()
    node = surface(ball)
    material = ball.data.materials[0]
    assert not specular.is_worth_keeping(material)
    node.inputs["Specular IOR Level"].default_value = 0.5
    assert specular.is_worth_keeping(material) and material.cdrf.gloss
    node.inputs["Metallic"].default_value = 1.0
    assert not specular.is_worth_keeping(material)
    node.inputs["Metallic"].default_value = 0.0
    material.cdrf.gloss = False
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    assert not specular.has_specular(material)
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    assert not specular.has_specular(material)


@pytest.mark.smoke
@pytest.mark.parametrize(
    "settings",
    [
        pytest.param({"Roughness": 0.5}, id="plain"),
        pytest.param({"Roughness": 0.3, "Coat Weight": 0.5, "IOR": 1.4}, id="coat"),
        pytest.param({"Roughness": 0.5, "Metallic": 0.4}, id="metal"),
    ],
)
def test_without_scattering_it_is_the_principled_bsdf(rig: Rig, settings) -> None:
    """Base colour 0.8, 0.5, 0.3 under a sun: the whole against Blender's own, in parts of the peak.

    The bound is what the fit of the specular albedo (core/reflectance/specular.py) leaves at rims.
    """
    rig.scene.render.resolution_x = rig.scene.render.resolution_y = 64
    rig.light("SUN", energy=math.pi, rotation=(math.radians(60.0), 0.0, math.radians(30.0)))
    background = rig.scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    background.inputs["Strength"].default_value = 0.3
    ball = rig.sphere()
    node = surface(ball)
    node.inputs["Base Color"].default_value = (0.8, 0.5, 0.3, 1.0)
    node.inputs["Specular IOR Level"].default_value = 0.5
    for name, value in settings.items():
        node.inputs[name].default_value = value
    theirs = rig.render()
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    ball.data.materials[0].cdrf.sigma0 = 0.0
    ours = rig.render()
    covered = theirs[..., 3] > 0.999
    peak = float(np.percentile(theirs[covered][:, :3], 99.0))
    error = (ours - theirs)[covered][:, :3] / peak
    rms = float(np.sqrt((error**2).mean()))
    print(f"worst {np.abs(error).max():.4f}, RMS {rms:.4f}, mean {error.mean():+.4f}")
    assert rms <= 0.015 and abs(error.mean()) <= 0.01
    assert np.percentile(np.abs(error), 99.0) <= 0.04
    assert WRITTEN.worst < 0.04
