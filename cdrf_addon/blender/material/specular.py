# SPDX-License-Identifier: GPL-3.0-or-later
"""The specular half of the artist's Principled BSDF on top of the translucent surface.

A copy of the node without its diffuse half is added to CDRF, so that lights, world and reflections
are Blender's own and nothing is lit twice:

    CDRF x what the specular half lets through --+
    copy: black, not metallic -------------------+-> Add --+
    copy: metallic 1 (only where it is metallic) ----------+-> Mix by Metallic -> alpha, output

The artist's node stays as it is; removing ours restores the material. Artists know this as gloss.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy

from ... import ids
from ...compat import uses_nodes
from ...core.reflectance.specular import BIAS, FADE, SCALE
from ..nodes.tree import TreeBuilder, declare, ensure_group
from .install import cdrf_node, own_node, socket_before_alpha

VERSION = 1

METALLIC, LEVEL = "Metallic", "Specular IOR Level"
# Inputs that would add the other halves of a Principled BSDF; alpha is mixed in behind the sum.
WITHOUT: dict[str, Any] = {
    "Subsurface Weight": 0.0,
    "Transmission Weight": 0.0,
    "Alpha": 1.0,
}
BLACK: dict[str, Any] = {"Base Color": (0.0, 0.0, 0.0, 1.0), METALLIC: 0.0}
METAL: dict[str, Any] = {METALLIC: 1.0, "Emission Strength": 0.0}
PARTS = {ids.ROLE_GLOSS, ids.ROLE_METAL, ids.ROLE_GLOSS_PART, ids.ROLE_GLOSS_END}


def find_principled(material: bpy.types.Material) -> bpy.types.ShaderNode | None:
    """Return the Principled BSDF that feeds the artist's own output first, or None."""
    if not uses_nodes(material):
        return None
    outputs = [
        node
        for node in material.node_tree.nodes
        if node.type == "OUTPUT_MATERIAL" and ids.ROLE_KEY not in node
    ]
    outputs.sort(key=lambda node: (node.target == "EEVEE", node.is_active_output), reverse=True)
    pending = [output.inputs["Surface"] for output in outputs]
    seen = set()
    while pending:
        socket = pending.pop(0)
        if not socket.is_linked:
            continue
        node = socket.links[0].from_node
        if node.name in seen or ids.ROLE_KEY in node:
            continue
        seen.add(node.name)
        if node.type == "BSDF_PRINCIPLED" and not node.mute:
            return node
        pending += [one for one in node.inputs if one.type in {"SHADER", "CUSTOM"}]
    return None


def is_worth_keeping(material: bpy.types.Material) -> bool:
    """Return whether the artist's Principled BSDF is specular, and not all metal."""
    node = find_principled(material)
    if node is None:
        return False
    level, metallic = node.inputs[LEVEL], node.inputs[METALLIC]
    specular = any(
        socket.is_linked or socket.default_value > 0.0
        for socket in (level, node.inputs["Coat Weight"], node.inputs["Sheen Weight"])
    )
    return specular and (metallic.is_linked or metallic.default_value < 1.0)


def has_specular(material: bpy.types.Material) -> bool:
    """Return whether the specular half was added to a translucent material."""
    return own_node(material.node_tree, ids.ROLE_GLOSS_END) is not None


def is_outdated(material: bpy.types.Material) -> bool:
    """Return whether the specular half is no longer that of the artist's node."""
    if not has_specular(material):
        return False
    source = find_principled(material)
    copy = own_node(material.node_tree, ids.ROLE_GLOSS)
    if source is None or copy is None:
        return True
    metallic = source.inputs[METALLIC]
    metal = own_node(material.node_tree, ids.ROLE_METAL)
    if (metal is not None) != (metallic.is_linked or metallic.default_value > 0.0):
        return True
    return any(_differ(source, copy, name) for name in _mirrored(copy, BLACK)) or (
        metal is not None and any(_differ(source, metal, name) for name in _mirrored(metal, METAL))
    )


def _mirrored(copy: bpy.types.ShaderNode, besides: dict[str, Any]) -> Iterator[str]:
    """Yield the inputs of a copy that have what the artist's node has."""
    for socket in copy.inputs:
        # Inputs that a mode does not use cannot be found by name.
        shown = socket.enabled and hasattr(socket, "default_value")
        if shown and socket.name not in {*WITHOUT, *besides}:
            yield socket.name


