# SPDX-License-Identifier: GPL-3.0-or-later
"""The nodes of the world's light: static groups, and its branch in a scene's shader group.

    Variance -> Bands (what the skin leaves of bands 0 to 2) --+
    Normal -> turned as the world's picture is ----------------+-> Harmonics -+
    the world's sun, turned back, as any other sun -> x f --------------------+-> x World -> + total

Only what a world has is there: a plain one is one node, or two where the model wins energy.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ... import ids
from ...core.reflectance.environment import BAND_ROWS, Sun, bands_of_table, shader_coefficients
from ...core.reflectance.lut import DEFAULT_LAYOUT, VARIANCE_MAX
from ...core.reflectance.model import SPHERE, name_of
from ..lights.scene_lights import drive
from ..nodes.tables import Table, packed_image
from ..nodes.tree import TreeBuilder, declare, ensure_group
from ..world.light import WorldLight

VERSION = 1
COLUMNS = 3
"""Columns of a table of band factors, one for each channel."""


def bands_group(channels: str, table: Table) -> bpy.types.ShaderNodeTree:
    """What is left of bands 0, 1 and 2 at a variance (core/ambient.py), per channel.

    On the sphere 1, exp(-v), exp(-3 v); of other models from a small table beside their own, with
    one look-up for each part of `channels`.
    """
    # Channels of a table with colour differ at the same variance.
    sets = "R G B" if table.colour else channels

    def build(b: TreeBuilder) -> None:
        declare(b.tree, ids.VARIANCE, "Vector", tip="Squared blur width of each channel")
        for name in ids.BANDS:
            declare(b.tree, name, "Vector", output=True)
        given, result = b.ends()
        variance = dict(zip("RGB", b.separate(given[ids.VARIANCE]), strict=True))
        if table.key == SPHERE:
            _closed_form(b, sets, variance, result)
        else:
            _looked_up(b, sets, variance, result, table)

    name = f"CDRF Bands {name_of(table.key)} {'+'.join(sets.split())}"
    return ensure_group(name, f"{ids.ROLE_BANDS} {sets} {table.key}", VERSION, build)


def _limited(b: TreeBuilder, variance: Any) -> Any:
    # The limit first: MINIMUM(limit, NaN) is the limit, so a bad attribute stays finite.
    return b.math("MAXIMUM", 0.0, b.math("MINIMUM", VARIANCE_MAX, variance))


def _closed_form(b: TreeBuilder, sets: str, variance: dict[str, Any], result: Any) -> None:
    left = {}
    for shared in sets.split():
        power = b.math("MULTIPLY", _limited(b, variance[shared[0]]), -1.0)
        left.update(dict.fromkeys(shared, b.math("EXPONENT", power)))
    one = b.combine(left["R"], left["G"], left["B"])
    three = b.vector("MULTIPLY", b.vector("MULTIPLY", one, one), one)
    for name, value in zip(ids.BANDS, ((1.0, 1.0, 1.0), one, three), strict=True):
        b.feed(result[name], value)


def _looked_up(
    b: TreeBuilder, sets: str, variance: dict[str, Any], result: Any, table: Table
) -> None:
    image = bands_image(table)
    bands: list[dict[str, Any]] = [{}, {}, {}]
    for shared in sets.split():
        part = b.math("MULTIPLY", _limited(b, variance[shared[0]]), 1.0 / VARIANCE_MAX)
        row = b.math("SQRT", b.math("SQRT", part))
        v = b.math("MULTIPLY_ADD", row, (BAND_ROWS - 1.0) / BAND_ROWS, 0.5 / BAND_ROWS)
        # The tube's angle of a column's centre; its projection reads no coarser mip levels.
        angle = np.pi * (1.0 - 2.0 * ("RGB".index(shared[0]) + 0.5) / COLUMNS)
        x, y = (float(0.5 + 0.5 * wave) for wave in (np.sin(angle), np.cos(angle)))
        value = b.look_up(image, f"Bands {shared}", x, y, v)
        for factors, output in zip(bands, ("Red", "Green", "Blue"), strict=True):
            factors.update(dict.fromkeys(shared, value[output]))
    for name, factors in zip(ids.BANDS, bands, strict=True):
        b.feed(result[name], b.combine(factors["R"], factors["G"], factors["B"]))


def bands_image(table: Table) -> bpy.types.Image:
    """Return the packed table of a model's band factors, made from its look-up table."""
    role = f"{ids.ROLE_BANDS} {table.key}"
    for image in bpy.data.images:
        if image.library is None and image.get(ids.ROLE_KEY) == role:
            return image
    width, height = table.image.size
    flat = np.empty(width * height * 4, dtype=np.float32)
    table.image.pixels.foreach_get(flat)
    values = flat.reshape(height, width, 4)[..., :3].astype(np.float64)
    bands = bands_of_table(values, DEFAULT_LAYOUT)
    image = packed_image(f"{ids.BANDS_IMAGE} {name_of(table.key)}", bands)
    image[ids.ROLE_KEY] = role
    # Kept in the file even where no light looks it up: a measured one could not be made again.
    table.image.use_fake_user = True
    return image


