# SPDX-License-Identifier: GPL-3.0-or-later
"""The static node groups: look-up, one group per type of light, curvature display.

None of them holds a driver or knows a scene; the scene's own group (shader.py) is made of them.
Each light group turns what Blender says of a lamp into

    Direction  unit vector from the surface to the light
    Radiance   what a white Lambert surface facing the light would send out, per channel
    Variance   blur of the terminator by the light's size, rad^2 (core/finite_light.py)

EEVEE's own constants and limits are kept (decision 003).
"""

from __future__ import annotations

import math
from typing import Any

import bpy

from ... import ids
from ...core.colour_scale import HOT, MARK_COLOUR, SIGNED
from ...core.curvature.scale_space import LENGTH_PER_SIGMA0, LEVEL_RATIO, LEVELS
from ...core.reflectance.detail import PHASE
from ...core.reflectance.finite_light import SPHERE_GAIN, VARIANCE_COEFFICIENTS
from ...core.reflectance.lut import DEFAULT_LAYOUT, VARIANCE_MAX
from ...core.reflectance.model import name_of
from .tables import Table
from .tree import TreeBuilder, declare, ensure_group

VERSION = 9

ELLIPTIC = {"DISK", "ELLIPSE"}

CHANNEL_SETS = ("RGB", "R GB", "RG B", "RB G", "R G B")
"""Which channels share a sigma0, and so a look-up."""
SEPARATE = CHANNEL_SETS[-1]
PARTS = {"R": "Red", "G": "Green", "B": "Blue"}

SOFT_RADIUS2 = 1e-6  # EEVEE treats a point light as a sphere of at least 1 mm
# A spot light with an axis scaled to less than the root of this is dark: at 1e-7 it shines, at 1e-8
# no more. A sun is dark only where its Z axis is scaled to nothing at all.
LEAST_SPOT_AXIS2 = 1e-15


def reflectance_group(
    channels: str, table: Table, *, own_cosines: bool = False
) -> bpy.types.ShaderNodeTree:
    """f(theta, sigma) per channel, one texture look-up per part of `channels` ("RG B": two).

    Of a table with colour, each channel takes its own part of what was looked up. With
    `own_cosines` each channel has its own normal, and so its own cosine.

    Wiring, with K, offset and scale from core/lut.py:

        Cosine -> q = sign(c) sqrt|c| -> p = pi K q -> (sin p, cos p) --+
        Variance -> min(., max) -> ^1/4 -> v = offset + scale w --------+-> tube look-up -> f
    """

    def build(b: TreeBuilder) -> None:
        kind = "Vector" if own_cosines else "Float"
        declare(
            b.tree,
            ids.COSINE,
            kind,
            default=(1.0,) * 3 if own_cosines else 1.0,
            tip="Cosine between normal and light",
        )
        declare(b.tree, ids.VARIANCE, "Vector", tip="Squared blur width of each channel")
        declare(b.tree, ids.REFLECTANCE, "Vector", output=True)
        given, result = b.ends()
        layout = DEFAULT_LAYOUT
        if own_cosines:
            cosines = dict(zip("RGB", b.separate(given[ids.COSINE]), strict=True))
        else:
            place = _on_tube(b, given[ids.COSINE])
        variance = dict(zip("RGB", b.separate(given[ids.VARIANCE]), strict=True))
        f = {}
        for shared in channels.split():
            across, along = _on_tube(b, cosines[shared[0]]) if own_cosines else place
            # The limit first: MINIMUM(limit, NaN) is the limit, so a bad attribute stays finite.
            w = b.math("MINIMUM", VARIANCE_MAX, variance[shared[0]])
            w = b.math("SQRT", b.math("SQRT", b.math("MAXIMUM", 0.0, w)))
            v = b.math("MULTIPLY_ADD", w, layout.row_scale / VARIANCE_MAX**0.25, layout.row_offset)
            value = b.look_up(table.image, f"Look-up {shared}", across, along, v)
            for channel in shared:
                f[channel] = value[PARTS[channel] if table.colour else "Red"]
        b.feed(result[ids.REFLECTANCE], b.combine(f["R"], f["G"], f["B"]))

    name = f"CDRF Reflectance {name_of(table.key)} {'+'.join(channels.split())}"
    role = f"{ids.ROLE_REFLECTANCE} {channels} {table.key}"
    if own_cosines:
        name, role = f"{name} mapped", f"{role} mapped"
    return ensure_group(name, role, VERSION, build)


def _on_tube(b: TreeBuilder, cosine: Any) -> tuple[Any, Any]:
    """Texture coordinates around the tube of a cosine's column."""
    root = b.math("SQRT", b.math("ABSOLUTE", cosine))
    q = b.math("MULTIPLY", root, b.math("SIGN", cosine))
    p = b.math("MULTIPLY", q, math.pi * DEFAULT_LAYOUT.seam_factor)
    # Blender maps the tube's (0..1) cube to (-1..1) itself.
    across = b.math("MULTIPLY_ADD", b.math("SINE", p), 0.5, 0.5)
    along = b.math("MULTIPLY_ADD", b.math("COSINE", p), 0.5, 0.5)
    return across, along