def _differ(source: bpy.types.ShaderNode, copy: bpy.types.ShaderNode, name: str) -> bool:
    one, other = source.inputs[name], copy.inputs[name]
    if one.is_linked or other.is_linked:
        if not (one.is_linked and other.is_linked):
            return True
        return bool(one.links[0].from_socket != other.links[0].from_socket)
    return _value(one) != _value(other)


def _value(socket: bpy.types.NodeSocket) -> Any:
    value = socket.default_value
    return tuple(value) if hasattr(value, "__iter__") and not isinstance(value, str) else value


def remove_specular(material: bpy.types.Material) -> None:
    """Remove the specular half; the translucent surface stays."""
    node = cdrf_node(material)
    tree = material.node_tree
    if node is None or not has_specular(material):
        return
    targets = [link.to_socket for link in socket_before_alpha(material).links]
    for part in list(tree.nodes):
        if part.get(ids.ROLE_KEY) in PARTS:
            tree.nodes.remove(part)
    for target in targets:
        tree.links.new(node.outputs[ids.SHADER], target)


def add_specular(material: bpy.types.Material) -> bool:
    """Add the artist's specular half to a translucent material, or bring it up to date.

    Returns:
        False where there is no Principled BSDF to take it from.
    """
    remove_specular(material)
    node, source = cdrf_node(material), find_principled(material)
    if node is None or source is None:
        return False
    tree = material.node_tree
    targets = [link.to_socket for link in node.outputs[ids.SHADER].links]
    before = {each.name for each in tree.nodes}
    b = TreeBuilder(tree)
    specular = _copy(b, source, BLACK)
    end = _sum(b, node, source, specular)
    metallic = source.inputs[METALLIC]
    if metallic.is_linked or metallic.default_value > 0.0:
        metal = _copy(b, source, METAL)
        mix = b.node("ShaderNodeMixShader")
        part = metallic.links[0].from_socket if metallic.is_linked else metallic.default_value
        _feed_in_order(b, mix, part, end, metal.outputs["BSDF"])
        metal[ids.ROLE_KEY] = ids.ROLE_METAL
        end = mix.outputs["Shader"]
    for each in tree.nodes:
        if each.name not in before and ids.ROLE_KEY not in each:
            each[ids.ROLE_KEY] = ids.ROLE_GLOSS_PART
    specular[ids.ROLE_KEY] = ids.ROLE_GLOSS
    end.node[ids.ROLE_KEY] = ids.ROLE_GLOSS_END
    _place(tree, node, before)
    for target in targets:
        tree.links.new(end, target)
    return True


def _copy(
    b: TreeBuilder, source: bpy.types.ShaderNode, changed: dict[str, Any]
) -> bpy.types.ShaderNode:
    copy = b.node(
        "ShaderNodeBsdfPrincipled",
        distribution=source.distribution,
        subsurface_method=source.subsurface_method,
    )
    for name in _mirrored(copy, changed):
        socket = source.inputs[name]
        if socket.is_linked:
            b.feed(copy.inputs[name], socket.links[0].from_socket)
        else:
            copy.inputs[name].default_value = socket.default_value
    for name, value in (WITHOUT | changed).items():
        copy.inputs[name].default_value = value
    return copy


def _sum(
    b: TreeBuilder,
    node: bpy.types.ShaderNode,
    source: bpy.types.ShaderNode,
    specular: bpy.types.ShaderNode,
) -> bpy.types.NodeSocket:
    """Scale CDRF by what the specular half lets through and add that half."""

    def given(name: str) -> Any:
        socket = source.inputs[name]
        return socket.links[0].from_socket if socket.is_linked else _value(socket)

    through = _through(b, given("Normal"), given("Roughness"), given("IOR"), given(LEVEL), 1.0)
    coat = given("Coat Weight")
    if coat != 0.0:
        under = _through(
            b, given("Coat Normal"), given("Coat Roughness"), given("Coat IOR"), 0.5, coat
        )
        through = b.math("MULTIPLY", through, under)
    scaled = b.node("ShaderNodeMixShader")
    _feed_in_order(b, scaled, through, None, node.outputs[ids.SHADER])
    total = b.node("ShaderNodeAddShader")
    _feed_in_order(b, total, scaled.outputs["Shader"], specular.outputs["BSDF"])
    return total.outputs["Shader"]


