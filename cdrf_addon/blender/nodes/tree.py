# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds shader node trees: operands in, output socket back, links by socket name.

Also finds, makes and rebuilds the node groups whose content never depends on a scene.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import bpy

from ... import ids

Socket: TypeAlias = bpy.types.NodeSocket
"""An input or output of a node."""
Sockets: TypeAlias = Mapping[str, Socket]
"""A node's inputs or outputs, by name."""
Value: TypeAlias = float | tuple[float, ...]
"""A number, vector or colour."""
Operand: TypeAlias = Socket | Value
"""What an input takes: an output to link, or a value."""

COLUMN_WIDTH = 190.0
ROW_HEIGHT = 170.0


class TreeBuilder:
    """Adds nodes to a tree. Arithmetic returns the output socket that carries its result.

    Operands are sockets (linked) or numbers (set as the input's value), so that the code reads as
    an expression: ``b.math("SQRT", b.math("MULTIPLY", x, 2.0))``.
    """

    def __init__(self, tree: bpy.types.ShaderNodeTree) -> None:
        self.tree = tree

    def node(self, kind: str, label: str = "", **settings: Any) -> bpy.types.ShaderNode:
        """Add a node of the type `kind`; `settings` are its properties."""
        node = self.tree.nodes.new(kind)
        if label:
            node.name = node.label = label
        for name, value in settings.items():
            setattr(node, name, value)
        return node

    def group(
        self, tree: bpy.types.ShaderNodeTree, label: str, **operands: Operand
    ) -> bpy.types.ShaderNode:
        """Add an instance of a node group.

        Args:
            tree: The node group.
            label: Name and label of the instance.
            **operands: By name of the input, with ``_`` for a blank.
        """
        node = self.node("ShaderNodeGroup", label, node_tree=tree)
        for name, operand in operands.items():
            self.feed(node.inputs[name.replace("_", " ")], operand)
        return node

    def feed(self, socket: Socket, operand: Operand) -> None:
        """Link an input or set its value.

        Raises:
            ValueError: Blender ignores this input in the node's present mode.
        """
        if not socket.enabled:
            raise ValueError(f"{socket.node.name}: input {socket.name} is not used in this mode")
        if isinstance(operand, bpy.types.NodeSocket):
            self.tree.links.new(operand, socket)
        else:
            socket.default_value = operand

    def math(self, operation: str, *operands: Operand, clamp: bool = False) -> Socket:
        """Add scalar arithmetic; the Math node's inputs share one name, so they go by position."""
        node = self.node("ShaderNodeMath", operation=operation, use_clamp=clamp)
        for socket, operand in zip(node.inputs, operands, strict=False):
            self.feed(socket, operand)
        return node.outputs["Value"]

    def vector(self, operation: str, *operands: Operand, scale: Operand | None = None) -> Socket:
        """Add vector arithmetic; return the scalar output of DOT_PRODUCT, LENGTH and DISTANCE."""
        node = self.node("ShaderNodeVectorMath", operation=operation)
        for socket, operand in zip(node.inputs, operands, strict=False):
            self.feed(socket, operand)
        if scale is not None:
            self.feed(node.inputs["Scale"], scale)
        scalar = operation in {"DOT_PRODUCT", "LENGTH", "DISTANCE"}
        return node.outputs["Value" if scalar else "Vector"]

    def combine(self, x: Operand, y: Operand, z: Operand) -> Socket:
        """Join three scalars to a vector."""
        node = self.node("ShaderNodeCombineXYZ")
        for name, operand in zip("XYZ", (x, y, z), strict=True):
            self.feed(node.inputs[name], operand)
        return node.outputs["Vector"]

    def separate(self, vector: Operand) -> tuple[Socket, ...]:
        """Split a vector into its three scalars."""
        node = self.node("ShaderNodeSeparateXYZ")
        self.feed(node.inputs["Vector"], vector)
        return tuple(node.outputs[name] for name in "XYZ")

    def combine_channels(self, channels: Mapping[str, Operand]) -> Socket:
        """Join the channels "R", "G" and "B" to a vector."""
        return self.combine(channels["R"], channels["G"], channels["B"])

    def separate_channels(self, vector: Operand) -> dict[str, Socket]:
        """Split a vector into the channels "R", "G" and "B"."""
        return dict(zip("RGB", self.separate(vector), strict=True))

    def ends(self) -> tuple[Sockets, Sockets]:
        """Add the group's input and output nodes; return the sockets that they offer."""
        return self.node("NodeGroupInput").outputs, self.node("NodeGroupOutput").inputs

    def look_up(
        self, image: bpy.types.Image, label: str, x: Operand, y: Operand, z: Operand
    ) -> Sockets:
        """Read an image by tube projection; return the outputs Red, Green and Blue.

        Args:
            image: The look-up table.
            label: Name and label of the texture node.
            x: Across the tube, 0 to 1.
            y: Across the tube, 0 to 1.
            z: Along the tube: the row, 0 to 1.
        """
        texture = self.node(
            "ShaderNodeTexImage",
            label,
            image=image,
            projection="TUBE",
            interpolation="Linear",
            extension="EXTEND",
        )
        self.feed(texture.inputs["Vector"], self.combine(x, y, z))
        parts = self.node("ShaderNodeSeparateColor")
        self.feed(parts.inputs["Color"], texture.outputs["Color"])
        return parts.outputs

    def arrange(self) -> None:
        """Place each node one column right of the furthest node it depends on."""
        depth: dict[str, int] = {}
        sources: dict[str, list[str]] = {node.name: [] for node in self.tree.nodes}
        for link in self.tree.links:
            sources[link.to_node.name].append(link.from_node.name)

        def column(name: str) -> int:
            if name not in depth:
                depth[name] = 0  # ends the recursion of a cycle, which no shader tree has
                depth[name] = max((column(source) + 1 for source in sources[name]), default=0)
            return depth[name]

        filled: dict[int, int] = {}
        for node in self.tree.nodes:
            at = column(node.name)
            row = filled.get(at, 0)
            filled[at] = row + 1
            node.location = (at * COLUMN_WIDTH, -row * ROW_HEIGHT)