def detail_group() -> bpy.types.ShaderNodeTree:
    """Part of a normal map's detail that a sigma0 leaves (core/detail.py)."""

    def build(b: TreeBuilder) -> None:
        declare(b.tree, ids.SIGMA0, default=0.0, tip="Scatter distance of the channel")
        declare(b.tree, ids.DETAIL_SIZE, default=0.0, tip="Wavelength of the map's detail")
        declare(b.tree, ids.WEIGHT, output=True)
        given, result = b.ends()
        # Blender's division by zero is zero: all detail stays.
        ratio = b.math("DIVIDE", given[ids.SIGMA0], given[ids.DETAIL_SIZE])
        square = b.math("MULTIPLY", b.math("MULTIPLY", ratio, ratio), PHASE**2)
        near = b.math("INVERSE_SQRT", b.math("ADD", square, 1.0))
        far = b.math("INVERSE_SQRT", b.math("MULTIPLY_ADD", square, 9.0, 1.0))
        far = b.math("MULTIPLY", far, 0.75)
        b.feed(result[ids.WEIGHT], b.math("MULTIPLY_ADD", near, 0.25, far))

    return ensure_group("CDRF Detail", ids.ROLE_DETAIL, VERSION, build)


def diffused_group() -> bpy.types.ShaderNodeTree:
    """Kappa at the diffusion length that belongs to a sigma0 (core/scale_space.py).

    Wiring, with c = LENGTH_PER_SIGMA0, q = LEVEL_RATIO and levels K0 to K3:

        Sigma0 x c / Length -> max(., 1) -> log_q = t
        K0 + clamp(t) (K1 - K0) + clamp(t - 1) (K2 - K1) + clamp(t - 2) (K3 - K2) -> Curvature
    """

    def build(b: TreeBuilder) -> None:
        declare(b.tree, ids.LEVELS, "Color", tip="Curvature at the first three lengths")
        declare(b.tree, ids.LEVELS_ALPHA, tip="Curvature at the longest length")
        declare(b.tree, ids.LENGTH, default=1.0, tip="The shortest length")
        declare(b.tree, ids.SIGMA0, default=0.0, tip="Scatter distance of the channel")
        declare(b.tree, ids.CURVATURE, output=True)
        given, result = b.ends()
        length = b.math("MULTIPLY", given[ids.SIGMA0], LENGTH_PER_SIGMA0)
        ratio = b.math("MAXIMUM", b.math("DIVIDE", length, given[ids.LENGTH]), 1.0)
        place = b.math("LOGARITHM", ratio, LEVEL_RATIO)
        parts = b.node("ShaderNodeSeparateColor")
        b.feed(parts.inputs["Color"], given[ids.LEVELS])
        levels = [parts.outputs[name] for name in ("Red", "Green", "Blue")]
        levels.append(given[ids.LEVELS_ALPHA])
        kappa = levels[0]
        for step in range(LEVELS - 1):
            rise = b.math("SUBTRACT", levels[step + 1], levels[step])
            part = b.math("SUBTRACT", place, float(step), clamp=True)
            kappa = b.math("MULTIPLY_ADD", part, rise, kappa)
        b.feed(result[ids.CURVATURE], kappa)

    return ensure_group("CDRF Diffused Curvature", ids.ROLE_DIFFUSED, VERSION, build)


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


def _finite(b: TreeBuilder, sin2: Any, exponent: Any) -> tuple[Any, Any]:
    """Return variance and gain of a light of that squared sine (core/finite_light.py)."""
    c0, c1, c2 = VARIANCE_COEFFICIENTS
    inner = b.math("MULTIPLY_ADD", sin2, c2, c1)
    inner = b.math("MULTIPLY_ADD", sin2, inner, c0)
    variance = b.math("MULTIPLY", sin2, inner)
    return variance, b.math("EXPONENT", b.math("MULTIPLY", variance, exponent))


def _towards(b: TreeBuilder, position: Any) -> tuple[Any, Any]:
    """Vector from the shaded point to the light, and its squared length."""
    point = b.node("ShaderNodeNewGeometry").outputs["Position"]
    to_light = b.vector("SUBTRACT", position, point)
    return to_light, b.vector("DOT_PRODUCT", to_light, to_light)


def _window(b: TreeBuilder, distance2: Any, inverse_range2: Any) -> Any:
    """EEVEE's fade to zero at the light's range: clamp(1 - (d / R)^4)^2."""
    ratio2 = b.math("MULTIPLY", distance2, inverse_range2)
    fade = b.math("SUBTRACT", 1.0, b.math("MULTIPLY", ratio2, ratio2), clamp=True)
    return b.math("MULTIPLY", fade, fade)


