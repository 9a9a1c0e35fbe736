# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendered pixels of a sphere against f(theta, sigma), on the normals the shader sees."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np
import pytest
from rig import Rig, cdrf_node
from scipy.integrate import quad
from tolerances import FOUR_LIGHTS, SHADER, WRITTEN, Bound

from cdrf_addon.core.reflectance.finite_light import SPHERE_GAIN, finite_light
from cdrf_addon.core.reflectance.model import PROFILE, RING, SPHERE, ring, sphere
from cdrf_addon.core.reflectance.profile import profile
from cdrf_addon.core.reflectance.sphere_model import sphere_reflectance

SIGMAS = (0.0, 0.01, 0.05, 0.1, 0.3, 1.0, 3.0, 30.0)
FROM_THE_SIDE = (math.radians(50.0), 0.0, math.radians(70.0))


def assert_within(error: np.ndarray, bound: Bound, what: str) -> None:
    worst, rms = float(np.abs(error).max()), float(np.sqrt((error**2).mean()))
    print(f"{what}: worst {worst:.2e}, RMS {rms:.2e} (bounds {bound.worst:.0e}, {bound.rms:.0e})")
    assert worst <= bound.worst, f"{what}: worst pixel {worst:.2e} > {bound.worst:.0e}"
    assert rms <= bound.rms, f"{what}: RMS {rms:.2e} > {bound.rms:.0e}"


def towards(light: bpy.types.Object) -> np.ndarray:
    bpy.context.view_layer.update()
    return np.array(light.matrix_world)[:3, 2]


