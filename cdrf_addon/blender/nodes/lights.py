# SPDX-License-Identifier: GPL-3.0-or-later
"""The node groups of the lights: one for each type, driven and wired elsewhere.

Each turns what Blender stores of a lamp into

    Direction  unit vector from the surface to the light
    Radiance   what a white Lambert surface facing the light would send out, per channel
    Variance   blur of the terminator by the light's size, rad^2 (core/reflectance/finite_light.py)

With EEVEE's own constants and limits (decision 003).
"""

from __future__ import annotations

import math

import bpy

from ... import ids
from ...core.reflectance.finite_light import SPHERE_GAIN, VARIANCE_COEFFICIENTS
from .tree import Operand, Socket, TreeBuilder, declare, ensure_group

VERSION = 9


ELLIPTIC = {"DISK", "ELLIPSE"}
"""Shapes of an area light that are not rectangles."""

# EEVEE treats a point light as a sphere of at least 1 mm.
SOFT_RADIUS2 = 1e-6
# A spot light with an axis scaled to less than the root of this is dark: at 1e-7 it shines, at 1e-8
# it does not. A sun is dark only where its Z axis is scaled to zero.
LEAST_SPOT_AXIS2 = 1e-15


def _declare_light(tree: bpy.types.ShaderNodeTree) -> None:
    declare(tree, ids.POWER, "Vector", tip="Light's power times Blender's constant for its type")
    declare(tree, ids.GAIN, default=SPHERE_GAIN, tip="Of the model: ring 1/2, sphere 1")
    for name in (ids.DIRECTION, ids.RADIANCE):
        declare(tree, name, "Vector", output=True)
    declare(tree, ids.VARIANCE, output=True)


def _declare_local(tree: bpy.types.ShaderNodeTree) -> None:
    declare(tree, ids.POSITION, "Vector", tip="Position of the light")
    declare(
        tree, ids.INVERSE_RANGE2, low=0.0, tip="1 / squared distance at which EEVEE cuts it off"
    )


def _finite(b: TreeBuilder, sin2: Operand, exponent: Operand) -> tuple[Socket, Socket]:
    """Return variance and gain of a light of that squared sine (core/reflectance/finite_light)."""
    c0, c1, c2 = VARIANCE_COEFFICIENTS
    inner = b.math("MULTIPLY_ADD", sin2, c2, c1)
    inner = b.math("MULTIPLY_ADD", sin2, inner, c0)
    variance = b.math("MULTIPLY", sin2, inner)
    return variance, b.math("EXPONENT", b.math("MULTIPLY", variance, exponent))


def _towards(b: TreeBuilder, position: Operand) -> tuple[Socket, Socket]:
    """Return the vector from the shaded point to the light, and its squared length."""
    point = b.node("ShaderNodeNewGeometry").outputs["Position"]
    to_light = b.vector("SUBTRACT", position, point)
    return to_light, b.vector("DOT_PRODUCT", to_light, to_light)


def _window(b: TreeBuilder, distance2: Operand, inverse_range2: Operand) -> Socket:
    """Return EEVEE's fade to zero at the light's range: clamp(1 - (d / R)^4)^2."""
    ratio2 = b.math("MULTIPLY", distance2, inverse_range2)
    fade = b.math("SUBTRACT", 1.0, b.math("MULTIPLY", ratio2, ratio2), clamp=True)
    return b.math("MULTIPLY", fade, fade)


