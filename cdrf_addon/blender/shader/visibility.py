# SPDX-License-Identifier: GPL-3.0-or-later
"""Cast shadows: how much of each light reaches the surface, measured by EEVEE's own shadow maps.

No node returns the visibility of a light, but Shader to RGB returns what a BSDF receives. Two BSDFs
are used (decision 011):

* A Translucent BSDF on a surface with Thickness receives every light in full, wherever it comes
  from. On the side turned away from a light it starts the shadow ray that far ahead towards the
  light. A thickness of REACH sigma0 skips the surface's own attached shadow as far as light bleeds
  around the terminator; what lies beyond still casts its shadow.
* A Diffuse BSDF whose normal is perpendicular to the other lights receives one light only. This
  separates two or three lights where they face the surface.

Wiring, for lights a, b, c that cast:

    Translucent -> Lit - sum of those that cast none  = sum of E_i V_i ----------------+
    N_a = a - part along b / b x c -> Diffuse -> Lit / (E_a N_a.a) = V_a, where N.a > 0 |
    away = sum over the rest of E_i V_i / sum over the rest of E_i <-------------------+
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ... import ids
from ..nodes.received import lit_group, total
from ..nodes.tree import Operand, Socket, TreeBuilder

# What bleeds further than half of this behind a terminator is below a thousandth of the peak.
REACH = 5.0
# With a thickness of zero EEVEE lights the BSDF by its normal.
LEAST_THICKNESS = 1e-5
# Perpendicular normals separate no more lights than space has dimensions.
MOST_ISOLATED = 3
# Two lights this close in direction (squared sine) are not separated: they share a mask.
LEAST_SINE2 = 1e-3
# Part of all casting light below which what faces the surface tells little of its shadow.
FACING_SHARE = 0.05
# A stand-in for the second light; oblique, as lights tend to lie along the axes.
ODD_DIRECTION = (0.31, 0.47, 0.83)


@dataclass(frozen=True)
class Branch:
    """What the visibilities need of a light."""

    direction: Socket
    """Towards the light, unit length."""
    radiance: Socket
    """Per channel."""
    casts: bool
    """Whether it casts shadows."""


def thickness(b: TreeBuilder, sigma0: Operand, ratio: Operand) -> Socket:
    """Return how far from the surface its own shadow begins: REACH of the widest sigma0."""
    red, green, blue = b.separate(ratio)
    widest = b.math("MAXIMUM", b.math("MAXIMUM", red, green), blue)
    reach = b.math("MULTIPLY", b.math("MULTIPLY", sigma0, widest), REACH)
    return b.math("MAXIMUM", reach, LEAST_THICKNESS)


class VisibilityBuilder:
    """Builds the visibilities of a shader group's lights.

    Args:
        b: The group's builder.
        branches: Every light of the group, those that cast none too.
        normal: The shading normal.
        world: Whether the world sends light, which the BSDFs receive too.
    """

    def __init__(
        self, b: TreeBuilder, branches: Sequence[Branch], normal: Socket, *, world: bool
    ) -> None:
        self.b, self.branches, self.normal, self.world = b, branches, normal, world
        self.peaks = [total(b, branch.radiance) for branch in branches]
        self.casting = [i for i, branch in enumerate(branches) if branch.casts]
        self.steady = [i for i, branch in enumerate(branches) if not branch.casts]
        self.count = 0

    def visibilities(self) -> dict[int, Socket]:
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

    def _lit(self, normal: Operand, *, translucent: bool = False) -> Socket:
        """Return what a BSDF with that normal receives of everything."""
        self.count += 1
        label = f"Shadow {self.count}"
        node = self.b.group(lit_group(translucent=translucent), label, Normal=normal)
        return node.outputs[ids.LIT]

    def _sum(self, terms: Sequence[Operand]) -> Operand:
        result: Operand = 0.0
        for term in terms:
            result = self.b.math("ADD", result, term) if result != 0.0 else term
        return result

    def _ratio(self, part: Operand, whole: Operand) -> Socket:
        return self.b.math("DIVIDE", part, whole, clamp=True)

    def _facing(self, number: int, normal: Socket) -> Socket:
        """Return what a surface with that normal receives of a light that nothing blocks."""
        cosine = self.b.vector("DOT_PRODUCT", normal, self.branches[number].direction)
        return self.b.math("MULTIPLY", self.peaks[number], self.b.math("MAXIMUM", cosine, 0.0))

    def _cast_only(self, lit: Socket, normal: Socket) -> Socket:
        """Subtract what the lights without shadows add."""
        for number in self.steady:
            lit = self.b.math("SUBTRACT", lit, self._facing(number, normal))
        return lit

    def _pair(self, normal: Socket) -> tuple[Socket, Socket]:
        """Return what a normal and its opposite receive of the casting lights and the world."""
        opposite = self.b.vector("SCALE", normal, scale=-1.0)
        return (
            self._cast_only(self._lit(normal), normal),
            self._cast_only(self._lit(opposite), opposite),
        )

    def _ambient(self) -> Operand:
        """Return the world's mean, from two opposite normals that no casting light reaches.

        Three lights leave no such direction: it is 0 there, and `_isolated` does without. More than
        three share a mask that the world brightens.
        """
        if not self.world or len(self.casting) >= MOST_ISOLATED:
            return 0.0
        first = self.branches[self.casting[0]].direction
        second = (
            self.branches[self.casting[1]].direction if len(self.casting) > 1 else ODD_DIRECTION
        )
        across = self.b.vector("NORMALIZE", self.b.vector("CROSS_PRODUCT", first, second))
        ahead, behind = self._pair(across)
        return self.b.math("MULTIPLY", self.b.math("ADD", ahead, behind), 0.5)

    def _arriving(self, ambient: Operand) -> Socket:
        """Return the sum of what arrives of the casting lights, also on the side turned away."""
        lit = self._lit((0.0, 0.0, 1.0), translucent=True)
        if ambient != 0.0:
            lit = self.b.math("SUBTRACT", lit, ambient)
        arriving = self.b.math("MULTIPLY", lit, math.pi)
        for number in self.steady:
            arriving = self.b.math("SUBTRACT", arriving, self.peaks[number])
        return arriving

    # --- separating lights --------------------------------------------------------------------

    def _shared(self, everywhere: Socket, whole: Operand) -> Socket:
        """Return one mask for many lights: what a Diffuse BSDF loses, so sigma0 = 0 stays exact.

        Where hardly any light faces the surface, the mask of the Translucent BSDF takes over.
        """
        b = self.b
        due = self._sum([self._facing(number, self.normal) for number in self.casting])
        lost = self._ratio(self._cast_only(self._lit(self.normal), self.normal), due)
        weight = b.math("DIVIDE", due, b.math("MULTIPLY_ADD", whole, FACING_SHARE, due))
        difference = b.math("SUBTRACT", lost, everywhere)
        return b.math("MULTIPLY_ADD", weight, difference, everywhere)

    def _isolated(self, arriving: Socket, shared: Socket, ambient: Operand) -> dict[int, Socket]:
        """Return each light's mask: its own where it faces the surface, a shared one elsewhere."""
        b = self.b
        geometry = b.node("ShaderNodeNewGeometry").outputs["True Normal"]
        rest = arriving
        turned: Operand = 0.0
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

    def _own(self, number: int, shared: Socket, ambient: Operand) -> Socket:
        """Return the visibility of one light where it faces the surface."""
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
        # A light in the plane of the others, or behind another, cannot be separated.
        sine2 = b.vector("DOT_PRODUCT", normal, direction)
        distinct = b.math("GREATER_THAN", b.math("MULTIPLY", sine2, sine2), LEAST_SINE2)
        return b.math("MULTIPLY_ADD", distinct, b.math("SUBTRACT", visibility, shared), shared)