def white_sphere(rig: Rig, radius: float = 1.0) -> bpy.types.Object:
    sphere = rig.sphere(radius)
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    cdrf_node(sphere).inputs["Base Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    return sphere


@pytest.mark.smoke
def test_written_pixels_follow_the_reflectance_for_every_sigma(rig: Rig) -> None:
    sun = rig.light("SUN", energy=math.pi, angle=0.0, rotation=FROM_THE_SIDE)
    sphere = white_sphere(rig)
    normals, covered = rig.normals(sphere)
    theta = np.arccos(np.clip(normals[covered] @ towards(sun), -1.0, 1.0))
    for sigma in SIGMAS:
        sphere.data.materials[0].cdrf.sigma0 = sigma
        pixels = rig.render()
        assert np.isfinite(pixels).all()
        error = pixels[covered][:, :3] - sphere_reflectance(theta, sigma)[:, None]
        assert_within(error, WRITTEN, f"sigma {sigma:g}")


@pytest.mark.parametrize("kind", [SPHERE, RING])
def test_shader_value_before_the_film_rounds_it(rig: Rig, kind: str) -> None:
    reflectance = {SPHERE: sphere(), RING: ring()}[kind].evaluate
    sun = rig.light("SUN", energy=math.pi, angle=0.0, rotation=FROM_THE_SIDE)
    ball = white_sphere(rig)
    material = ball.data.materials[0]
    material.cdrf.model = kind
    # Three sigmas at once, one per channel: also the test of the three look-ups.
    material.cdrf.sigma0_ratio = (1.0, 0.1, 0.01)
    normals, covered = rig.normals(ball)
    theta = np.arccos(np.clip(normals[covered] @ towards(sun), -1.0, 1.0))
    for sigma in (0.0, 0.39, 1.0, 3.0, 30.0):
        material.cdrf.sigma0 = sigma
        value, _ = rig.render_exact(ball, "Shader", -0.01, 1.01)
        for channel, factor in enumerate((1.0, 0.1, 0.01)):
            error = value[covered][:, channel] - reflectance(theta, sigma * factor)
            assert_within(error, SHADER, f"{kind}, sigma {sigma * factor:g}, channel {channel}")


def test_one_look_up_serves_the_channels_of_a_profile(rig: Rig) -> None:
    sun = rig.light("SUN", energy=math.pi, angle=0.0, rotation=FROM_THE_SIDE)
    ball = white_sphere(rig)
    material = ball.data.materials[0]
    material.cdrf.model = PROFILE
    assert cdrf_node(ball).node_tree["cdrf_channels"] == "RGB"
    normals, covered = rig.normals(ball)
    theta = np.arccos(np.clip(normals[covered] @ towards(sun), -1.0, 1.0))
    for sigma in (0.0, 0.1, 1.0):
        material.cdrf.sigma0 = sigma
        value, _ = rig.render_exact(ball, "Shader", -0.01, 1.01)
        error = value[covered][:, :3] - profile().evaluate(theta, sigma)
        assert_within(error, SHADER, f"skin, sigma {sigma:g}")


def test_a_large_light_blurs_each_channel_of_a_profile_alike(rig: Rig) -> None:
    # A sun of 40 degrees over skin that hardly scatters: all channels see its own blur alone.
    sun = rig.light("SUN", energy=math.pi, angle=math.radians(40.0), rotation=FROM_THE_SIDE)
    ball = white_sphere(rig)
    material = ball.data.materials[0]
    material.cdrf.model = PROFILE
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    material.cdrf.sigma0 = 1e-4
    normals, covered = rig.normals(ball)
    theta = np.arccos(np.clip(normals[covered] @ towards(sun), -1.0, 1.0))
    variance, gain = finite_light(math.sin(math.radians(20.0)) ** 2, SPHERE_GAIN)
    value, _ = rig.render_exact(ball, "Shader", -0.01, 1.2)
    expected = gain * sphere_reflectance(theta, math.sqrt(variance))
    for channel, bound in enumerate((0.03, 0.03, 0.03)):
        error = np.abs(value[covered][:, channel] - expected).max()
        assert error <= bound, (channel, error)


def test_sigma_is_sigma0_over_the_radius(rig: Rig) -> None:
    sun = rig.light("SUN", energy=math.pi, angle=0.0, rotation=FROM_THE_SIDE)
    rig.camera.data.ortho_scale = 0.7
    sphere = white_sphere(rig, radius=0.3)
    sphere.data.materials[0].cdrf.sigma0 = 0.15
    normals, covered = rig.normals(sphere)
    theta = np.arccos(np.clip(normals[covered] @ towards(sun), -1.0, 1.0))
    assert_within(
        rig.render()[covered][:, 0] - sphere_reflectance(theta, 0.5), WRITTEN, "sigma 0.5"
    )


LOCAL: dict[str, Any] = {"location": (1.5, -3.0, 2.0)}
AIMED = {**LOCAL, "rotation": (math.radians(59.2), 0.0, math.radians(26.6))}
LIGHTS: dict[str, dict[str, Any]] = {
    "SUN": {"energy": 1.0, "angle": 0.0, "rotation": FROM_THE_SIDE},
    "POINT": {"energy": 100.0, **LOCAL},
    "SPOT": {"energy": 100.0, "spot_size": 1.6, "spot_blend": 0.5, **AIMED},
    "AREA": {"energy": 30.0, "size": 0.02, **AIMED},
}


def irradiance_over_pi(
    light: bpy.types.Object, points: np.ndarray, threshold: float
) -> tuple[np.ndarray, np.ndarray]:
    """Radiance of a white surface facing a small light, and the direction to it, from theory."""
    lamp = light.data
    axis = towards(light)
    if lamp.type == "SUN":
        return np.full(len(points), lamp.energy / math.pi), np.tile(axis, (len(points), 1))
    to_light = np.array(light.matrix_world)[:3, 3] - points
    distance = np.linalg.norm(to_light, axis=1)
    direction = to_light / distance[:, None]
    cut_off2 = lamp.energy / (100.0 * threshold)
    window = np.clip(1.0 - (distance**2 / cut_off2) ** 2, 0.0, None) ** 2
    facing = direction @ axis
    if lamp.type == "AREA":
        return lamp.energy / math.pi**2 * facing / distance**2 * window, direction
    value = lamp.energy / (4.0 * math.pi**2) / distance**2 * window
    if lamp.type == "SPOT":
        edge = math.cos(lamp.spot_size / 2.0)
        t = np.clip((facing - edge) / ((1.0 - edge) * lamp.spot_blend), 0.0, 1.0)
        value = value * t * t * (3.0 - 2.0 * t)
    return value, direction


@pytest.mark.parametrize("kinds", [*([kind] for kind in LIGHTS), list(LIGHTS)], ids="+".join)
def test_each_light_type_alone_and_all_at_once(rig: Rig, kinds: list[str]) -> None:
    lights = [rig.light(kind, **LIGHTS[kind]) for kind in kinds]
    sphere = white_sphere(rig)
    sphere.data.materials[0].cdrf.sigma0 = 0.3
    normals, covered = rig.normals(sphere)
    points, _ = rig.render_exact(sphere, "Position", -1.01, 1.01)
    normals, points = normals[covered], points[covered]
    threshold = rig.scene.eevee.light_threshold
    expected = np.zeros(len(points))
    for light in lights:
        value, direction = irradiance_over_pi(light, points, threshold)
        cosine = np.clip((normals * direction).sum(axis=1), -1.0, 1.0)
        expected += value * sphere_reflectance(np.arccos(cosine), 0.3)
    peak = expected.max()
    for lamp in lights:
        lamp.data.energy /= peak  # so that bounds are in units of the peak ...
        lamp.data.use_custom_distance = True  # ... with the range that was computed above
        lamp.data.cutoff_distance = math.sqrt(lamp.data.energy * peak / (100.0 * threshold))
    error = rig.render()[covered][:, 0] - expected / peak
    assert_within(error, WRITTEN if len(kinds) == 1 else FOUR_LIGHTS, "+".join(kinds))


def ring_energy(sigma: float) -> float:
    """Mean of the ring model over a sphere."""
    return 0.5 * quad(lambda t: ring().evaluate(t, sigma) * math.sin(t), 0.0, math.pi)[0]


@pytest.mark.parametrize("kind", [SPHERE, RING])
def test_energy_that_leaves_a_closed_sphere(rig: Rig, kind: str) -> None:
    # Lit across the view, the visible half is the mirror image of the other.
    rig.light("SUN", energy=math.pi, angle=0.0, rotation=(math.pi / 2, 0.0, math.pi / 2))
    ball = white_sphere(rig)
    material = ball.data.materials[0]
    material.cdrf.model = kind
    normals, covered = rig.normals(ball)
    cosine = normals[covered][:, 0]
    order = np.argsort(cosine)
    # To both poles of the light, where no pixel's centre is.
    ends = np.concatenate(([-1.0], cosine[order], [1.0]))
    for sigma in (0.0, 0.3, 3.0):
        material.cdrf.sigma0 = sigma
        value, _ = rig.render_exact(ball, "Shader", -0.01, 1.01)
        seen = value[covered][order, 0]
        found = 0.5 * np.trapezoid(np.concatenate((seen[:1], seen, seen[-1:])), ends)
        # Heat is neither made nor lost: a disc's share of a sphere, 1/4. The ring's blur is along
        # a circle, where the poles weigh as much as the equator, and so makes light.
        expected = 0.25
        if kind == RING:
            expected = ring_energy(sigma)
        # 1e-4 is the look-up's; what is left out beyond the outermost pixels less.
        assert abs(found - expected) <= 1e-4, (sigma, found, expected)
