# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights of the report: a sun, three discs, and a world's picture."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector
from rig import Rig

from cdrf_addon.compat import ensure_node_tree

from ..common.arrays import Array
from ..common.rays import unit
from ..kappa_choice.settings import LIGHTS

SOFTBOXES = "studio.exr"
"""The HDRI, one of those that come with Blender (CC0)."""


def _sun(rig: Rig) -> None:
    turn = Vector(LIGHTS["left"]).to_track_quat("Z", "Y").to_euler()
    rig.light("SUN", name="Sun", energy=math.pi, angle=0.0, use_shadow=True, rotation=turn)


SOFT = {
    "Key": ((-0.7, -0.6, 0.45), 0.8, 1.5),
    "Fill": ((0.85, -0.6, 0.1), 0.2, 3.0),
    "Rim": ((0.55, 0.75, 0.6), 0.9, 1.0),
}
"""Direction, radiance of a white surface that faces it, diameter."""
SOFT_DISTANCE = 6.0


def _key_fill_rim(rig: Rig) -> None:
    for name, (direction, radiance, size) in SOFT.items():
        towards = Vector(direction).normalized()
        rig.light(
            "AREA",
            name=name,
            shape="DISK",
            size=size,
            energy=radiance * (math.pi * SOFT_DISTANCE) ** 2,
            use_shadow=True,
            location=SOFT_DISTANCE * towards,
            rotation=towards.to_track_quat("Z", "Y").to_euler(),
        )


HDRI_STRENGTH = 0.4


def _hdri(rig: Rig) -> None:
    folder = Path(bpy.utils.system_resource("DATAFILES")) / "studiolights" / "world"
    tree = ensure_node_tree(rig.scene.world)
    picture = tree.nodes.new("ShaderNodeTexEnvironment")
    picture.image = bpy.data.images.load(str(folder / SOFTBOXES))
    background = tree.nodes["Background"]
    background.inputs["Strength"].default_value = HDRI_STRENGTH
    tree.links.new(picture.outputs["Color"], background.inputs["Color"])
    # EEVEE would merge the softboxes into one sun with a hard shadow (see matrix.sun_taken_out).
    rig.scene.world.sun_threshold = 0.0


RIGS: dict[str, Callable[[Rig], None]] = {
    "sun": _sun,
    "key + fill + rim": _key_fill_rim,
    "HDRI": _hdri,
}


def directions(light: bpy.types.Object, places: Array) -> Array:
    """Unit vectors towards a light, (n, 3)."""
    if light.data.type == "SUN":
        along = np.array(light.matrix_world)[:3, 2]
        return np.broadcast_to(along / np.linalg.norm(along), places.shape)
    return unit(np.array(light.location) - places)
