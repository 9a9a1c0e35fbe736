# SPDX-License-Identifier: GPL-3.0-or-later
"""The world's light in a shader group: its harmonics, its sun, and what follows the world.

Wiring, only as far as a world has it (a plain one is one node, or two where the model filters it):

    Variance -> Bands -----------------------------+
    normal -> turned by the world's Mapping node --+-> Harmonics --------+
    the sun's direction, turned back -> Sun -> Reflectance x Radiance ---+-> +
        -> x Ambient Occlusion -> x World (drivers) -> + sum over the lights
"""

from __future__ import annotations

import math
from collections.abc import Callable

import bpy

from ... import ids
from ...core.reflectance.environment import Sun, shader_coefficients
from ...core.reflectance.model import SPHERE
from ..lights.drivers import drive
from ..lights.scene_lights import HARD_SUN, SceneLight
from ..nodes.harmonics import bands_group, harmonics_group
from ..nodes.lights import light_group
from ..nodes.tables import Table
from ..nodes.tree import Operand, Socket, Sockets, TreeBuilder
from ..nodes.walk import hazed
from ..world.light import WorldLight
from .surface import Surface, per_channel, reflectance_node
from .variant import FLAT, Variant
from .wired import lookups_of

SMALL_SUN = math.sin(HARD_SUN / 2.0) ** 2
"""Squared sine of half the angle of a sun that hardly blurs the terminator."""


def filters_world(variant: Variant, world: WorldLight, table: Table) -> bool:
    """Return whether the surface changes the world's light: it scatters, and not grey alone."""
    whole = world.environment.is_uniform and table.key == SPHERE
    return variant.source != FLAT and not whole


def add_world(
    b: TreeBuilder, variant: Variant, surface: Surface, world: WorldLight, total: Operand
) -> Socket:
    """Add the world's light to that of the lights.

    Args:
        b: Builder of the shader group.
        variant: Of the group.
        surface: What is lit.
        world: Its light.
        total: The sum over the lights.

    Returns:
        The sum of both.
    """
    environment, table = world.environment, surface.table
    bands = None
    if filters_world(variant, world, table):
        node = b.group(bands_group(variant.channels, table), "Bands", Variance=surface.variance)
        bands = node.outputs if surface.haze is None else hazed(b, node.outputs, surface.haze)
    rotation = _rotation(b, world)
    light = per_channel(b, surface.normals, _harmonics(b, world, bands, rotation))
    if environment.sun is not None:
        sun = SceneLight(None, "SUN", environment.sun.sin2_half_angle > SMALL_SUN)
        node = b.group(light_group("SUN"), "World Sun")
        node.inputs[ids.GAIN].default_value = table.gain
        _feed_sun(b, node, world, environment.sun, rotation)
        f = reflectance_node(b, surface, node, lookups_of(table, variant, sun), "World Sun")
        light = b.vector("MULTIPLY_ADD", f, node.outputs[ids.RADIANCE], light)
    if variant.occluded:
        distance = b.node("NodeGroupInput").outputs[ids.OCCLUSION_DISTANCE]
        light = b.vector("SCALE", light, scale=_occlusion(b, distance))
    strength = _strength(b, world)
    if strength is None:
        return b.vector("ADD", light, total)
    return b.vector("MULTIPLY_ADD", light, strength, total)


def _harmonics(
    b: TreeBuilder, world: WorldLight, bands: Sockets | None, rotation: Socket | None
) -> Callable[[Socket | None], Operand]:
    """Return what adds the world's radiance without its sun, at a normal.

    Args:
        b: Builder of the shader group.
        world: Its light.
        bands: Outputs of a bands group; None where nothing is filtered.
        rotation: What `_rotation` returned.
    """
    coefficients = shader_coefficients(world.environment.harmonics)

    def uniform(_normal: Socket | None) -> Operand:
        constant = tuple(float(part) for part in coefficients[0])
        return constant if bands is None else b.vector("MULTIPLY", bands[ids.BANDS[0]], constant)

    def varying(normal: Socket | None) -> Operand:
        assert normal is not None
        if rotation is not None:
            normal = _turned(b, normal, rotation, inverse=world.inverse)
        node = b.group(harmonics_group(), "World Harmonics")
        b.feed(node.inputs[ids.NORMAL], normal)
        if bands is not None:
            for name in ids.BANDS:
                b.feed(node.inputs[name], bands[name])
        for name, value in zip(ids.COEFFICIENTS, coefficients, strict=True):
            b.feed(node.inputs[name], tuple(float(part) for part in value))
        return node.outputs[ids.RADIANCE]

    return uniform if world.environment.is_uniform else varying


def _feed_sun(
    b: TreeBuilder, node: bpy.types.ShaderNode, world: WorldLight, sun: Sun, rotation: Socket | None
) -> None:
    """Set an instance of the sun's group to the world's sun, which only turns with the world."""
    node.inputs[ids.POWER].default_value = sun.radiance
    axis: Operand = sun.direction
    if rotation is not None:
        axis = _turned(b, axis, rotation, inverse=not world.inverse)
    b.feed(node.inputs[ids.AXIS_Z], axis)
    node.inputs[ids.SIN2_HALF_ANGLE].default_value = sun.sin2_half_angle


def _turned(b: TreeBuilder, vector: Operand, rotation: Socket, *, inverse: bool) -> Socket:
    node = b.node("ShaderNodeMapping", vector_type="TEXTURE" if inverse else "VECTOR")
    b.feed(node.inputs["Vector"], vector)
    b.feed(node.inputs["Rotation"], rotation)
    return node.outputs["Vector"]


def _occlusion(b: TreeBuilder, distance: Operand) -> Socket:
    """Return the part of the world that nearby surfaces leave visible."""
    node = b.node("ShaderNodeAmbientOcclusion", "Ambient Occlusion")
    b.feed(node.inputs["Distance"], distance)
    return node.outputs["AO"]


def _strength(b: TreeBuilder, world: WorldLight) -> Socket | None:
    """Return the factor on each channel, driven by the world; None where it is 1."""
    drivers = world.drivers() if world.world is not None else []
    if not drivers:
        return None
    node = b.node("ShaderNodeCombineXYZ", ids.WORLD_NODE)
    for name, (expression, paths) in zip("XYZ", drivers, strict=True):
        drive(b.tree, node.inputs[name], world.world, expression, paths)
    return node.outputs["Vector"]


def _rotation(b: TreeBuilder, world: WorldLight) -> Socket | None:
    """Return the angles around X, Y and Z, driven by the Mapping node; None if nothing turns."""
    paths = world.rotation()
    if not paths or world.environment.is_uniform:
        return None
    node = b.node("ShaderNodeCombineXYZ", "World Rotation")
    for name, path in zip("XYZ", paths, strict=True):
        drive(b.tree, node.inputs[name], world.world, "r", {"r": path})
    return node.outputs["Vector"]