def sun_group() -> bpy.types.ShaderNodeTree:
    """Return the group of a sun: parallel light from Axis Z, its terminator blurred by its angle.

    Wiring, with s the Squared Sine of Half Angle and c the coefficients of `_finite`:

        s -> v = s (c0 + s (c1 + s c2)) ----------------------------> Variance
        exp(v x Gain Exponent) x (Axis Z is not zero) x Power ------> Radiance
        Axis Z -> normalised ---------------------------------------> Direction
    """

    def build(b: TreeBuilder) -> None:
        _declare_light(b.tree)
        declare(b.tree, ids.AXIS_Z, "Vector", tip="Towards the sun, any length")
        declare(b.tree, ids.SIN2_HALF_ANGLE, low=0.0, high=1.0)
        given, result = b.ends()
        variance, gain = _finite(b, given[ids.SIN2_HALF_ANGLE], given[ids.GAIN])
        # A blurred terminator is never black, so a sun without a direction is switched off.
        length2 = b.vector("DOT_PRODUCT", given[ids.AXIS_Z], given[ids.AXIS_Z])
        amount = b.math("MULTIPLY", gain, b.math("GREATER_THAN", length2, 0.0))
        b.feed(result[ids.DIRECTION], b.vector("NORMALIZE", given[ids.AXIS_Z]))
        b.feed(result[ids.RADIANCE], b.vector("SCALE", given[ids.POWER], scale=amount))
        b.feed(result[ids.VARIANCE], variance)

    return ensure_group("CDRF Sun", "light SUN", VERSION, build)


def point_group() -> bpy.types.ShaderNodeTree:
    """Return the group of a point light.

    Its falloff is 1 / max(d^2 + soft r^2, r^2), cut off at its range R, and s = r^2 x falloff:

        Position - point -> d^2 -> falloff x gain(s) x clamp(1 - (d / R)^4)^2 x Power -> Radiance
    """

    def build(b: TreeBuilder) -> None:
        _declare_light(b.tree)
        _declare_local(b.tree)
        declare(b.tree, ids.RADIUS, low=0.0)
        declare(b.tree, ids.SOFT_FALLOFF, low=0.0, high=1.0)
        given, result = b.ends()
        to_light, distance2 = _towards(b, given[ids.POSITION])
        radius2 = b.math("MULTIPLY", given[ids.RADIUS], given[ids.RADIUS])
        softened = b.math("MULTIPLY_ADD", radius2, given[ids.SOFT_FALLOFF], distance2)
        floor = b.math("MAXIMUM", SOFT_RADIUS2, radius2)
        falloff = b.math("DIVIDE", 1.0, b.math("MAXIMUM", softened, floor))
        variance, gain = _finite(b, b.math("MULTIPLY", radius2, falloff), given[ids.GAIN])
        amount = b.math("MULTIPLY", falloff, gain)
        amount = b.math("MULTIPLY", amount, _window(b, distance2, given[ids.INVERSE_RANGE2]))
        b.feed(result[ids.DIRECTION], b.vector("NORMALIZE", to_light))
        b.feed(result[ids.RADIANCE], b.vector("SCALE", given[ids.POWER], scale=amount))
        b.feed(result[ids.VARIANCE], variance)

    return ensure_group("CDRF Point", "light POINT", VERSION, build)