def harmonics_group() -> bpy.types.ShaderNodeTree:
    """Radiance of a white surface under nine harmonics, per channel, never negative.

    Wiring, with c the coefficients of core/ambient.py and B the bands:

        B0 c0 + B1 (cx x + cy y + cz z)
              + B2 (cxy xy + cyz yz + czx zx + c7 (3 zz - 1) + c8 (xx - yy))  -> max(., 0)
    """

    def build(b: TreeBuilder) -> None:
        declare(b.tree, ids.NORMAL, "Vector", hide_value=True, tip="Unit normal, world space")
        for name in ids.BANDS:
            declare(b.tree, name, "Vector", default=(1.0,) * 3, tip="What is left of the band")
        for name in ids.COEFFICIENTS:
            declare(b.tree, name, "Vector", tip="Red, green and blue of this polynomial")
        declare(b.tree, ids.RADIANCE, "Vector", output=True)
        given, result = b.ends()
        x, y, z = b.separate(given[ids.NORMAL])
        squares = b.math("MULTIPLY", x, x), b.math("MULTIPLY", y, y), b.math("MULTIPLY", z, z)
        basis = [
            x,
            y,
            z,
            b.math("MULTIPLY", x, y),
            b.math("MULTIPLY", y, z),
            b.math("MULTIPLY", z, x),
            b.math("MULTIPLY_ADD", squares[2], 3.0, -1.0),
            b.math("SUBTRACT", squares[0], squares[1]),
        ]
        terms = [
            b.vector("SCALE", given[name], scale=part)
            for name, part in zip(ids.COEFFICIENTS[1:], basis, strict=True)
        ]
        total = b.vector("MULTIPLY", given[ids.COEFFICIENTS[0]], given[ids.BANDS[0]])
        for name, band in ((ids.BANDS[1], terms[:3]), (ids.BANDS[2], terms[3:])):
            value = band[0]
            for term in band[1:]:
                value = b.vector("ADD", value, term)
            total = b.vector("MULTIPLY_ADD", value, given[name], total)
        b.feed(result[ids.RADIANCE], b.vector("MAXIMUM", total, (0.0, 0.0, 0.0)))

    return ensure_group("CDRF Harmonics", ids.ROLE_HARMONICS, VERSION, build)


def world_strength(b: TreeBuilder, light: WorldLight) -> Any:
    """Factor on each channel, driven by the world; None where it is 1."""
    drivers = light.drivers() if light.world is not None else []
    if not drivers:
        return None
    node = b.node("ShaderNodeCombineXYZ", ids.WORLD_NODE)
    for name, (expression, paths) in zip("XYZ", drivers, strict=True):
        drive(b.tree, node.inputs[name], light.world, expression, paths)
    return node.outputs["Vector"]


def world_rotation(b: TreeBuilder, light: WorldLight) -> Any:
    """Angles around X, Y and Z, driven by the world's Mapping node; None where nothing turns."""
    paths = light.rotation()
    if not paths or light.environment.is_uniform:
        return None
    node = b.node("ShaderNodeCombineXYZ", "World Rotation")
    for name, path in zip("XYZ", paths, strict=True):
        drive(b.tree, node.inputs[name], light.world, "r", {"r": path})
    return node.outputs["Vector"]


def _turned(b: TreeBuilder, vector: Any, rotation: Any, *, inverse: bool) -> Any:
    node = b.node("ShaderNodeMapping", vector_type="TEXTURE" if inverse else "VECTOR")
    b.feed(node.inputs["Vector"], vector)
    b.feed(node.inputs["Rotation"], rotation)
    return node.outputs["Vector"]


def harmonics_node(
    b: TreeBuilder, light: WorldLight, normal: Any, bands: Any, rotation: Any = None
) -> Any:
    """Radiance of the world without its sun.

    Args:
        b: Builder of the shader group.
        light: The world's.
        normal: Socket of the normal, or None where it makes no difference.
        bands: Outputs of a bands group, or None.
        rotation: What `world_rotation` returned.
    """
    coefficients = shader_coefficients(light.environment.harmonics)
    if light.environment.is_uniform:
        constant = tuple(float(part) for part in coefficients[0])
        return constant if bands is None else b.vector("MULTIPLY", bands[ids.BANDS[0]], constant)
    if rotation is not None:
        normal = _turned(b, normal, rotation, inverse=light.inverse)
    node = b.group(harmonics_group(), "World Harmonics")
    b.feed(node.inputs[ids.NORMAL], normal)
    for name in ids.BANDS if bands is not None else ():
        b.feed(node.inputs[name], bands[name])
    for name, value in zip(ids.COEFFICIENTS, coefficients, strict=True):
        b.feed(node.inputs[name], tuple(float(part) for part in value))
    return node.outputs[ids.RADIANCE]


def feed_sun(
    b: TreeBuilder, node: bpy.types.ShaderNode, light: WorldLight, sun: Sun, rotation: Any
) -> None:
    """Give an instance of the sun's group the world's sun, which moves only with the world."""
    node.inputs[ids.POWER].default_value = sun.radiance
    axis: Any = sun.direction
    if rotation is not None:
        axis = _turned(b, axis, rotation, inverse=not light.inverse)
    b.feed(node.inputs[ids.AXIS_Z], axis)
    node.inputs[ids.SIN2_HALF_ANGLE].default_value = sun.sin2_half_angle


def occlusion_node(b: TreeBuilder, distance: Any) -> Any:
    """Part of the world that is seen past what is near."""
    node = b.node("ShaderNodeAmbientOcclusion", "Ambient Occlusion")
    b.feed(node.inputs["Distance"], distance)
    return node.outputs["AO"]
