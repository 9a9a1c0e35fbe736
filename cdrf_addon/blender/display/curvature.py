# SPDX-License-Identifier: GPL-3.0-or-later
"""Curvature in colours in place of the translucent surface (paper, Fig. 3a), and back again."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import bpy

from ... import ids
from ...core.errors import SceneError
from ..material.install import cdrf_node, cdrf_output, surface_socket
from ..nodes.curvature import display_group
from ..nodes.tree import TreeBuilder
from ..shader.curvature import curvature_nodes, diffused_node, level_nodes, size_node
from ..shader.variant import ATTRIBUTE, CONSTANT, SCALED, stamped_variant

QUANTITIES = {
    "KAPPA": ("Curvature", "Curvedness as measured, whatever its sign: hot where it is sharp"),
    "DIFFUSED": (
        "Curvature as Rendered",
        "Curvature over the distance that red light scatters: what the shading uses",
    ),
    "MEAN": ("Signed Mean Curvature", "Hollows blue, flat parts grey, bulges red"),
}
"""What can be shown: its title and what it means."""
SIGNED_QUANTITIES = {"MEAN"}
# Colours are shown as they are: a film-like view transform would not match the legend.
_PLAIN = {
    "view_transform": "Standard",
    "look": "None",
    "exposure": 0.0,
    "gamma": 1.0,
    "use_curve_mapping": False,
    "use_white_balance": False,
}


def _display_nodes(material: bpy.types.Material) -> list[bpy.types.ShaderNode]:
    nodes = material.node_tree.nodes if material.node_tree else ()
    return [node for node in nodes if node.get(ids.ROLE_KEY) == ids.ROLE_DISPLAY_PART]


def shows_curvature(material: bpy.types.Material) -> bool:
    """Return whether the material shows its curvature just now."""
    return bool(_display_nodes(material))


def showing_materials() -> list[bpy.types.Material]:
    """List the materials of the file that show their curvature just now."""
    return [one for one in bpy.data.materials if shows_curvature(one)]


def value_range(meshes: Iterable[bpy.types.Mesh], quantity: str) -> tuple[float, float]:
    """Return the values of the first and last colour: 5th to 95th percentile, or +- the 95th."""
    known = [mesh.cdrf for mesh in meshes]
    if quantity in SIGNED_QUANTITIES:
        high = max((one.mean_high for one in known), default=0.0) or 1.0
        return -high, high
    low = min((one.low for one in known), default=0.0)
    high = max((one.high for one in known), default=1.0)
    # One curvature everywhere is shown in one colour, not divided by zero.
    return low, max(high, low * 1.001, 1e-6)


def show(
    scene: bpy.types.Scene,
    materials: dict[bpy.types.Material, list[bpy.types.Mesh]],
    quantity: str = "KAPPA",
) -> None:
    """Show the curvature of some materials' meshes, all on one scale, and keep the legend's data.

    Args:
        scene: Its view settings are kept for `hide`.
        materials: The translucent materials, each with the meshes that show it.
        quantity: A key of QUANTITIES.

    Raises:
        SceneError: None of the materials can show it.
    """
    materials = {one: meshes for one, meshes in materials.items() if cdrf_output(one) is not None}
    if not materials:
        raise SceneError("The CDRF Material Output was deleted: press Update first.")
    low, high = value_range({mesh for meshes in materials.values() for mesh in meshes}, quantity)
    for material in materials:
        show_surface(material)
        _show_on(material, quantity, low, high)
    view = scene.view_settings
    kept = scene.get(ids.DISPLAY_KEY)
    if kept is not None:
        before = kept["before"].to_dict()
    else:
        before = {name: getattr(view, name) for name in _PLAIN if hasattr(view, name)}
    scene[ids.DISPLAY_KEY] = {"quantity": quantity, "low": low, "high": high, "before": before}
    for name in before:
        _set(view, name, _PLAIN[name])


def hide(materials: Iterable[bpy.types.Material]) -> None:
    """Show the surfaces again, and in every scene without such colours its former view settings.

    A view setting that was changed meanwhile stays as it is.
    """
    for material in materials:
        show_surface(material)
    for scene in bpy.data.scenes:
        kept = scene.get(ids.DISPLAY_KEY)
        if kept is None or any(map(shows_curvature, _materials_in(scene))):
            continue
        view = scene.view_settings
        for name, value in kept["before"].to_dict().items():
            if getattr(view, name) == _PLAIN[name]:
                _set(view, name, value)
        del scene[ids.DISPLAY_KEY]


def _set(view: bpy.types.ColorManagedViewSettings, name: str, value: Any) -> None:
    try:
        setattr(view, name, value)
    except TypeError:
        # A studio's colour configuration need not have Blender's transforms; the colours of the
        # legend are then a little off, which is no reason to stop.
        return


def _materials_in(scene: bpy.types.Scene) -> set[bpy.types.Material]:
    slots = (slot for obj in scene.objects for slot in obj.material_slots)
    return {slot.material for slot in slots if cdrf_node(slot.material) is not None}


def refresh(
    scene: bpy.types.Scene, materials: dict[bpy.types.Material, list[bpy.types.Mesh]]
) -> None:
    """Bring the materials that show curvature up to date with new curvature and node groups."""
    kept = scene.get(ids.DISPLAY_KEY)
    if kept is not None and any(map(shows_curvature, materials)):
        show(scene, materials, kept["quantity"])


def show_surface(material: bpy.types.Material) -> None:
    """Remove the display's nodes from a material and connect the translucent surface again."""
    if cdrf_node(material) is None or not shows_curvature(material):
        return
    tree = material.node_tree
    for node in _display_nodes(material):
        tree.nodes.remove(node)
    output = cdrf_output(material)
    if output is not None:
        tree.links.new(surface_socket(material), output.inputs["Surface"])