def spot_group() -> bpy.types.ShaderNodeTree:
    """Return the group of a spot light: a point light behind EEVEE's mask.

    The mask is elliptical where the lamp is scaled. With x, y, z the direction in the lamp's frame,
    its axes scaled as the lamp is:

        mask = smoothstep((1 / sqrt(1 + (x/z)^2 + (y/z)^2) - cone cosine) * sharpness),  z > 0

    and 0 where an axis is scaled to zero.
    """

    def build(b: TreeBuilder) -> None:
        _declare_light(b.tree)
        _declare_local(b.tree)
        declare(b.tree, ids.RADIUS, low=0.0)
        declare(b.tree, ids.SOFT_FALLOFF, low=0.0, high=1.0)
        for axis in (ids.AXIS_X, ids.AXIS_Y, ids.AXIS_Z):
            declare(b.tree, axis, "Vector", tip="Axis of the lamp, as long as the lamp is scaled")
        declare(b.tree, ids.CONE_COSINE, low=-1.0, high=1.0)
        declare(b.tree, ids.CONE_SHARPNESS, low=0.0)
        given, result = b.ends()
        point = b.group(
            point_group(),
            "Point",
            Power=given[ids.POWER],
            Gain_Exponent=given[ids.GAIN],
            Position=given[ids.POSITION],
            Inverse_Squared_Range=given[ids.INVERSE_RANGE2],
            Radius=given[ids.RADIUS],
            Soft_Falloff=given[ids.SOFT_FALLOFF],
        ).outputs
        direction = point[ids.DIRECTION]

        axes = [given[axis] for axis in (ids.AXIS_X, ids.AXIS_Y, ids.AXIS_Z)]
        lengths2 = [b.vector("DOT_PRODUCT", axis, axis) for axis in axes]
        # Component over length: dot(L, A) / |A|^2. Division by zero is zero in Blender.
        x, y, z = (
            b.math("DIVIDE", b.vector("DOT_PRODUCT", direction, axis), length2)
            for axis, length2 in zip(axes, lengths2, strict=True)
        )
        across = b.combine(b.math("DIVIDE", x, z), b.math("DIVIDE", y, z), 0.0)
        cosine = b.math("INVERSE_SQRT", b.math("ADD", 1.0, b.vector("DOT_PRODUCT", across, across)))
        inside = b.math("SUBTRACT", cosine, given[ids.CONE_COSINE])
        t = b.math("MULTIPLY", inside, given[ids.CONE_SHARPNESS], clamp=True)
        smooth = b.math("MULTIPLY", b.math("MULTIPLY", t, t), b.math("MULTIPLY_ADD", t, -2.0, 3.0))
        mask = b.math("MULTIPLY", smooth, b.math("GREATER_THAN", z, 0.0))
        shortest2 = b.math("MINIMUM", b.math("MINIMUM", *lengths2[:2]), lengths2[2])
        mask = b.math("MULTIPLY", mask, b.math("GREATER_THAN", shortest2, LEAST_SPOT_AXIS2))
        b.feed(result[ids.DIRECTION], direction)
        b.feed(result[ids.RADIANCE], b.vector("SCALE", point[ids.RADIANCE], scale=mask))
        b.feed(result[ids.VARIANCE], point[ids.VARIANCE])

    return ensure_group("CDRF Spot", "light SPOT", VERSION, build)


# Corners of an area light in units of its half-axes. An ellipse is the octagon of its area; the
# octagon's second moments are within 0.3 % of the ellipse's.
RECTANGLE = ((1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0))
_OCTAGON_RADIUS = math.sqrt(math.pi / (2.0 * math.sqrt(2.0)))
ELLIPSE = tuple(
    (
        _OCTAGON_RADIUS * math.cos(math.pi * (2 * i + 1) / 8),
        _OCTAGON_RADIUS * math.sin(math.pi * (2 * i + 1) / 8),
    )
    for i in range(8)
)
# EEVEE does not render an area light whose half-axes multiply to less than this (square metres).
LEAST_HALF_AXES_PRODUCT = 1e-5


