# SPDX-License-Identifier: GPL-3.0-or-later
"""The random walk under the surface: what comes out, how wide it spreads, where it is gathered.

The formulas are those of core/walk/view.py, wired for three channels at once. With A the base
colour, mu the cosine of the view, l the mean free path, H and kappa the curvatures:

    View Cosine -> depth, along, polynomials of G -------------+
    Base Color --+-> flat part A G -> less the walks' end -+   |
    Mean = l H --+-> odds z, hollow h ---------------------+-> A G E -> Reflected
    Curvedness = l kappa --+-> width^2 -> Variance
                           +-> haze -> Haze
                           +-> tilt k, one for all channels -> Tilt
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ... import ids
from ...core.walk import view
from ...core.walk.flat import TAIL_POWERS
from .tree import Operand, Socket, Sockets, TreeBuilder, declare, ensure_group

if TYPE_CHECKING:
    import bpy

    from ...core.walk.view import WalkModel

VERSION = 1
_ONE, _ZERO = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
_ENDLESS = 1e9
"""Where every curvature ends, so that infinities are numbers."""


def walk_group(key: str, model: WalkModel, *, curved: bool) -> bpy.types.ShaderNodeTree:
    """Return the group of a walk.

    Args:
        key: Of the walk (core/walk/view.py); stamped, so that each walk has one group.
        model: Its coefficients.
        curved: Whether the surface bends; a flat one has only Reflected.
    """

    def build(b: TreeBuilder) -> None:
        declare(b.tree, ids.BASE_COLOR, "Vector", tip="Colour in white light, per channel")
        declare(b.tree, ids.VIEW_COSINE, tip="Cosine between normal and view")
        if curved:
            declare(b.tree, ids.MEAN, "Vector", tip="Mean curvature times mean free path")
            declare(b.tree, ids.CURVEDNESS, "Vector", tip="Curvedness times mean free path")
        declare(b.tree, ids.REFLECTED, "Vector", output=True)
        if curved:
            for name in (ids.VARIANCE, ids.HAZE):
                declare(b.tree, name, "Vector", output=True)
            declare(b.tree, ids.TILT, output=True)
        given, result = b.ends()
        colour = _limited(b, given[ids.BASE_COLOR], 0.0, 1.0)
        mu = b.math("MULTIPLY", given[ids.VIEW_COSINE], 1.0, clamp=True)
        flat = _flat_part(b, model, colour, mu)
        if not curved:
            b.feed(result[ids.REFLECTED], _shown(b, model, colour, mu, flat, None))
            return
        depth = _polynomial(b, model.flat.depth, mu)
        bent = _limited(b, given[ids.MEAN], -_ENDLESS, _ENDLESS)
        reflected = _reflected(b, model, colour, mu, depth, flat, bent)
        b.feed(result[ids.REFLECTED], reflected)
        size = _limited(b, given[ids.CURVEDNESS], 0.0, _ENDLESS)
        b.feed(result[ids.VARIANCE], _variance(b, colour, depth, size))
        b.feed(result[ids.HAZE], _haze(b, colour, depth, size))
        along = _polynomial(b, model.flat.along, mu)
        b.feed(result[ids.TILT], _tilt(b, colour, depth, along, size))

    shape = "Curved" if curved else "Flat"
    return ensure_group(f"CDRF Walk {shape}", f"{ids.ROLE_WALK} {shape} {key}", VERSION, build)


def haze_group() -> bpy.types.ShaderNodeTree:
    """Return the group that takes the haze off a reflectance; see `kernel` in core/walk/view.py.

    Wiring:

        Cosine c -> c + r (c^2 - 1/3) -> x Haze -> Reflectance - . -> max(., 0)
    """

    def build(b: TreeBuilder) -> None:
        declare(b.tree, ids.REFLECTANCE, "Vector")
        declare(b.tree, ids.HAZE, "Vector")
        declare(b.tree, ids.COSINE, "Vector", tip="Cosine between normal and light")
        declare(b.tree, ids.LEFT, "Vector", output=True)
        given, result = b.ends()
        cosine, ratio = given[ids.COSINE], view.HAZE_RATIO
        inner = b.vector("MULTIPLY_ADD", cosine, (-ratio,) * 3, (-1.0,) * 3)
        tail = b.vector("MULTIPLY_ADD", cosine, inner, (ratio / 3.0,) * 3)
        left = b.vector("MULTIPLY_ADD", given[ids.HAZE], tail, given[ids.REFLECTANCE])
        b.feed(result[ids.LEFT], b.vector("MAXIMUM", left, _ZERO))

    return ensure_group("CDRF Haze", ids.ROLE_HAZE, VERSION, build)


# --- the parts ------------------------------------------------------------------------------------


def _limited(b: TreeBuilder, value: Operand, low: float, high: float) -> Socket:
    # MINIMUM(limit, NaN) is the limit: in this order a bad attribute stays finite.
    return b.vector("MAXIMUM", (low,) * 3, b.vector("MINIMUM", (high,) * 3, value))


def _polynomial(b: TreeBuilder, coefficients: Sequence[float], x: Socket) -> Operand:
    """Return a polynomial of a number, its coefficients from the constant up."""
    value: Operand = coefficients[-1]
    for coefficient in reversed(coefficients[:-1]):
        value = b.math("MULTIPLY_ADD", value, x, coefficient)
    return value


def _line(b: TreeBuilder, x: Operand, factor: float, constant: float) -> Socket:
    return b.math("MULTIPLY_ADD", x, factor, constant)


def _flat_part(b: TreeBuilder, model: WalkModel, colour: Socket, mu: Socket) -> Socket:
    """A G of walks without an end: A (1 + (1 - A) (base(mu) + A slope(mu)))."""
    base, slope = (_polynomial(b, part, mu) for part in (model.flat.base, model.flat.slope))
    inner = b.vector("MULTIPLY_ADD", colour, slope, base)
    rest = b.vector("MULTIPLY", b.vector("SUBTRACT", _ONE, colour), inner)
    return _limited(b, b.vector("MULTIPLY_ADD", rest, colour, colour), 0.0, 1.0)


def _shown(
    b: TreeBuilder, model: WalkModel, colour: Socket, mu: Socket, flat: Socket, bulge: Socket | None
) -> Socket:
    """Return the flat part less what the end of the walks takes away where the surface is flat."""
    if not any(model.flat.tail):
        return flat
    power, powers = colour, {1: colour}
    for exponent in (2, 4, 8, 16, 32):
        power = b.vector("MULTIPLY", power, power)
        powers[exponent] = power
    tail: Operand = _ZERO
    for factor, exponent in zip(model.flat.tail, TAIL_POWERS, strict=True):
        tail = b.vector("MULTIPLY_ADD", powers[exponent], (factor,) * 3, tail)
    lost = b.vector("SCALE", tail, scale=_polynomial(b, model.flat.lost, mu))
    if bulge is not None:
        ended = b.vector("MULTIPLY_ADD", bulge, (-view.ENDED,) * 3, _ONE)
        lost = b.vector("MULTIPLY", lost, b.vector("MAXIMUM", ended, _ZERO))
    return b.vector("MAXIMUM", b.vector("SUBTRACT", flat, lost), _ZERO)


def _reflected(
    b: TreeBuilder,
    model: WalkModel,
    colour: Socket,
    mu: Socket,
    entered: Operand,
    flat: Socket,
    bent: Socket,
) -> Socket:
    """A G E = F (D + z) / ((D + F z) (1 + h hollow)), F what a flat surface shows, D = 1 - F."""
    bulge = b.vector("MAXIMUM", bent, _ZERO)
    hollow = b.vector("MAXIMUM", b.vector("SCALE", bent, scale=-1.0), _ZERO)
    shown = _shown(b, model, colour, mu, flat, bulge)
    gain = view.GAIN
    depth = b.math("MAXIMUM", entered, view.LEAST_DEPTH)
    top = [_line(b, depth, gain[4 + n], gain[1 + n]) for n in range(3)]
    inner = b.vector("MULTIPLY_ADD", colour, top[2], top[1])
    rise = b.vector("MULTIPLY_ADD", colour, inner, top[0])
    dark = b.vector("SUBTRACT", _ONE, colour)
    soft = b.vector("SCALE", dark, scale=b.math("MULTIPLY", depth, gain[8]))
    below = b.vector("ADD", b.vector("ADD", bulge, soft), (gain[7],) * 3)
    part = b.vector("DIVIDE", bulge, below)
    odds = b.vector("MULTIPLY", bulge, b.vector("MULTIPLY_ADD", rise, part, (gain[0],) * 3))
    missing = b.vector("MAXIMUM", b.vector("SUBTRACT", _ONE, shown), (view.LEAST_LOST,) * 3)
    part = b.vector("DIVIDE", hollow, b.vector("ADD", hollow, _ONE))
    h = view.HOLLOW
    ends = [_line(b, entered, h[2 + n], h[n]) for n in range(2)]
    loss = b.vector("MULTIPLY_ADD", colour, ends[1], ends[0])
    loss = b.vector("MULTIPLY_ADD", part, (h[4],) * 3, loss)
    loss = b.vector("MULTIPLY_ADD", loss, hollow, _ONE)
    whole = b.vector("MULTIPLY", b.vector("MULTIPLY_ADD", shown, odds, missing), loss)
    escaped = b.vector("MULTIPLY", shown, b.vector("ADD", missing, odds))
    return b.vector("DIVIDE", escaped, whole)


def _variance(b: TreeBuilder, colour: Socket, depth: Operand, size: Socket) -> Socket:
    """Square of the width: s^2 / (1 + (s / most)^2), s = slope(A) (1 + w4 depth) l kappa."""
    w = view.WIDTH
    slope: Operand = (w[3],) * 3
    for coefficient in (w[2], w[1], w[0]):
        slope = b.vector("MULTIPLY_ADD", colour, slope, (coefficient,) * 3)
    straight = b.vector("SCALE", slope, scale=_line(b, depth, w[4], 1.0))
    straight = b.vector("MULTIPLY", straight, size)
    most = b.vector("MULTIPLY_ADD", colour, (w[6],) * 3, _line(b, depth, w[7], w[5]))
    # In this form an endless straight leaves most^2.
    share = b.vector("DIVIDE", straight, most)
    square = b.vector("MULTIPLY", share, share)
    part = b.vector("DIVIDE", square, b.vector("ADD", square, _ONE))
    return b.vector("MULTIPLY", part, b.vector("MULTIPLY", most, most))


def _haze(b: TreeBuilder, colour: Socket, depth: Operand, size: Socket) -> Socket:
    """A^2 (h0 + h1 A^2) (1 + h2 depth) y^2 / (y + h3), y = l kappa up to MOST_CURVED."""
    h = view.HAZE
    y = b.vector("MINIMUM", size, (view.MOST_CURVED,) * 3)
    square = b.vector("MULTIPLY", colour, colour)
    strength = b.vector("MULTIPLY_ADD", square, (h[1],) * 3, (h[0],) * 3)
    strength = b.vector("MULTIPLY", strength, square)
    strength = b.vector("SCALE", strength, scale=_line(b, depth, h[2], 1.0))
    part = b.vector("DIVIDE", b.vector("MULTIPLY", y, y), b.vector("ADD", y, (h[3],) * 3))
    return b.vector("MULTIPLY", strength, part)


def _tilt(b: TreeBuilder, colour: Socket, depth: Operand, along: Operand, size: Socket) -> Socket:
    """K for the mean of the channels: one normal, and so one cosine a light, serves all three."""
    t = view.TILT
    third = (1.0 / 3.0,) * 3
    a, whole = (b.vector("DOT_PRODUCT", part, third) for part in (colour, size))
    y = b.math("MINIMUM", whole, view.MOST_CURVED)
    ends = [_line(b, depth, t[2 + n], t[n]) for n in range(2)]
    k = b.math("MULTIPLY_ADD", a, ends[1], ends[0])
    k = b.math("MULTIPLY_ADD", y, _line(b, depth, t[5], t[4]), k)
    k = b.math("MULTIPLY", k, along)
    falling = b.math("DIVIDE", view.MOST_CURVED, b.math("MAXIMUM", whole, view.MOST_CURVED))
    return b.math("MULTIPLY", k, falling)


def hazed(b: TreeBuilder, bands: Sockets, haze: Operand) -> dict[str, Operand]:
    """Take the haze off the bands of a world's light.

    Of Lambert's bands (2 pi / 3 and pi / 4) the haze takes 4 pi / 3 of the first and r 8 pi / 15 of
    the second; the mean stays.
    """
    left: dict[str, Operand] = dict(bands)
    for name, factor in zip(ids.BANDS[1:], (2.0, view.HAZE_RATIO * 32.0 / 15.0), strict=True):
        part = b.vector("MULTIPLY_ADD", haze, (-factor,) * 3, bands[name])
        left[name] = b.vector("MAXIMUM", part, _ZERO)
    return left
