# SPDX-License-Identifier: GPL-3.0-or-later
"""Models, presets and Principled materials: what the panel's buttons do to material and group."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from rig import Rig, cdrf_node

from cdrf_addon import ids
from cdrf_addon.blender.material.scattering import read_scattering
from cdrf_addon.blender.nodes.tables import ensure_table, find_table
from cdrf_addon.compat import ensure_node_tree, walk_method
from cdrf_addon.core.reflectance.model import PROFILE, RING, SPHERE, ring
from cdrf_addon.core.reflectance.profile import SKIN_PROFILE, parse_profile
from cdrf_addon.core.scattering.node_radius import sigma0_per_radius
from cdrf_addon.core.scattering.presets import PRESETS

pytestmark = pytest.mark.smoke

# Sockets hold float32.
STORED = 1e-6


@pytest.fixture
def egg(rig: Rig) -> bpy.types.Object:
    """A translucent, not quite round body of 2 m, with a sun."""
    rig.light("SUN", angle=0.0)
    obj = rig.sphere(subdivisions=3)
    obj.scale = (1.0, 1.0, 1.01)
    bpy.context.view_layer.update()
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    return obj


def group_of(obj: bpy.types.Object) -> bpy.types.ShaderNodeTree:
    node = cdrf_node(obj)
    assert node is not None
    return node.node_tree


def scattering_material(**values: object) -> tuple[bpy.types.Material, bpy.types.ShaderNode]:
    material = bpy.data.materials.new("Skin")
    tree = ensure_node_tree(material)
    principled = next((n for n in tree.nodes if n.type == "BSDF_PRINCIPLED"), None)
    if principled is None:
        principled = tree.nodes.new("ShaderNodeBsdfPrincipled")
        output = tree.nodes.new("ShaderNodeOutputMaterial")
        tree.links.new(principled.outputs["BSDF"], output.inputs["Surface"])
    settings = {
        "Base Color": (0.8, 0.5, 0.4, 1.0),
        "Subsurface Weight": 1.0,
        "Subsurface Radius": (1.0, 0.35, 0.2),
        "Subsurface Scale": 0.05,
    }
    for name, value in (settings | values).items():
        principled.inputs[name].default_value = value
    return material, principled


def test_a_new_material_has_the_sphere_and_one_table(egg: bpy.types.Object) -> None:
    material = egg.active_material
    assert material.cdrf.model == SPHERE
    assert group_of(egg)[ids.MODEL_KEY] == SPHERE
    tables = [image for image in bpy.data.images if image.get(ids.ROLE_KEY) == ids.ROLE_LUT]
    assert [image[ids.MODEL_KEY] for image in tables] == [SPHERE]


def test_the_paper_is_one_click_away_and_back(egg: bpy.types.Object) -> None:
    settings = egg.active_material.cdrf
    settings.sigma0, settings.sigma0_ratio = 0.3, (1.0, 0.5, 0.25)
    for kind in (RING, SPHERE):
        assert bpy.ops.cdrf.set_model(model=kind) == {"FINISHED"}
        assert settings.model == kind
        assert settings.sigma0 == pytest.approx(0.3)
        assert tuple(settings.sigma0_ratio) == pytest.approx((1.0, 0.5, 0.25))
        assert len(group_of(egg)[ids.CHANNELS_KEY].split()) == 3


def test_a_profile_needs_one_look_up_and_leaves_its_ratio_behind(egg: bpy.types.Object) -> None:
    settings = egg.active_material.cdrf
    settings.sigma0, settings.sigma0_ratio = 0.3, (1.0, 0.5, 0.25)
    assert bpy.ops.cdrf.set_model(model=PROFILE) == {"FINISHED"}
    assert tuple(settings.sigma0_ratio) == (1.0, 1.0, 1.0)
    assert group_of(egg)[ids.CHANNELS_KEY] == "RGB"
    assert bpy.ops.cdrf.set_model(model=SPHERE) == {"FINISHED"}
    widths = SKIN_PROFILE.rms_widths
    assert tuple(settings.sigma0_ratio) == pytest.approx(tuple(widths / widths[0]), rel=1e-5)
    assert settings.sigma0 == pytest.approx(0.3)


def test_any_list_of_gaussians_is_taken_and_nonsense_changes_nothing(
    egg: bpy.types.Object,
) -> None:
    settings = egg.active_material.cdrf
    settings.model = PROFILE
    first = group_of(egg)[ids.MODEL_KEY]
    settings.profile = "1 0.5 1 1; 3 0.5 0 0"
    second = group_of(egg)[ids.MODEL_KEY]
    assert second != first and find_table(second) is not None
    for text in ("1 0.5 1 1", "red", "", "1 2 3; 4"):
        settings.profile = text
        assert group_of(egg)[ids.MODEL_KEY] == second
        with pytest.raises(RuntimeError, match=r"\."):
            bpy.ops.cdrf.set_model(model=PROFILE)
    settings.profile = "1 0.5 1 1; 3 0.5 0 0"
    settings.profile_base = RING
    assert group_of(egg)[ids.MODEL_KEY] not in {first, second}


def test_measured_says_what_is_missing(egg: bpy.types.Object) -> None:
    with pytest.raises(RuntimeError, match=r"cdrf\.measure\(\) first"):
        bpy.ops.cdrf.set_model(model="MEASURED")
    assert egg.active_material.cdrf.model == SPHERE


def test_a_deleted_table_comes_back_with_update(egg: bpy.types.Object) -> None:
    egg.active_material.cdrf.model = PROFILE
    key = group_of(egg)[ids.MODEL_KEY]
    table = find_table(key)
    assert table is not None
    bpy.data.images.remove(table.image)
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    assert find_table(key) is not None
    assert group_of(egg)[ids.MODEL_KEY] == key


def test_a_file_from_before_the_models_stays_the_papers(egg: bpy.types.Object) -> None:
    egg.active_material.cdrf.model = RING
    group = group_of(egg)
    del group[ids.MODEL_KEY]
    group[ids.VERSION_KEY] = 4
    for image in list(bpy.data.images):
        bpy.data.images.remove(image)
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    assert egg.active_material.cdrf.model == RING
    assert find_table(RING) is not None


def test_soft_lights_cost_a_profile_three_look_ups_and_resizing_is_noticed(
    egg: bpy.types.Object, rig: Rig
) -> None:
    from cdrf_addon.blender import state
    from cdrf_addon.blender.shader.wired import wired_lights

    egg.active_material.cdrf.model = PROFILE
    assert [light.lookups for light in wired_lights(group_of(egg))] == ["RGB"]
    sun = next(obj for obj in rig.scene.objects if obj.type == "LIGHT")
    sun.data.angle = math.radians(10.0)
    reasons = state.reasons_to_update(egg, rig.scene, bpy.context.view_layer)
    assert any("another size" in reason for reason in reasons)
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    assert [light.lookups for light in wired_lights(group_of(egg))] == ["R G B"]
    assert not state.reasons_to_update(egg, rig.scene, bpy.context.view_layer)


@pytest.mark.parametrize("unit", [("METRIC", 1.0), ("METRIC", 0.01), ("NONE", 0.001)])
@pytest.mark.parametrize("key", ["SKIN1", "SKIN_LAYERED", "JADE"])
def test_presets_are_millimetres_in_the_scenes_units(
    egg: bpy.types.Object, rig: Rig, key: str, unit: tuple[str, float]
) -> None:
    units = rig.scene.unit_settings
    units.system, units.scale_length = unit
    metres = 1.0 if unit[0] == "NONE" else unit[1]
    settings = egg.active_material.cdrf
    assert bpy.ops.cdrf.preset(preset=key) == {"FINISHED"}
    assert settings.sigma0 * metres * 1e3 == pytest.approx(max(PRESETS[key].sigma0), rel=STORED)
    if PRESETS[key].model == SPHERE:
        own = np.array(settings.sigma0_ratio) * settings.sigma0 * metres * 1e3
        assert own == pytest.approx(PRESETS[key].sigma0, rel=STORED)
    assert settings.model == PRESETS[key].model


def test_a_preset_looks_the_same_however_the_size_is_made(rig: Rig) -> None:
    """A body 20 cm tall: modelled so, scaled by ten, modelled in centimetres or millimetres."""
    rig.light("SUN", angle=0.0)
    blurs = []
    for metres, radius, scale in (
        (1.0, 0.1, 1.0),
        (1.0, 0.01, 10.0),
        (0.01, 10.0, 1.0),
        (0.001, 10.0, 10.0),
    ):
        rig.scene.unit_settings.scale_length = metres
        obj = rig.sphere(radius, subdivisions=3)
        obj.scale = (scale, scale, 1.01 * scale)
        bpy.context.view_layer.update()
        assert bpy.ops.cdrf.setup() == {"FINISHED"}
        assert bpy.ops.cdrf.preset(preset="MARBLE") == {"FINISHED"}
        blurs.append(obj.active_material.cdrf.sigma0 * obj.data.cdrf.median)
        bpy.data.objects.remove(obj)
    assert blurs == pytest.approx([blurs[0]] * 4, rel=1e-4)


def test_real_height_scales_a_preset(egg: bpy.types.Object) -> None:
    settings = egg.active_material.cdrf
    bpy.ops.cdrf.preset(preset="SKIN2")
    plain = settings.sigma0
    bpy.ops.cdrf.preset(preset="SKIN2", real_height=egg.dimensions.z / 8.0)
    assert settings.sigma0 == pytest.approx(8.0 * plain, rel=1e-5)


def test_color_too_leaves_textures_alone(egg: bpy.types.Object) -> None:
    node = cdrf_node(egg)
    assert node is not None
    bpy.ops.cdrf.preset(preset="MARBLE")
    before = tuple(node.inputs[ids.BASE_COLOR].default_value)
    bpy.ops.cdrf.preset(preset="MARBLE", with_color=True)
    assert tuple(node.inputs[ids.BASE_COLOR].default_value)[:3] == pytest.approx(
        PRESETS["MARBLE"].albedo
    )
    assert tuple(node.inputs[ids.BASE_COLOR].default_value) != before
    tree = egg.active_material.node_tree
    texture = tree.nodes.new("ShaderNodeTexChecker")
    tree.links.new(texture.outputs["Color"], node.inputs[ids.BASE_COLOR])
    bpy.ops.cdrf.preset(preset="APPLE", with_color=True)
    assert node.inputs[ids.BASE_COLOR].is_linked


def test_a_principled_material_is_translucent_with_one_click(rig: Rig) -> None:
    rig.light("SUN", angle=0.0)
    material, _ = scattering_material()
    obj = rig.sphere(subdivisions=3)
    obj.scale = (1.0, 1.0, 1.01)
    obj.data.materials.append(material)
    bpy.context.view_layer.update()
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    factors = sigma0_per_radius((0.8, 0.5, 0.4), walk_method("RANDOM_WALK"))
    expected = np.array((1.0, 0.35, 0.2)) * 0.05 * factors
    own = np.array(material.cdrf.sigma0_ratio) * material.cdrf.sigma0
    assert own == pytest.approx(expected, rel=1e-5)


def test_what_feeds_a_principled_node_is_read_through(rig: Rig) -> None:
    material, principled = scattering_material()
    tree = material.node_tree
    image = bpy.data.images.new("Albedo", 4, 4)
    image.pixels[:] = [0.5, 0.25, 0.75, 1.0] * 16
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    reroute = tree.nodes.new("NodeReroute")
    tree.links.new(texture.outputs["Color"], reroute.inputs[0])
    tree.links.new(reroute.outputs[0], principled.inputs["Base Color"])
    value = tree.nodes.new("ShaderNodeValue")
    value.outputs[0].default_value = 0.2
    tree.links.new(value.outputs[0], principled.inputs["Subsurface Scale"])
    noise = tree.nodes.new("ShaderNodeTexNoise")
    tree.links.new(noise.outputs["Color"], principled.inputs["Subsurface Radius"])
    found = read_scattering(material)
    assert found is not None
    stored = np.array([0.5, 0.25, 0.75])
    # 8-bit and display-referred: half a step of 1/255, times the slope of the curve.
    assert found.albedo == pytest.approx(((stored + 0.055) / 1.055) ** 2.4, abs=6e-3)
    assert found.radius == pytest.approx((0.2, 0.07, 0.04))
    assert any("picture" in note for note in found.notes)
    assert any("plain value" in note for note in found.notes)


@pytest.mark.parametrize("case", ["no weight", "no scale", "diffuse", "empty", "loop"])
def test_a_material_that_does_not_scatter_is_recognised(rig: Rig, case: str) -> None:
    material, principled = scattering_material()
    tree = material.node_tree
    if case == "no weight":
        principled.inputs["Subsurface Weight"].default_value = 0.0
    elif case == "no scale":
        principled.inputs["Subsurface Scale"].default_value = 0.0
    elif case == "empty":
        tree.nodes.clear()
    else:
        tree.nodes.remove(principled)
        output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
        diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
        mix = tree.nodes.new("ShaderNodeMixShader")
        tree.links.new(diffuse.outputs[0], mix.inputs[1])
        tree.links.new(mix.outputs[0], output.inputs["Surface"])
        if case == "loop":
            tree.links.new(mix.outputs[0], mix.inputs[2])
    assert read_scattering(material) is None


def test_reading_again_is_an_operator_with_a_message(egg: bpy.types.Object) -> None:
    with pytest.raises(RuntimeError, match="Nothing in"):
        bpy.ops.cdrf.read_shader()
    tree = egg.active_material.node_tree
    node = tree.nodes.new("ShaderNodeSubsurfaceScattering")
    node.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1.0)
    node.inputs["Scale"].default_value = 0.1
    node.inputs["Radius"].default_value = (1.0, 1.0, 1.0)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    assert bpy.ops.cdrf.read_shader() == {"FINISHED"}
    settings = egg.active_material.cdrf
    assert settings.sigma0 == pytest.approx(
        0.1 * float(sigma0_per_radius(0.5, walk_method("RANDOM_WALK"))), rel=1e-5
    )
    assert tuple(settings.sigma0_ratio) == (1.0, 1.0, 1.0)


def test_choices_are_remembered_while_a_material_is_opaque(egg: bpy.types.Object) -> None:
    material = egg.active_material
    bpy.ops.cdrf.set_model(model=RING)
    assert bpy.ops.cdrf.remove() == {"FINISHED"}
    assert material.cdrf.model == RING
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    assert group_of(egg)[ids.MODEL_KEY] == RING


def test_tables_are_made_once_per_file(rig: Rig) -> None:
    first = ensure_table(ring())
    assert ensure_table(ring()).image == first.image
    assert first.image.packed_file is not None
    assert parse_profile(SKIN_PROFILE.to_text()).rms_widths == pytest.approx(
        SKIN_PROFILE.rms_widths, rel=1e-6
    )


def test_what_others_wire_is_read_as_blender_reads_it(rig: Rig) -> None:
    material, principled = scattering_material()
    tree = material.node_tree
    value = tree.nodes.new("ShaderNodeValue")
    value.outputs[0].default_value = 0.5
    tree.links.new(value.outputs[0], principled.inputs["Subsurface Radius"])
    colour = tree.nodes.new("ShaderNodeRGB")
    colour.outputs[0].default_value = (0.2, 0.2, 0.2, 1.0)
    tree.links.new(colour.outputs[0], principled.inputs["Subsurface Scale"])
    found = read_scattering(material)
    assert found is not None
    assert found.radius == pytest.approx((0.1, 0.1, 0.1), rel=1e-3)


def test_shaders_inside_groups_and_mixes_are_found_where_they_show(rig: Rig) -> None:
    inner = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    inner.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    scatter = inner.nodes.new("ShaderNodeSubsurfaceScattering")
    scatter.inputs["Scale"].default_value = 0.1
    ending = inner.nodes.new("NodeGroupOutput")
    inner.links.new(scatter.outputs[0], ending.inputs[0])
    material, principled = scattering_material()
    tree = material.node_tree
    group = tree.nodes.new("ShaderNodeGroup")
    group.node_tree = inner
    mix = tree.nodes.new("ShaderNodeMixShader")
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.links.new(principled.outputs["BSDF"], mix.inputs[1])
    tree.links.new(group.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    for factor, scale in ((0.0, 0.05), (1.0, 0.1)):
        mix.inputs[0].default_value = factor
        found = read_scattering(material)
        assert found is not None and max(found.radius) == pytest.approx(scale)
    mix.inputs[0].default_value = 0.0
    principled.mute = True
    assert read_scattering(material) is None
    principled.mute = False
    principled.inputs["Metallic"].default_value = 1.0
    assert read_scattering(material) is None
