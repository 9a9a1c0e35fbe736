# SPDX-License-Identifier: GPL-3.0-or-later
"""The wiring of a shader group: the sum over its lights of paper Eq. 5, and nothing it lacks.

Wiring:

    levels -> kappa at the channel's length -> x Sigma0 x Ratio -> squared (curvature.py) --+
    light i -> Variance -> / moment of the channel (surface.py) ----------------------------+-> + -+
    light i -> Direction -+-> dot -> Cosine -----------------------> Reflectance f <---------------+
    normal (or map) ------+                                                |
    light i -> Radiance -> x received -> x visibility (visibility.py) -> x f -> sum over i --+
    world (world.py) ------------------------------------------------------------------------+-> +
        -> x Base Color -> Emission (Strength) -> Shader
"""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from ... import ids
from ..lights.scene_lights import SceneLight
from ..nodes.tables import Table
from ..nodes.tree import Operand, Sockets, TreeBuilder, declare
from ..world.light import WorldLight
from .curvature import surface_sigma
from .lights import add_lights, add_visibilities, sum_lights
from .surface import Normals, Surface, shading_normal, surface_normals
from .variant import CONSTANT, FLAT, Variant
from .visibility import thickness
from .walk import Walk, add_walk
from .world import add_world, filters_world

VERSION = 12
"""Raise it with every change of the wiring: Update rebuilds the groups of older files."""


def build(
    b: TreeBuilder,
    variant: Variant,
    lights: Sequence[SceneLight],
    world: WorldLight | None,
    table: Table,
) -> None:
    """Wire a shader group.

    Args:
        b: Builder of the empty group.
        variant: Of the group.
        lights: All that it has.
        world: The world's light, or None.
        table: Of the variant's model.
    """
    _declare(b.tree)
    _declare_extras(b.tree, variant)
    given, result = b.ends()
    if world is not None and world.environment.is_black:
        world = None
    walk = _walk(b, variant, given)
    surface = _surface(b, variant, lights, world, table, given, walk)
    lit = add_lights(b, variant, lights, table)
    visibilities = {}
    if variant.shadows.cast and any(light.casts for light in lights):
        visibilities = add_visibilities(b, lit)
        declare(b.tree, ids.THICKNESS, output=True, tip="Where the surface's own shadow begins")
        b.feed(result[ids.THICKNESS], thickness(b, given[ids.SIGMA0], given[ids.SIGMA0_RATIO]))
    total = sum_lights(b, variant, surface, lit, visibilities, given)
    if world is not None:
        total = add_world(b, variant, surface, world, total)
    emission = b.node("ShaderNodeEmission")
    colour = given[ids.BASE_COLOR] if walk is None else walk.reflected
    b.feed(emission.inputs["Color"], b.vector("MULTIPLY", total, colour))
    b.feed(emission.inputs["Strength"], given[ids.STRENGTH])
    b.feed(result[ids.SHADER], emission.outputs["Emission"])


def _surface(
    b: TreeBuilder,
    variant: Variant,
    lights: Sequence[SceneLight],
    world: WorldLight | None,
    table: Table,
    given: Sockets,
    walk: Walk | None,
) -> Surface:
    """Add what all lights share, as far as something depends on it."""
    normals: Normals = {}
    variance: Operand = (0.0, 0.0, 0.0)
    if lights or (world is not None and not world.environment.is_uniform):
        normals = surface_normals(b, variant, table, given)
        if walk is not None and walk.shift is not None:
            normals = {
                shared: b.vector("NORMALIZE", b.vector("SUBTRACT", normal, walk.shift))
                for shared, normal in normals.items()
            }
    if lights or (world is not None and filters_world(variant, world, table)):
        if walk is not None:
            return Surface(table, normals, walk.variance, walk.haze)
        sigma = surface_sigma(b, variant, given)
        if variant.source != FLAT:
            variance = b.vector("MULTIPLY", sigma, sigma)
    return Surface(table, normals, variance)


def _walk(b: TreeBuilder, variant: Variant, given: Sockets) -> Walk | None:
    if not variant.walk:
        return None
    sigma = surface_sigma(b, variant, given)
    return add_walk(b, variant, given, sigma, shading_normal(b, variant, given))


def _declare(tree: bpy.types.ShaderNodeTree) -> None:
    """Declare the sockets of every shader group."""
    declare(
        tree,
        ids.BASE_COLOR,
        "Color",
        default=(0.8, 0.8, 0.8, 1.0),
        tip="Albedo k_d: the colour of the surface in white light",
    )
    declare(
        tree,
        ids.SIGMA0,
        default=0.0,
        low=0.0,
        high=1e6,
        subtype="DISTANCE",
        tip="How far light travels under the surface. 0 is an opaque (Lambert) surface",
    )
    declare(
        tree,
        ids.SIGMA0_RATIO,
        "Vector",
        default=(1.0, 1.0, 1.0),
        low=0.0,
        high=1e3,
        tip="Sigma0 of red, green and blue, as factors of Sigma0",
    )
    declare(
        tree,
        ids.NORMAL,
        "Vector",
        default=(0.0, 0.0, 0.0),
        hide_value=True,
        tip="Normal or bump map; after connecting one press Update",
    )
    declare(tree, ids.STRENGTH, default=1.0, low=0.0, high=1e6, tip="Factor on the result")
    declare(tree, ids.SHADER, "Shader", output=True)


def _declare_extras(tree: bpy.types.ShaderNodeTree, variant: Variant) -> None:
    """Declare the sockets that only some variants have."""
    if variant.mapped:
        declare(
            tree,
            ids.DETAIL_SIZE,
            default=0.0,
            low=0.0,
            high=1e6,
            subtype="DISTANCE",
            tip="Size of the normal map's detail, from bump to bump. What is finer than the "
            "scatter distance is blurred, red most. 0 keeps all",
        )
    if variant.occluded:
        declare(
            tree,
            ids.OCCLUSION_DISTANCE,
            default=1.0,
            low=0.0,
            subtype="DISTANCE",
            tip="How far away a surface may be that still takes away from the world's light",
        )
    if variant.source == CONSTANT:
        declare(
            tree, ids.CURVATURE, default=0.0, low=0.0, tip="Curvature of the whole mesh, 1/length"
        )
    if variant.walk:
        declare(
            tree,
            ids.FREE_PATH,
            "Vector",
            default=(1.0, 1.0, 1.0),
            low=0.0,
            tip="Mean free path of red, green and blue over their scatter distances",
        )
        if variant.source == CONSTANT:
            declare(tree, ids.MEAN, default=0.0, tip="Mean curvature of the whole mesh, 1/length")
