# SPDX-License-Identifier: GPL-3.0-or-later
"""A material's settings have one home, whoever reads or writes them."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import bpy
import pytest
from rig import Rig, cdrf_node

from cdrf_addon import ids
from cdrf_addon.blender.material import settings

PACKAGE = Path(__file__).resolve().parents[2] / "cdrf_addon"


def names_with_setter() -> set[str]:
    """Properties of `material.cdrf` that Blender hands to a function when they are written."""
    tree = ast.parse((PACKAGE / "ui" / "properties.py").read_text("utf-8"))
    return {
        node.target.id
        for node in ast.walk(tree)
        if isinstance(node, ast.AnnAssign)
        and isinstance(node.target, ast.Name)
        and isinstance(node.annotation, ast.Call)
        and any(keyword.arg == "set" for keyword in node.annotation.keywords)
    }


def written_names(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Attributes that a module writes, whatever they belong to, with their lines."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store | ast.Del):
            yield node.lineno, node.attr
        elif (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Name)
            and node.func.id == "setattr"
            and isinstance(node.args[1], ast.Constant)
        ):
            yield node.lineno, str(node.args[1].value)


def test_nothing_in_blender_writes_a_property_that_has_a_setter() -> None:
    guarded = names_with_setter()
    assert guarded == {
        *("sigma0", "sigma0_ratio", "model", "gloss", "ambient_occlusion"),
        "view_dependence",
    }
    found = [
        f"{path.relative_to(PACKAGE)}:{line} writes .{name}"
        for path in sorted((PACKAGE / "blender").rglob("*.py"))
        for line, name in written_names(ast.parse(path.read_text("utf-8")))
        if name in guarded
    ]
    assert found == []


def test_the_check_finds_every_way_to_write() -> None:
    text = "m.cdrf.sigma0 = 1; s.gloss *= 2; (a.model, b) = c; setattr(x, 'sigma0_ratio', y.read)"
    names = {name for _, name in written_names(ast.parse(text))}
    assert names == {"sigma0", "gloss", "model", "sigma0_ratio"}


def test_properties_and_functions_are_one_home(rig: Rig) -> None:
    obj = rig.sphere()
    material = bpy.data.materials.new("Wax")
    obj.data.materials.append(material)
    assert not settings.is_sigma0_chosen(material)
    for translucent in (False, True):
        if translucent:
            assert bpy.ops.cdrf.setup() == {"FINISHED"}
        material.cdrf.sigma0, material.cdrf.sigma0_ratio = 0.25, (1.0, 0.5, 0.5)
        assert settings.sigma0(material) == 0.25
        assert settings.sigma0_ratio(material) == (1.0, 0.5, 0.5)
        settings.set_sigma0(material, 0.5)
        settings.set_sigma0_ratio(material, (0.5, 0.25, 1.0))
        assert material.cdrf.sigma0 == 0.5
        assert tuple(material.cdrf.sigma0_ratio) == (0.5, 0.25, 1.0)
        for value in (True, False):
            settings.set_specular(material, value)
            settings.set_occluded(material, value)
            settings.set_view_dependent(material, value)
            assert material.cdrf.gloss is value
            assert material.cdrf.ambient_occlusion is value
            assert material.cdrf.view_dependence is value
        assert settings.is_sigma0_chosen(material)


def test_numbers_that_a_float_makes_equal_share_a_look_up(rig: Rig) -> None:
    obj = rig.sphere()
    obj.scale = (1.0, 1.0, 1.2)
    bpy.context.view_layer.update()
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    settings.set_sigma0_ratio(obj.active_material, (0.3, 0.3 + 1e-12, 0.3 - 1e-12))
    assert cdrf_node(obj).node_tree[ids.CHANNELS_KEY] == "RGB"


@pytest.mark.parametrize("value", [float("nan"), -1.0])
def test_senseless_numbers_become_zero(rig: Rig, value: float) -> None:
    material = bpy.data.materials.new("Wax")
    settings.set_sigma0(material, value)
    settings.set_sigma0_ratio(material, (value, 1e9, 1.0))
    assert settings.sigma0(material) == 0.0
    assert settings.sigma0_ratio(material) == (0.0, settings.RATIO_MAX, 1.0)
