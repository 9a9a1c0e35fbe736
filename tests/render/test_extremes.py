# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings at and beyond their ends: finite pixels, and theory where there is one."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np
import pytest
from rig import Rig, cdrf_node
from tolerances import WRITTEN

from cdrf_addon import ids
from cdrf_addon.core.reflectance.sphere_model import sphere_reflectance

ODD_LIGHTS: dict[str, dict[str, Any]] = {
    "at the centre": {"kind": "POINT", "energy": 10.0},
    "on the surface": {"kind": "POINT", "energy": 10.0, "location": (0.0, -1.0, 0.0)},
    "area at the centre": {"kind": "AREA", "energy": 10.0, "shape": "DISK"},
    "area on the surface": {"kind": "AREA", "energy": 10.0, "location": (0.0, -1.0, 0.0)},
    "blinding": {"kind": "POINT", "energy": 1e9, "location": (500.0, -500.0, 0.0)},
    "negative": {"kind": "POINT", "energy": -5.0, "location": (0.0, -2.0, 0.0)},
    "needle": {
        "kind": "SPOT",
        "energy": 10.0,
        "spot_size": math.radians(0.01),
        "location": (0.0, 0.0, 3.0),
    },
    "flat spot": {
        "kind": "SPOT",
        "energy": 10.0,
        "location": (0.0, 0.0, 3.0),
        "scale": (0.0, 1.0, 1.0),
    },
    "no spot": {
        "kind": "SPOT",
        "energy": 10.0,
        "location": (0.0, -2.0, 0.0),
        "scale": (0.0, 0.0, 0.0),
    },
    "area of no size": {
        "kind": "AREA",
        "energy": 10.0,
        "size": 0.0,
        "location": (0.0, 0.0, 2.0),
    },
    "area of a lamp of no size": {
        "kind": "AREA",
        "energy": 10.0,
        "location": (0.0, 0.0, 2.0),
        "scale": (0.0, 0.0, 0.0),
    },
    "wide open sun": {"kind": "SUN", "energy": 1.0, "angle": math.pi},
    "sun of no size": {"kind": "SUN", "energy": 1.0, "scale": (0.0, 0.0, 0.0)},
}


def add(rig: Rig, name: str, settings: dict[str, Any]) -> None:
    settings = dict(settings)
    scale = settings.pop("scale", (1.0, 1.0, 1.0))
    light = rig.light(settings.pop("kind"), name=name, **settings)
    light.scale = scale


def white_ball(rig: Rig, *, stretch: float = 1.0) -> bpy.types.Object:
    ball = rig.sphere()
    ball.scale = (1.0, 1.0, stretch)
    bpy.context.view_layer.update()
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    cdrf_node(ball).inputs["Base Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    return ball


@pytest.mark.smoke
@pytest.mark.parametrize("shadows", ["OFF", "ON"])
def test_odd_lights_give_finite_pixels(rig: Rig, shadows: str) -> None:
    rig.scene.render.resolution_x = rig.scene.render.resolution_y = 48
    for name, settings in ODD_LIGHTS.items():
        add(rig, name, settings)
    if shadows == "ON":
        for light in bpy.data.lights:
            light.use_shadow = True
    ball = white_ball(rig)
    ball.data.materials[0].cdrf.shadow_edges = False
    ball.data.materials[0].cdrf.shadows = shadows
    for sigma0 in (0.3, 1e4):
        ball.data.materials[0].cdrf.sigma0 = sigma0
        assert np.isfinite(rig.render()).all()


def test_sixty_four_suns_are_as_good_as_one(rig: Rig) -> None:
    rig.scene.render.resolution_x = rig.scene.render.resolution_y = 64
    turn = (1.2, 0.0, 0.5)
    for number in range(64):
        rig.light("SUN", name=f"Sun {number}", energy=math.pi / 64, angle=0.0, rotation=turn)
    ball = white_ball(rig)
    ball.data.materials[0].cdrf.sigma0 = 0.3
    picture = rig.render()
    normals, covered = rig.normals(ball)
    cosine = normals[covered] @ np.array(bpy.data.objects["Sun 0"].matrix_world)[:3, 2]
    wanted = sphere_reflectance(np.arccos(np.clip(cosine, -1.0, 1.0)), 0.3)
    assert np.abs(picture[covered][:, 0] - wanted).max() <= WRITTEN.worst


def test_a_negative_sun_of_a_lamp_turned_inside_out_takes_light_away(rig: Rig) -> None:
    rig.scene.render.resolution_x = rig.scene.render.resolution_y = 64
    turn = (1.2, 0.0, 0.5)
    plus = rig.light("SUN", energy=math.pi, angle=0.0, rotation=turn)
    minus = rig.light("SUN", energy=-0.3 * math.pi, angle=0.0, rotation=(0.9, 0.0, 2.9))
    minus.scale = (-1.0, -1.0, -1.0)
    ball = white_ball(rig)
    ball.data.materials[0].cdrf.sigma0 = 0.3
    picture = rig.render()
    normals, covered = rig.normals(ball)
    wanted = np.zeros(covered.sum())
    for sun, power in ((plus, 1.0), (minus, -0.3)):
        cosine = normals[covered] @ np.array(sun.matrix_world)[:3, 2]
        wanted += power * sphere_reflectance(np.arccos(np.clip(cosine, -1.0, 1.0)), 0.3)
    assert wanted.min() < -0.1  # there is nothing darker than black
    off = picture[covered][:, 0] - np.maximum(wanted, 0.0)
    assert np.abs(off).max() <= WRITTEN.worst


@pytest.mark.smoke
def test_curvature_that_is_not_a_number(rig: Rig) -> None:
    rig.light("SUN", energy=3.0)
    ball = white_ball(rig, stretch=1.5)
    ball.data.materials[0].cdrf.sigma0 = 0.2
    attribute = ball.data.attributes[ids.DIFFUSED_ATTRIBUTE].data
    values = np.empty(4 * len(attribute), dtype=np.float32)
    attribute.foreach_get("color", values)
    table = values.reshape(-1, 4)
    for number, bad in enumerate((math.nan, math.inf, -math.inf, 1e30, -1.0)):
        table[number::7] = bad
    attribute.foreach_set("color", values.ravel())
    ball.data.update()
    assert np.isfinite(rig.render()).all()


def test_curvature_at_its_ends(rig: Rig) -> None:
    """No curvature is Lambert; without end it is the mean over the sphere, 1/4."""
    rig.scene.render.resolution_x = rig.scene.render.resolution_y = 48
    sun = rig.light("SUN", energy=math.pi, angle=0.0, rotation=(1.2, 0.0, 0.5))
    ball = white_ball(rig)
    normals, covered = rig.normals(ball)
    lambert = np.maximum(normals[covered] @ np.array(sun.matrix_world)[:3, 2], 0.0)
    mean = np.full_like(lambert, 0.25)
    for sigma0, kappa, wanted in (
        (1.0, 0.0, lambert),
        (1e4, 0.0, lambert),
        (0.0, 1e6, lambert),
        (1.0, 1e6, mean),
        (1e4, 1.0, mean),
    ):
        ball.data.materials[0].cdrf.sigma0 = sigma0
        cdrf_node(ball).inputs[ids.CURVATURE].default_value = kappa
        assert np.abs(rig.render()[covered][:, 0] - wanted).max() <= WRITTEN.worst