def sun_group() -> bpy.types.ShaderNodeTree:
    """Sun: parallel light from Axis Z, blurred by its angle."""

    def build(b: TreeBuilder) -> None:
        _declare_light(b.tree)
        declare(b.tree, ids.AXIS_Z, "Vector", tip="Towards the sun, any length")
        declare(b.tree, ids.SIN2_HALF_ANGLE, low=0.0, high=1.0)
        given, result = b.ends()
        variance, gain = _finite(b, given[ids.SIN2_HALF_ANGLE], given[ids.GAIN])
        # A blurred terminator is not black, so a sun without a direction must be.
        length2 = b.vector("DOT_PRODUCT", given[ids.AXIS_Z], given[ids.AXIS_Z])
        amount = b.math("MULTIPLY", gain, b.math("GREATER_THAN", length2, 0.0))
        b.feed(result[ids.DIRECTION], b.vector("NORMALIZE", given[ids.AXIS_Z]))
        b.feed(result[ids.RADIANCE], b.vector("SCALE", given[ids.POWER], scale=amount))
        b.feed(result[ids.VARIANCE], variance)

    return ensure_group("CDRF Sun", "light SUN", VERSION, build)


def point_group() -> bpy.types.ShaderNodeTree:
    """Point: 1 / (d^2 + soft r^2), never nearer than its own radius, cut off at its range."""

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
    """Spot: a point light behind EEVEE's mask, elliptical where the lamp is scaled.

    With x, y, z the direction in the lamp's frame, its axes scaled as the lamp is:
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
        # Component over length: dot(L, A) / |A|^2; Blender's division by zero is zero.
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
    """Area: vector irradiance of a polygon (Lambert 1760), exact at any distance.

    F = 1/2 sum over the edges of angle x unit normal of the edge's plane, n / |n|, n = V0 x V1; the
    angle is atan2(|n|, V0 . V1). n is formed as V0 x (V1 - V0) with the edge taken from the lamp's
    axes, so that a small or far light does not cancel: 16 bits are left at size / distance = 0.001.
    |F| / pi is the form factor, F / |F| the direction from which the light comes.
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
        doubled: Any = (0.0, 0.0, 0.0)
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
        # Per square metre without Normalize, in all with it: area^-normalize. Of no area that would
        # be infinite, and nothing times it not a number.
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
    """Return the group for a light of that kind (lights.kind_of)."""
    if kind.startswith("AREA"):
        return area_group(elliptic=kind.split()[1] in ELLIPTIC)
    return {"SUN": sun_group, "POINT": point_group, "SPOT": spot_group}[kind]()


def display_group(*, signed: bool) -> bpy.types.ShaderNodeTree:
    """Curvature in colours (paper, Fig. 3a), from Minimum to Maximum; green where Mark is 1."""
    scale = SIGNED if signed else HOT

    def build(b: TreeBuilder) -> None:
        declare(b.tree, ids.CURVATURE, default=0.0, tip="Curvature, signed or not")
        declare(b.tree, ids.MINIMUM, default=0.0, tip="Shown in the first colour")
        declare(b.tree, ids.MAXIMUM, default=1.0, tip="Shown in the last colour")
        declare(b.tree, ids.MARK, default=0.0, tip="1 where the curvature was filled in")
        declare(b.tree, ids.SHADER, "Shader", output=True)
        given, result = b.ends()
        part = b.node("ShaderNodeMapRange", clamp=True)
        b.feed(part.inputs["Value"], given[ids.CURVATURE])
        b.feed(part.inputs["From Min"], given[ids.MINIMUM])
        b.feed(part.inputs["From Max"], given[ids.MAXIMUM])
        ramp = b.node("ShaderNodeValToRGB")
        stops = ramp.color_ramp.elements
        for _ in range(len(scale) - 2):
            stops.new(0.5)
        for stop, (position, colour) in zip(stops, scale, strict=True):
            stop.position, stop.color = position, (*colour, 1.0)
        b.feed(ramp.inputs["Fac"], part.outputs["Result"])
        marked = b.math("GREATER_THAN", given[ids.MARK], 0.5)
        kept = b.vector("SCALE", ramp.outputs["Color"], scale=b.math("SUBTRACT", 1.0, marked))
        green = b.vector("SCALE", MARK_COLOUR, scale=marked)
        emission = b.node("ShaderNodeEmission")
        b.feed(emission.inputs["Color"], b.vector("ADD", kept, green))
        b.feed(result[ids.SHADER], emission.outputs["Emission"])

    name = "CDRF Signed Curvature Display" if signed else "CDRF Curvature Display"
    role = f"{ids.ROLE_DISPLAY} signed" if signed else ids.ROLE_DISPLAY
    return ensure_group(name, role, VERSION, build)