def _through(
    b: TreeBuilder, normal: Any, roughness: Any, ior: Any, level: Any, weight: Any
) -> bpy.types.NodeSocket:
    group = b.node("ShaderNodeGroup", node_tree=under_specular_group())
    if isinstance(normal, bpy.types.NodeSocket):
        b.feed(group.inputs[ids.NORMAL], normal)
    for name, value in (
        ("Roughness", roughness),
        ("IOR", ior),
        (LEVEL, level),
        (ids.WEIGHT, weight),
    ):
        b.feed(group.inputs[name], value)
    return group.outputs[ids.FACTOR]


def _feed_in_order(b: TreeBuilder, node: bpy.types.ShaderNode, *operands: Any) -> None:
    """Feed inputs that share a name; None leaves one empty, which is black."""
    for socket, operand in zip(node.inputs, operands, strict=True):
        if operand is not None:
            b.feed(socket, operand)


def _place(tree: bpy.types.ShaderNodeTree, node: bpy.types.ShaderNode, before: set[str]) -> None:
    x, y = node.location
    for row, added in enumerate(each for each in tree.nodes if each.name not in before):
        added.location = (x + 60.0 * row, y + 240.0 + 90.0 * row)
        added.hide = True


def under_specular_group() -> bpy.types.ShaderNodeTree:
    """Return the group: part of the light that passes a roughness and IOR.

    The albedo of the specular half is the fit in core/reflectance/specular.py.
    """

    def build(b: TreeBuilder) -> None:
        declare(b.tree, ids.NORMAL, "Vector", hide_value=True, tip="Unconnected, the surface's own")
        declare(b.tree, "Roughness", default=0.5, low=0.0, high=1.0)
        declare(b.tree, "IOR", default=1.5, low=1.0)
        declare(b.tree, LEVEL, default=0.5, low=0.0, high=1.0)
        declare(b.tree, ids.WEIGHT, default=1.0, low=0.0, high=1.0, tip="Part that is glossy")
        declare(b.tree, ids.FACTOR, output=True)
        given, result = b.ends()
        geometry = b.node("ShaderNodeNewGeometry").outputs
        unset = b.math("LESS_THAN", b.vector("DOT_PRODUCT", *(given[ids.NORMAL],) * 2), 1e-12)
        own = b.vector("SCALE", geometry["Normal"], scale=unset)
        normal = b.vector("ADD", given[ids.NORMAL], own)
        n = b.math("ABSOLUTE", b.vector("DOT_PRODUCT", normal, geometry["Incoming"]))
        r = given["Roughness"]
        ior = given["IOR"]
        root = b.math("DIVIDE", b.math("SUBTRACT", ior, 1.0), b.math("ADD", ior, 1.0))
        f0 = b.math("MULTIPLY", b.math("MULTIPLY", root, root), given[LEVEL])
        f0 = b.math("MULTIPLY", f0, 2.0)
        a0, a1, a2, a3 = SCALE
        slope = b.math("MULTIPLY_ADD", r, a3, a2)
        scale = b.math("MULTIPLY_ADD", n, slope, b.math("MULTIPLY_ADD", r, a1, a0))
        b0, b1, b2, b3, b4, b5, b6, b7 = BIAS
        first = b.math("MULTIPLY_ADD", r, b.math("MULTIPLY_ADD", r, b4, b1), b0)
        second = b.math("MULTIPLY_ADD", r, b.math("MULTIPLY_ADD", r, b5, b3), b2)
        second = b.math("MULTIPLY_ADD", n, b.math("MULTIPLY_ADD", r, b7, b6), second)
        bias = b.math("EXPONENT", b.math("MULTIPLY_ADD", n, second, first))
        bias = b.math("MULTIPLY", bias, b.math("MULTIPLY", f0, FADE, clamp=True))
        taken = b.math("MULTIPLY_ADD", f0, scale, bias, clamp=True)
        taken = b.math("MULTIPLY", taken, given[ids.WEIGHT])
        b.feed(result[ids.FACTOR], b.math("SUBTRACT", 1.0, taken, clamp=True))

    return ensure_group("CDRF Under Gloss", ids.ROLE_UNDER_GLOSS, VERSION, build)