def _show_on(material: bpy.types.Material, quantity: str, low: float, high: float) -> None:
    node = cdrf_node(material)
    output = cdrf_output(material)
    if node is None or output is None:
        return
    tree = material.node_tree
    builder = TreeBuilder(tree)
    before = {each.name for each in tree.nodes}
    filled = builder.node("ShaderNodeAttribute", attribute_name=ids.FILLED_ATTRIBUTE)
    shown = builder.group(
        display_group(signed=quantity in SIGNED_QUANTITIES),
        ids.DISPLAY_NODE,
        Curvature=_quantity_nodes(builder, node, quantity),
        Minimum=low,
        Maximum=high,
        Mark=filled.outputs["Fac"],
    )
    added = [each for each in tree.nodes if each.name not in before]
    for column, part in enumerate(added):
        part[ids.ROLE_KEY] = ids.ROLE_DISPLAY_PART
        part.location = (node.location[0] - 600.0 + 190.0 * column, node.location[1] + 260.0)
    builder.feed(output.inputs["Surface"], shown.outputs[ids.SHADER])


def _quantity_nodes(b: TreeBuilder, node: bpy.types.ShaderNode, quantity: str) -> Any:
    source = stamped_variant(node.node_tree).source
    if source == CONSTANT:
        return node.inputs[ids.CURVATURE].default_value
    if source not in {ATTRIBUTE, SCALED}:
        return 0.0
    if quantity != "DIFFUSED":
        return curvature_nodes(b, scaled=source == SCALED, signed=quantity in SIGNED_QUANTITIES)
    # The scatter distance of the moment: it may be animated or come from other nodes.
    sigma0: Any = node.inputs[ids.SIGMA0]
    sigma0 = sigma0.links[0].from_socket if sigma0.is_linked else sigma0.default_value
    red = b.math("MULTIPLY", sigma0, node.inputs[ids.SIGMA0_RATIO].default_value[0])
    if source == ATTRIBUTE:
        return diffused_node(b, level_nodes(b), red)
    size = size_node(b)
    kappa = diffused_node(b, level_nodes(b), b.math("MULTIPLY", red, size))
    return b.math("MULTIPLY", kappa, size)
