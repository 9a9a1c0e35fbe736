# SPDX-License-Identifier: GPL-3.0-or-later
"""Cast shadows: how much of each light reaches the surface, measured by EEVEE's own shadow maps.

A node cannot ask for a light's visibility, but Shader to RGB shows what a BSDF receives. Two BSDFs
are used (decision 011):

* A Translucent BSDF on a surface with Thickness receives every light in full, wherever it comes
  from, and on the side turned away from a light it starts the shadow ray that far ahead towards
  the light. With a thickness of REACH sigma0 the surface's own attached shadow is skipped as far
  as light bleeds around the terminator, and what lies beyond still casts its shadow.
* A Diffuse BSDF whose normal is perpendicular to the other lights receives one light only. This
  tells two or three lights apart where they face the surface.

Wiring, for lights a, b, c that cast:

    Translucent -> Lit - sum of those that cast none  = sum of E_i V_i ----------------+
    N_a = a - part along b / b x c -> Diffuse -> Lit / (E_a N_a.a) = V_a, where N.a > 0 |
    away = sum over the rest of E_i V_i / sum over the rest of E_i <-------------------+
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import bpy

from ... import ids
from ...compat import HAS_RAYCAST, uses_nodes
from ..instances import shown_objects
from ..nodes.tree import TreeBuilder, declare, ensure_group

VERSION = 1

AUTO, ON, OFF = "AUTO", "ON", "OFF"
SHADOW_ITEMS = [
    (AUTO, "Auto", "Cast shadows where the scene has another object that can cast one"),
    (ON, "On", "Cast shadows always, those of the object on itself too"),
    (OFF, "Off", "No cast shadows: faster"),
]


@dataclass(frozen=True)
class Choice:
    """What a material's shadows are made of."""

    cast: bool = False
    edges: bool = False
    """Whether their edges are softened and coloured as far as light scatters."""


NO_SHADOWS = Choice()
SURFACES = {"MESH", "CURVE", "SURFACE", "META", "FONT", "CURVES", "POINTCLOUD"}
# What bleeds further than half of this behind a terminator is below a thousandth of the peak.
REACH = 5.0
# Without any thickness the BSDF would be another one, lit by its normal.
LEAST_THICKNESS = 1e-5
# More lights than space has dimensions cannot be told apart by perpendicular normals.
MOST_ISOLATED = 3
# Two lights this close in direction (squared sine) are not told apart: the mask is shared.
LEAST_SINE2 = 1e-3
# Part of all casting light below which what faces the surface says little about its shadow.
FACING_SHARE = 0.05


@dataclass(frozen=True)
class Branch:
    """What a light's group of nodes puts out, and whether the light casts shadows."""

    direction: Any
    radiance: Any
    casts: bool


def world_shines(world: bpy.types.World | None) -> bool:
    """Tell whether the world may send light: False only where it is surely black."""
    if world is None:
        return False
    tree = world.node_tree
    if tree is None or not uses_nodes(world):
        return bool(max(world.color) > 0.0)
    if world.animation_data is not None or tree.animation_data is not None:
        return True
    output = tree.get_output_node("EEVEE")
    links = output.inputs["Surface"].links if output is not None else ()
    if not links:
        return False
    node = links[0].from_node
    if node.type != "BACKGROUND":
        return True
    colour, strength = node.inputs["Color"], node.inputs["Strength"]
    black = not colour.is_linked and max(colour.default_value[:3]) <= 0.0
    return not black and (strength.is_linked or strength.default_value != 0.0)


def choose(material: bpy.types.Material, view_layer: bpy.types.ViewLayer) -> Choice:
    """Decide what shadows a material's lights get."""
    setting = material.cdrf.shadows
    if setting == ON or (setting == AUTO and _casters(view_layer) > 1):
        return Choice(True, HAS_RAYCAST and material.cdrf.shadow_edges)
    return NO_SHADOWS


def _casters(view_layer: bpy.types.ViewLayer) -> int:
    """Count the objects that can cast a shadow in any rendered layer; a skin is one itself.

    All layers share the material, so the answer must not depend on which of them is open.
    """
    layers = [layer for layer in view_layer.id_data.view_layers if layer.use] or [view_layer]
    return len(
        {
            item
            for layer in layers
            for item in shown_objects(layer)
            if item.type in SURFACES and item.visible_shadow and not item.hide_render
        }
    )