def area_group(*, elliptic: bool) -> bpy.types.ShaderNodeTree:
    """Return the group of an area light: vector irradiance of a polygon (Lambert 1760).

    Exact at any distance. With the corners V_i around the shaded point:

        n_i = V_i x (V_i+1 - V_i),  angle_i = atan2(|n_i|, V_i . V_i+1)
        F = 1/2 sum over i of angle_i n_i / |n_i|
        F / |F| -> Direction,  |F| / pi (the form factor) x gain x window x Power -> Radiance

    The edges V_i+1 - V_i come from the lamp's axes, so that a small or far light does not cancel:
    16 bits are left at size / distance = 0.001.
    """
    shape, axes_to_area = (ELLIPSE, math.pi) if elliptic else (RECTANGLE, 4.0)

    def build(b: TreeBuilder) -> None:
        _declare_light(b.tree)
        _declare_local(b.tree)
        for axis in (ids.AXIS_X, ids.AXIS_Y, ids.AXIS_Z):
            declare(b.tree, axis, "Vector", tip="Axis of the lamp, as long as the lamp is scaled")
        declare(b.tree, ids.HALF_X, low=0.0, tip="Half of the shape's size along X")
        declare(b.tree, ids.HALF_Y, low=0.0, tip="Half of the shape's size along Y")
        declare(b.tree, ids.NORMALIZE, default=1.0, low=0.0, high=1.0)
        given, result = b.ends()
        centre, distance2 = _towards(b, given[ids.POSITION])
        right = b.vector("SCALE", given[ids.AXIS_X], scale=given[ids.HALF_X])
        up = b.vector("SCALE", given[ids.AXIS_Y], scale=given[ids.HALF_Y])
        corners = [
            b.vector(
                "MULTIPLY_ADD", up, (y,) * 3, b.vector("MULTIPLY_ADD", right, (x,) * 3, centre)
            )
            for x, y in shape
        ]
        doubled: Operand = (0.0, 0.0, 0.0)
        for i, (start, end) in enumerate(zip(corners, corners[1:] + corners[:1], strict=True)):
            (x0, y0), (x1, y1) = shape[i], shape[(i + 1) % len(shape)]
            edge = b.vector("SCALE", right, scale=x1 - x0)
            edge = b.vector("MULTIPLY_ADD", up, (y1 - y0,) * 3, edge)
            normal = b.vector("CROSS_PRODUCT", start, edge)
            length = b.vector("LENGTH", normal)
            angle = b.math("ARCTAN2", length, b.vector("DOT_PRODUCT", start, end))
            weight = b.math("DIVIDE", angle, length)
            doubled = b.vector("ADD", doubled, b.vector("SCALE", normal, scale=weight))
        # The corners run against the clock as seen from behind the lamp, so F points at the light
        # from its lit side; a mirrored lamp would turn it, hence the sign of its own Z axis.
        ahead = b.vector("DOT_PRODUCT", centre, given[ids.AXIS_Z])
        lit = b.math("GREATER_THAN", ahead, 0.0)
        turn = b.math("SIGN", b.vector("DOT_PRODUCT", doubled, centre))
        irradiance = b.vector("SCALE", doubled, scale=b.math("MULTIPLY", turn, 0.5))
        magnitude = b.vector("LENGTH", irradiance)
        product = b.vector("LENGTH", b.vector("CROSS_PRODUCT", right, up))
        drawn = b.math("GREATER_THAN", product, LEAST_HALF_AXES_PRODUCT)
        world_area = b.math("MULTIPLY", product, axes_to_area)
        variance, gain = _finite(b, b.math("MULTIPLY", magnitude, 1.0 / math.pi), given[ids.GAIN])
        # Power is per square metre without Normalize, in all with it: area^-normalize. For no area
        # that is infinite, and zero times it not a number, hence the least area.
        world_area = b.math("MAXIMUM", world_area, LEAST_HALF_AXES_PRODUCT)
        density = b.math("POWER", world_area, b.math("MULTIPLY", given[ids.NORMALIZE], -1.0))
        amount = b.math("MULTIPLY", b.math("MULTIPLY", magnitude, density), gain)
        amount = b.math("MULTIPLY", amount, b.math("MULTIPLY", lit, drawn))
        amount = b.math("MULTIPLY", amount, _window(b, distance2, given[ids.INVERSE_RANGE2]))
        b.feed(result[ids.DIRECTION], b.vector("NORMALIZE", irradiance))
        b.feed(result[ids.RADIANCE], b.vector("SCALE", given[ids.POWER], scale=amount))
        b.feed(result[ids.VARIANCE], variance)

    shape_name = "Ellipse" if elliptic else "Rectangle"
    return ensure_group(f"CDRF Area {shape_name}", f"light AREA {shape_name}", VERSION, build)


def light_group(kind: str) -> bpy.types.ShaderNodeTree:
    """Return the group for a kind of light (`SceneLight.kind`)."""
    if kind.startswith("AREA"):
        return area_group(elliptic=kind.split()[1] in ELLIPTIC)
    return {"SUN": sun_group, "POINT": point_group, "SPOT": spot_group}[kind]()