def find_group(role: str, name: str) -> bpy.types.ShaderNodeTree | None:
    """Find a local node group by the role stamped on it; prefer the one that still has the name."""
    named = bpy.data.node_groups.get(name)
    if named is not None and named.library is None and named.get(ids.ROLE_KEY) == role:
        return named
    for group in bpy.data.node_groups:
        if group.library is None and group.get(ids.ROLE_KEY) == role:
            return group
    return None


def ensure_group(
    name: str, role: str, version: int, build: Callable[[TreeBuilder], None]
) -> bpy.types.ShaderNodeTree:
    """Return the static group of that role, rebuilt in place if it is of another version.

    Args:
        name: Of a new group.
        role: Stamped on the group; finds it again, whatever its name by then.
        version: Of what `build` makes.
        build: Declares the interface with `declare` and adds the nodes.
    """
    group = find_group(role, name)
    if group is not None and group.get(ids.VERSION_KEY) == version and is_intact(group):
        return group
    if group is None:
        group = bpy.data.node_groups.new(name, "ShaderNodeTree")
        group[ids.ROLE_KEY] = role
    rebuild(group, build)
    group[ids.VERSION_KEY] = version
    return group


def is_intact(tree: bpy.types.ShaderNodeTree) -> bool:
    """Return whether all that the tree's nodes refer to is there (groups, the look-up table)."""
    for node in tree.nodes:
        if node.type == "GROUP" and (node.node_tree is None or not is_intact(node.node_tree)):
            return False
        if node.type == "TEX_IMAGE" and node.image is None:
            return False
    return any(node.type == "GROUP_OUTPUT" for node in tree.nodes)


def rebuild(group: bpy.types.ShaderNodeTree, build: Callable[[TreeBuilder], None]) -> None:
    """Replace the nodes of a group; its interface is kept where `build` declares the same."""
    if group.animation_data is not None:
        group.animation_data_clear()
    group.nodes.clear()
    builder = TreeBuilder(group)
    build(builder)
    builder.arrange()


def declare(
    tree: bpy.types.ShaderNodeTree,
    name: str,
    kind: str = "Float",
    *,
    output: bool = False,
    default: Value | None = None,
    low: float | None = None,
    high: float | None = None,
    subtype: str = "",
    hide_value: bool = False,
    tip: str = "",
) -> None:
    """Declare a socket of a group's interface unless it is there already.

    Args:
        tree: The group.
        name: Of the socket.
        kind: What follows "NodeSocket" in Blender's name of the type.
        output: An output in place of an input.
        default: Value of an unconnected input.
        low: Least value that an artist can enter.
        high: Greatest value that an artist can enter.
        subtype: Blender's unit, such as "DISTANCE".
        hide_value: Whether an unconnected input shows no field.
        tip: Tooltip.
    """
    side = "OUTPUT" if output else "INPUT"
    for socket in tree.interface.items_tree:
        if socket.item_type == "SOCKET" and socket.in_out == side and socket.name == name:
            return
    socket = tree.interface.new_socket(
        name, in_out=side, socket_type=f"NodeSocket{kind}", description=tip
    )
    if subtype:
        socket.subtype = subtype
    socket.hide_value = hide_value
    if low is not None:
        socket.min_value = low
    if high is not None:
        socket.max_value = high
    if default is not None:
        socket.default_value = default