def lit_group(*, translucent: bool) -> bpy.types.ShaderNodeTree:
    """What a white BSDF with that normal receives, as one number; 1 is a radiance of 1.

    Wiring:

        Normal -> Diffuse or Translucent BSDF -> Shader to RGB -> sum of channels -> Lit
    """
    kind = "Translucent" if translucent else "Diffuse"

    def build(b: TreeBuilder) -> None:
        declare(b.tree, ids.NORMAL, "Vector", tip="Direction from which light is received")
        declare(b.tree, ids.LIT, output=True)
        given, result = b.ends()
        bsdf = b.node(f"ShaderNodeBsdf{kind}")
        b.feed(bsdf.inputs["Color"], (1.0, 1.0, 1.0, 1.0))
        b.feed(bsdf.inputs["Normal"], given[ids.NORMAL])
        seen = b.node("ShaderNodeShaderToRGB")
        b.feed(seen.inputs["Shader"], bsdf.outputs["BSDF"])
        b.feed(result[ids.LIT], total(b, seen.outputs["Color"]))

    return ensure_group(f"CDRF Lit {kind}", f"{ids.ROLE_LIT} {kind}", VERSION, build)


def total(b: TreeBuilder, colour: Any) -> Any:
    """Sum of a colour's channels."""
    return b.vector("DOT_PRODUCT", colour, (1.0, 1.0, 1.0))


def thickness(b: TreeBuilder, sigma0: Any, ratio: Any) -> Any:
    """How far from the surface its own shadow begins to count: REACH of the widest sigma0."""
    red, green, blue = b.separate(ratio)
    widest = b.math("MAXIMUM", b.math("MAXIMUM", red, green), blue)
    reach = b.math("MULTIPLY", b.math("MULTIPLY", sigma0, widest), REACH)
    return b.math("MAXIMUM", reach, LEAST_THICKNESS)


