# SPDX-License-Identifier: GPL-3.0-or-later
"""View Dependence: which materials have it, what its switch changes, and what files keep of it."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from rig import Rig, cdrf_node

from cdrf_addon import ids
from cdrf_addon.blender import state
from cdrf_addon.blender.material import settings
from cdrf_addon.compat import ensure_node_tree, walk_method
from cdrf_addon.core.reflectance.model import MEASURED, MODEL_ITEMS, OFFERED_KINDS, RING, SPHERE
from cdrf_addon.core.scattering.presets import PRESETS
from cdrf_addon.core.walk.material import DEFAULT_WALK, MaterialWalk, free_path_ratio
from cdrf_addon.ui.operators.model import CDRF_MT_model, CDRF_OT_set_model

# Sockets hold float32.
STORED = 1e-6
ALBEDO = (0.8, 0.5, 0.4)
WALK_ATTRIBUTES = (ids.MEAN_ATTRIBUTE, ids.SHAPE_ATTRIBUTE, ids.SHAPE_MIXED_ATTRIBUTE)


def node_material(kind: str = "BSDF_PRINCIPLED", method: str = "RANDOM_WALK") -> bpy.types.Material:
    """Make a material of one node: Principled, scattering or not, or Subsurface Scattering."""
    material = bpy.data.materials.new("Skin")
    tree = ensure_node_tree(material)
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    if kind == "SUBSURFACE_SCATTERING":
        node = tree.nodes.new("ShaderNodeSubsurfaceScattering")
        node.falloff = method
        node.inputs["Color"].default_value = (*ALBEDO, 1.0)
        node.inputs["Scale"].default_value = 0.05
    else:
        node = tree.nodes.new("ShaderNodeBsdfPrincipled")
        node.subsurface_method = method
        node.inputs["Base Color"].default_value = (*ALBEDO, 1.0)
        node.inputs["Subsurface Weight"].default_value = float(kind == "BSDF_PRINCIPLED")
        node.inputs["Subsurface Scale"].default_value = 0.05
        node.inputs["Roughness"].default_value = 0.5
        node.inputs["IOR"].default_value = 1.5
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material


def translucent(
    rig: Rig, material: bpy.types.Material | None = None, *, round_: bool = False
) -> bpy.types.Object:
    """Add a translucent body, a sphere or nearly one, under a sun."""
    rig.light("SUN", angle=0.0)
    obj = rig.sphere(subdivisions=3)
    obj.name = "Body"
    if not round_:
        obj.scale = (1.0, 1.0, 1.2)
    if material is not None:
        obj.data.materials.append(material)
    bpy.context.view_layer.update()
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    return obj


def walk_of(obj: bpy.types.Object) -> str:
    return str(cdrf_node(obj).node_tree.get(ids.WALK_KEY, ""))


def free_path(obj: bpy.types.Object) -> tuple[float, ...]:
    return tuple(cdrf_node(obj).inputs[ids.FREE_PATH].default_value)


def as_older_file(obj: bpy.types.Object) -> None:
    """Leave a translucent object as versions without View Dependence wrote it."""
    own = obj.active_material.cdrf
    for name in ("chosen_view", "chosen_walk", "chosen_free_path"):
        own.property_unset(name)
    del cdrf_node(obj).node_tree[ids.WALK_KEY]
    for name in WALK_ATTRIBUTES:
        if name in obj.data.attributes:
            obj.data.attributes.remove(obj.data.attributes[name])


def due(obj: bpy.types.Object) -> list[str]:
    return state.reasons_to_update(obj, bpy.context.scene, bpy.context.view_layer)


# --- who has it ---------------------------------------------------------------------------------


def test_a_new_material_and_one_that_does_not_scatter_have_none(rig: Rig) -> None:
    for material in (None, node_material("plain")):
        obj = translucent(rig, material)
        assert not obj.active_material.cdrf.view_dependence
        assert walk_of(obj) == ""
        assert ids.FREE_PATH not in cdrf_node(obj).inputs


@pytest.mark.parametrize("kind", ["BSDF_PRINCIPLED", "SUBSURFACE_SCATTERING"])
def test_what_is_read_from_a_node_has_the_nodes_walk(rig: Rig, kind: str) -> None:
    obj = translucent(rig, node_material(kind))
    assert obj.active_material.cdrf.view_dependence
    method = walk_method("RANDOM_WALK")
    wanted = MaterialWalk(method, 0.25, 1.5) if kind == "BSDF_PRINCIPLED" else MaterialWalk(method)
    assert walk_of(obj) == wanted.key
    assert free_path(obj) == pytest.approx(free_path_ratio(ALBEDO, wanted), rel=STORED)
    assert due(obj) == []


def test_burley_starts_without_and_gets_the_default_walk(rig: Rig) -> None:
    obj = translucent(rig, node_material(method="BURLEY"))
    own = obj.active_material.cdrf
    assert not own.view_dependence and walk_of(obj) == ""
    own.view_dependence = True
    assert walk_of(obj) == DEFAULT_WALK.key
    assert free_path(obj) == pytest.approx(free_path_ratio(ALBEDO, DEFAULT_WALK), rel=STORED)
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    assert walk_of(obj) == DEFAULT_WALK.key


def test_a_preset_and_the_eyedropper_switch_it_on(rig: Rig) -> None:
    obj = translucent(rig, node_material())
    own = obj.active_material.cdrf
    read = walk_of(obj), free_path(obj)
    own.view_dependence = False
    assert bpy.ops.cdrf.preset(preset="MARBLE") == {"FINISHED"}
    assert own.view_dependence and walk_of(obj) == DEFAULT_WALK.key
    wanted = free_path_ratio(PRESETS["MARBLE"].albedo, DEFAULT_WALK)
    assert free_path(obj) == pytest.approx(wanted, rel=STORED)
    own.view_dependence = False
    assert bpy.ops.cdrf.read_shader() == {"FINISHED"}
    assert own.view_dependence
    assert (walk_of(obj), free_path(obj)) == read


def test_what_a_script_chose_before_is_kept(rig: Rig) -> None:
    for chosen, kind in ((False, "RANDOM_WALK"), (True, "BURLEY")):
        material = node_material(method=kind)
        material.cdrf.view_dependence = chosen
        assert material.cdrf.view_dependence is chosen
        obj = translucent(rig, material)
        assert material.cdrf.view_dependence is chosen
        assert bool(walk_of(obj)) is chosen


# --- the switch ---------------------------------------------------------------------------------


def test_the_switch_swaps_the_group_and_keeps_values_and_links(rig: Rig) -> None:
    obj = translucent(rig, node_material())
    material = obj.active_material
    material.cdrf.sigma0, material.cdrf.sigma0_ratio = 0.125, (1.0, 0.5, 0.25)
    node = cdrf_node(obj)
    node.inputs[ids.STRENGTH].default_value = 0.75
    node.inputs[ids.FREE_PATH].default_value = (0.5, 0.25, 0.125)
    texture = material.node_tree.nodes.new("ShaderNodeTexChecker")
    material.node_tree.links.new(texture.outputs["Color"], node.inputs[ids.BASE_COLOR])
    with_walk = node.node_tree
    for value in (False, True):
        material.cdrf.view_dependence = value
        assert cdrf_node(obj) == node
        assert (node.node_tree == with_walk) is value
        assert (ids.FREE_PATH in node.inputs) is value
        assert material.cdrf.sigma0 == 0.125
        assert tuple(material.cdrf.sigma0_ratio) == (1.0, 0.5, 0.25)
        assert node.inputs[ids.STRENGTH].default_value == 0.75
        assert node.inputs[ids.BASE_COLOR].links[0].from_node == texture
        assert node.outputs[ids.SHADER].is_linked
        assert due(obj) == []
    assert free_path(obj) == (0.5, 0.25, 0.125)


def test_the_free_path_survives_whatever_swaps_the_group(rig: Rig) -> None:
    obj = translucent(rig, node_material())
    own = obj.active_material.cdrf
    cdrf_node(obj).inputs[ids.FREE_PATH].default_value = (0.5, 0.25, 0.125)
    own.sigma0_ratio = (1.0, 1.0, 1.0)
    own.ambient_occlusion = True
    rig.light("POINT", location=(3.0, 0.0, 0.0))
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    assert free_path(obj) == (0.5, 0.25, 0.125)
    for kind in (RING, SPHERE):
        assert bpy.ops.cdrf.set_model(model=kind) == {"FINISHED"}
    assert free_path(obj) == (0.5, 0.25, 0.125)
    assert bpy.ops.cdrf.remove() == {"FINISHED"}
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    assert own.view_dependence
    assert free_path(obj) == (0.5, 0.25, 0.125)


def test_the_ring_is_untouched(rig: Rig) -> None:
    obj = translucent(rig, node_material())
    assert bpy.ops.cdrf.set_model(model=RING, view_dependence=True) == {"FINISHED"}
    own = obj.active_material.cdrf
    assert own.model == RING and not own.view_dependence
    assert walk_of(obj) == "" and ids.FREE_PATH not in cdrf_node(obj).inputs
    ring = cdrf_node(obj).node_tree
    own.view_dependence = True
    assert bpy.ops.cdrf.preset(preset="SKIN2") == {"FINISHED"}
    assert own.model == RING and cdrf_node(obj).node_tree == ring
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    assert walk_of(obj) == ""


def test_the_menu_offers_three_and_the_first_switches_it_on(rig: Rig) -> None:
    assert MEASURED not in OFFERED_KINDS
    assert [kind for kind, *_ in MODEL_ITEMS] == [*OFFERED_KINDS, MEASURED]
    assert CDRF_MT_model.is_registered
    obj = translucent(rig)
    own = obj.active_material.cdrf
    assert bpy.ops.cdrf.set_model(model=SPHERE) == {"FINISHED"}
    assert not own.view_dependence, "a script's call changes the model alone"
    assert bpy.ops.cdrf.set_model(model=SPHERE, view_dependence=True) == {"FINISHED"}
    assert own.view_dependence and own.model == SPHERE
    assert due(obj) == []


def test_each_model_in_the_menu_has_its_own_tooltip(rig: Rig) -> None:
    tips = {kind: tip for kind, _, tip in MODEL_ITEMS}
    for kind in OFFERED_KINDS:
        properties = SimpleNamespace(model=kind)
        assert CDRF_OT_set_model.description(bpy.context, properties) == tips[kind]


def test_a_sphere_gets_its_mean_curvature_without_update(rig: Rig) -> None:
    obj = translucent(rig, round_=True)
    own = obj.active_material.cdrf
    own.view_dependence = True
    node = cdrf_node(obj)
    switched = node.inputs[ids.MEAN].default_value
    assert switched == pytest.approx(obj.data.cdrf.mean_values[3], rel=STORED)
    assert switched == pytest.approx(1.0, rel=1e-2)
    assert due(obj) == []
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    assert node.inputs[ids.MEAN].default_value == pytest.approx(switched, rel=STORED)


def test_a_plane_can_be_switched_too(rig: Rig) -> None:
    rig.light("SUN", angle=0.0)
    bpy.ops.mesh.primitive_plane_add(rotation=(np.pi / 2, 0.0, 0.0))
    obj = bpy.context.object
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    obj.active_material.cdrf.view_dependence = True
    assert walk_of(obj) == DEFAULT_WALK.key and ids.MEAN not in cdrf_node(obj).inputs
    assert due(obj) == []


def test_detail_and_the_warning_of_overridden_distances_stay(rig: Rig) -> None:
    from cdrf_addon.blender.material.scatter_distance import overridden

    obj = translucent(rig, node_material())
    own = obj.active_material.cdrf
    cdrf_node(obj).inputs[ids.SIGMA0].keyframe_insert("default_value", frame=1)
    warning = overridden(obj.active_material)
    assert "animated" in warning
    own.view_dependence = False
    assert overridden(obj.active_material) == warning


def test_undo_takes_back_the_switch(rig: Rig) -> None:
    translucent(rig, node_material())
    bpy.ops.ed.undo_push(message="set up")
    bpy.data.objects["Body"].active_material.cdrf.view_dependence = False
    bpy.ops.ed.undo_push(message="switch")
    bpy.ops.ed.undo()
    obj = bpy.data.objects["Body"]
    assert obj.active_material.cdrf.view_dependence and walk_of(obj)
    assert due(obj) == []
    bpy.ops.ed.redo()
    obj = bpy.data.objects["Body"]
    assert not obj.active_material.cdrf.view_dependence and walk_of(obj) == ""
    assert due(obj) == []


def test_a_copy_is_switched_alone(rig: Rig) -> None:
    obj = translucent(rig, node_material())
    first = obj.active_material
    second = first.copy()
    obj.active_material = second
    before = free_path(obj)
    second.cdrf.view_dependence = False
    assert first.cdrf.view_dependence and not second.cdrf.view_dependence
    second.cdrf.view_dependence = True
    assert free_path(obj) == before


# --- what is read -------------------------------------------------------------------------------


def notes_of(material: bpy.types.Material, view_dependent: bool) -> str:
    from cdrf_addon.blender.material.scattering import read_scattering

    found = read_scattering(material)
    assert found is not None
    return " ".join(found.notes_for(view_dependent))


@pytest.mark.parametrize(
    ("method", "said"), [("RANDOM_WALK", True), ("RANDOM_WALK_SKIN", False), ("BURLEY", False)]
)
def test_a_roughness_from_a_texture_is_said_where_it_counts(
    rig: Rig, method: str, said: bool
) -> None:
    material = node_material(method=method)
    tree = material.node_tree
    principled = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    noise = tree.nodes.new("ShaderNodeTexNoise")
    tree.links.new(noise.outputs[0], principled.inputs["Roughness"])
    obj = translucent(rig, material)
    own = material.cdrf
    assert own.view_dependence is (method != "BURLEY")
    assert ("Roughness" in notes_of(material, own.view_dependence)) is said
    assert "Roughness" not in notes_of(material, False)
    assert not said or walk_of(obj).split()[1] == "0.25"


# --- files --------------------------------------------------------------------------------------


def test_an_older_file_stays_as_it_was_until_it_is_switched_on(rig: Rig) -> None:
    obj = translucent(rig, node_material())
    obj.active_material.cdrf.view_dependence = False
    as_older_file(obj)
    own = obj.active_material.cdrf
    picture = rig.render()
    assert own.model == SPHERE and not own.view_dependence
    assert due(obj) == []
    own.view_dependence = True
    # The artist's own node says by which walk.
    assert walk_of(obj) == MaterialWalk(walk_method("RANDOM_WALK"), 0.25, 1.5).key
    assert any("View Dependence needs" in reason for reason in due(obj))
    changed = rig.render()
    covered = changed[..., 3] > 0.999
    assert np.isfinite(changed).all()
    # Not black: without H and shape operator it is as on a flat surface, and the blur stays.
    before, after = picture[covered][:, :3], changed[covered][:, :3]
    lit = before.min(axis=1) > 0.3 * before.max()
    assert lit.sum() > 500
    share = after[lit] / before[lit]
    assert share.min() > 0.7 and share.max() < 1.4
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    assert due(obj) == []
    assert all(name in obj.data.attributes for name in WALK_ATTRIBUTES)
    own.view_dependence = False
    assert np.abs(rig.render() - picture).max() <= 1e-3 * picture.max()


def test_an_older_file_is_the_same_after_update(rig: Rig) -> None:
    obj = translucent(rig, node_material())
    obj.active_material.cdrf.view_dependence = False
    as_older_file(obj)
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    assert not obj.active_material.cdrf.view_dependence and walk_of(obj) == ""


def test_an_older_sphere_that_shares_a_material_gets_what_is_missing(rig: Rig) -> None:
    material = node_material()
    egg = translucent(rig, material)
    ball = rig.sphere(subdivisions=3)
    ball.location = (3.0, 0.0, 0.0)
    ball.data.materials.append(material)
    bpy.context.view_layer.update()
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    material.cdrf.view_dependence = False
    for obj in (egg, ball):
        for name in WALK_ATTRIBUTES:
            obj.data.attributes.remove(obj.data.attributes[name])
    material.cdrf.view_dependence = True
    assert due(egg) and due(ball)
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    assert due(egg) == due(ball) == []
    mean = np.empty(4 * len(ball.data.vertices), np.float32)
    ball.data.attributes[ids.MEAN_ATTRIBUTE].data.foreach_get("color", mean)
    assert mean == pytest.approx(1.0, rel=2e-2)


def test_it_is_saved(rig: Rig, tmp_path: Path) -> None:
    translucent(rig, node_material())
    obj = bpy.data.objects["Body"]
    cdrf_node(obj).inputs[ids.FREE_PATH].default_value = (0.5, 0.25, 0.125)
    before = walk_of(obj)
    path = str(tmp_path / "kept.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    obj = bpy.data.objects["Body"]
    assert due(obj) == []
    for value in (False, True):
        obj.active_material.cdrf.view_dependence = value
    assert walk_of(obj) == before
    assert free_path(obj) == (0.5, 0.25, 0.125)


@pytest.mark.parametrize("link", [False, True])
def test_it_goes_into_another_file(rig: Rig, tmp_path: Path, link: bool) -> None:
    translucent(rig, node_material())
    before = walk_of(bpy.data.objects["Body"])
    path = str(tmp_path / "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    Rig()
    with bpy.data.libraries.load(path, link=link) as (_, wanted):
        wanted.objects = ["Body"]
    obj = wanted.objects[0]
    bpy.context.collection.objects.link(obj)
    bpy.context.view_layer.update()
    own = obj.active_material.cdrf
    assert own.view_dependence and walk_of(obj) == before
    if link:
        own.view_dependence = False
        assert own.view_dependence, "a linked material stays as it is"
        obj = obj.override_create(remap_local_usages=True)
        obj.select_set(True)
        bpy.context.view_layer.objects.active = obj
        assert bpy.ops.cdrf.setup() == {"FINISHED"}
    else:
        assert bpy.ops.cdrf.update() == {"FINISHED"}
    material = obj.material_slots[0].material
    node = material.node_tree.nodes[ids.NODE]
    assert material.is_editable and material.cdrf.view_dependence
    settings.set_view_dependent(material, False)
    assert node.node_tree[ids.WALK_KEY] == ""
    settings.set_view_dependent(material, True)
    assert node.node_tree[ids.WALK_KEY] == before
    assert due(obj) == []


def test_the_batch_takes_the_models_and_leaves_the_switch(rig: Rig) -> None:
    from cdrf_addon.command import batch_scene
    from cdrf_addon.command.batch_options import BatchOptions

    obj = translucent(rig, node_material())
    own = obj.active_material.cdrf
    for kind, view in ((RING, False), (SPHERE, True), ("PROFILE", False), (SPHERE, True)):
        batch_scene._set_model(obj.active_material, BatchOptions(model=kind))
        assert (own.model, own.view_dependence) == (kind, view)
    own.view_dependence = False
    batch_scene._set_model(obj.active_material, BatchOptions(model=SPHERE))
    assert not own.view_dependence
    batch_scene._set_model(obj.active_material, BatchOptions(preset="SKIN1"))
    assert own.view_dependence


def test_groups_of_walks_that_nobody_uses_are_removed(rig: Rig) -> None:
    material = node_material("SUBSURFACE_SCATTERING")
    rig.sphere()
    bpy.context.object.data.materials.append(material)
    bpy.ops.cdrf.setup()
    count = len(bpy.data.node_groups)
    node = next(n for n in material.node_tree.nodes if n.type == "SUBSURFACE_SCATTERING")
    for step in range(5):
        node.inputs["Roughness"].default_value = 0.1 + 0.1 * step
        assert bpy.ops.cdrf.read_shader() == {"FINISHED"}
        assert bpy.ops.cdrf.update() == {"FINISHED"}
    assert len(bpy.data.node_groups) == count
    assert bpy.ops.cdrf.remove() == {"FINISHED"}
    assert not [group for group in bpy.data.node_groups if "Walk" in group.name]


def test_removing_one_user_of_a_mesh_leaves_the_other_its_curvature(rig: Rig) -> None:
    bpy.ops.mesh.primitive_torus_add()
    first = bpy.context.object
    first.data.materials.append(node_material("SUBSURFACE_SCATTERING"))
    second = first.copy()
    rig.scene.collection.objects.link(second)
    second.material_slots[0].link = "OBJECT"
    second.material_slots[0].material = node_material("SUBSURFACE_SCATTERING")
    second.select_set(True)
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    second.select_set(False)
    assert bpy.ops.cdrf.remove() == {"FINISHED"}
    assert ids.SHAPE_ATTRIBUTE in first.data.attributes
    second.select_set(True)
    assert bpy.ops.cdrf.remove() == {"FINISHED"}
    assert ids.SHAPE_ATTRIBUTE not in first.data.attributes