class Shadows:
    """Builds the visibilities of a shader group's lights.

    Args:
        b: The group's builder.
        branches: Every light of the group, those that cast none too.
        normal: The shading normal.
        world: Whether the world sends light, which the BSDFs receive as well.
    """

    def __init__(
        self, b: TreeBuilder, branches: Sequence[Branch], normal: Any, *, world: bool
    ) -> None:
        self.b, self.branches, self.normal, self.world = b, branches, normal, world
        self.peaks = [total(b, branch.radiance) for branch in branches]
        self.casting = [i for i, branch in enumerate(branches) if branch.casts]
        self.steady = [i for i, branch in enumerate(branches) if not branch.casts]
        self.count = 0

    def visibilities(self) -> dict[int, Any]:
        """Return the part of each casting light that arrives, 0 to 1, by its number."""
        if not self.casting:
            return {}
        ambient = self._ambient()
        arriving = self._arriving(ambient)
        whole = self._sum([self.peaks[i] for i in self.casting])
        shared = self._ratio(arriving, whole)
        if len(self.casting) == 1:
            return {self.casting[0]: shared}
        if len(self.casting) > MOST_ISOLATED:
            shared = self._shared(shared, whole)
            return dict.fromkeys(self.casting, shared)
        return self._isolated(arriving, shared, ambient)

    # --- what the BSDFs receive ---------------------------------------------------------------

    def _lit(self, normal: Any, *, translucent: bool = False) -> Any:
        self.count += 1
        label = f"Shadow {self.count}"
        node = self.b.group(lit_group(translucent=translucent), label, Normal=normal)
        return node.outputs[ids.LIT]

    def _sum(self, terms: Sequence[Any]) -> Any:
        result: Any = 0.0
        for term in terms:
            result = self.b.math("ADD", result, term) if result != 0.0 else term
        return result

    def _ratio(self, part: Any, whole: Any) -> Any:
        return self.b.math("DIVIDE", part, whole, clamp=True)

    def _facing(self, number: int, normal: Any) -> Any:
        """What a surface with that normal receives of a light that nothing blocks."""
        cosine = self.b.vector("DOT_PRODUCT", normal, self.branches[number].direction)
        return self.b.math("MULTIPLY", self.peaks[number], self.b.math("MAXIMUM", cosine, 0.0))

    def _cast_only(self, lit: Any, normal: Any) -> Any:
        """Take off what the lights without shadows add."""
        for number in self.steady:
            lit = self.b.math("SUBTRACT", lit, self._facing(number, normal))
        return lit

    def _pair(self, normal: Any) -> tuple[Any, Any]:
        """What a normal and its opposite receive of the casting lights and the world."""
        opposite = self.b.vector("SCALE", normal, scale=-1.0)
        return (
            self._cast_only(self._lit(normal), normal),
            self._cast_only(self._lit(opposite), opposite),
        )

    def _ambient(self) -> Any:
        """Mean of what the world sends, from two opposite normals that no casting light reaches.

        Three lights leave no such direction; there it is 0 and `_isolated` makes do. More than
        three share a mask that the world brightens.
        """
        if not self.world or len(self.casting) >= MOST_ISOLATED:
            return 0.0
        first = self.branches[self.casting[0]].direction
        # Any other direction will do; an odd one, as lights tend to lie along the axes.
        second = (
            self.branches[self.casting[1]].direction
            if len(self.casting) > 1
            else (0.31, 0.47, 0.83)
        )
        across = self.b.vector("NORMALIZE", self.b.vector("CROSS_PRODUCT", first, second))
        ahead, behind = self._pair(across)
        return self.b.math("MULTIPLY", self.b.math("ADD", ahead, behind), 0.5)

    def _arriving(self, ambient: Any) -> Any:
        """Sum of the casting lights as far as they arrive, on the side turned away too."""
        lit = self._lit((0.0, 0.0, 1.0), translucent=True)
        if ambient != 0.0:
            lit = self.b.math("SUBTRACT", lit, ambient)
        arriving = self.b.math("MULTIPLY", lit, math.pi)
        for number in self.steady:
            arriving = self.b.math("SUBTRACT", arriving, self.peaks[number])
        return arriving

    # --- telling lights apart -----------------------------------------------------------------

    def _shared(self, everywhere: Any, whole: Any) -> Any:
        """One mask for many lights: what a Diffuse BSDF loses, so that sigma0 = 0 stays exact.

        Where hardly any light faces the surface, the mask of the Translucent BSDF takes over.
        """
        b = self.b
        due = self._sum([self._facing(number, self.normal) for number in self.casting])
        lost = self._ratio(self._cast_only(self._lit(self.normal), self.normal), due)
        weight = b.math("DIVIDE", due, b.math("MULTIPLY_ADD", whole, FACING_SHARE, due))
        difference = b.math("SUBTRACT", lost, everywhere)
        return b.math("MULTIPLY_ADD", weight, difference, everywhere)

    def _isolated(self, arriving: Any, shared: Any, ambient: Any) -> dict[int, Any]:
        """Each light by itself where it faces the surface, the rest of `arriving` elsewhere."""
        b = self.b
        geometry = b.node("ShaderNodeNewGeometry").outputs["True Normal"]
        rest: Any = arriving
        turned: Any = 0.0
        facing, own = {}, {}
        for number in self.casting:
            branch = self.branches[number]
            ahead = b.math("GREATER_THAN", b.vector("DOT_PRODUCT", geometry, branch.direction), 0.0)
            own[number] = self._own(number, shared, ambient)
            facing[number] = ahead
            amount = b.math("MULTIPLY", self.peaks[number], ahead)
            rest = b.math("SUBTRACT", rest, b.math("MULTIPLY", amount, own[number]))
            turned = self._sum([turned, b.math("SUBTRACT", self.peaks[number], amount)])
        away = self._ratio(rest, turned)
        return {
            number: b.math(
                "MULTIPLY_ADD",
                facing[number],
                b.math("SUBTRACT", own[number], away),
                away,
            )
            for number in self.casting
        }

    def _own(self, number: int, shared: Any, ambient: Any) -> Any:
        """Visibility of one light where it faces the surface."""
        b = self.b
        direction = self.branches[number].direction
        others = [self.branches[i].direction for i in self.casting if i != number]
        if len(others) == 1:
            along = b.vector("DOT_PRODUCT", direction, others[0])
            part = b.vector("SCALE", others[0], scale=along)
            across = b.vector("SUBTRACT", direction, part)
        else:
            across = b.vector("CROSS_PRODUCT", *others)
            side = b.math("SIGN", b.vector("DOT_PRODUCT", across, direction))
            across = b.vector("SCALE", across, scale=side)
        normal = b.vector("NORMALIZE", across)
        if self.world:
            ahead, behind = self._pair(normal)
            if ambient != 0.0:  # what is even in the direction cancels as well
                behind = b.math("MULTIPLY_ADD", ambient, 2.0, b.math("MULTIPLY", behind, -1.0))
            lit = b.math("SUBTRACT", ahead, behind)
        else:
            lit = self._cast_only(self._lit(normal), normal)
        visibility = self._ratio(lit, self._facing(number, normal))
        # A light in the plane of the others, or behind another, cannot be told apart.
        sine2 = b.vector("DOT_PRODUCT", normal, direction)
        distinct = b.math("GREATER_THAN", b.math("MULTIPLY", sine2, sine2), LEAST_SINE2)
        return b.math("MULTIPLY_ADD", distinct, b.math("SUBTRACT", visibility, shared), shared)
