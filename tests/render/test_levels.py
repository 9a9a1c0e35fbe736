# SPDX-License-Identifier: GPL-3.0-or-later
"""Curvature at each channel's own diffusion length: the shader's interpolation in pixels."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from rig import Rig, cdrf_node
from tolerances import SHADER

from cdrf_addon import ids
from cdrf_addon.core.curvature.scale_space import (
    LENGTH_PER_SIGMA0,
    LEVEL_RATIO,
    LEVELS,
    KappaLevels,
)
from cdrf_addon.core.reflectance.sphere_model import sphere_reflectance

FROM_THE_SIDE = (math.radians(50.0), 0.0, math.radians(70.0))
KAPPAS = (3.0, 1.5, 0.6, 0.2)


def egg(rig: Rig) -> bpy.types.Object:
    """Almost a sphere: its curvature varies, so it is stored at the vertices."""
    obj = rig.sphere()
    obj.scale = (1.0, 1.0, 1.1)
    bpy.ops.object.transform_apply(scale=True)
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    cdrf_node(obj).inputs[ids.BASE_COLOR].default_value = (1.0, 1.0, 1.0, 1.0)
    return obj


def store(mesh: bpy.types.Mesh, levels: KappaLevels) -> None:
    attribute = mesh.attributes[ids.DIFFUSED_ATTRIBUTE]
    attribute.data.foreach_set("color", np.tile(levels.values[0], len(mesh.vertices)))
    lengths = np.full(len(mesh.vertices), levels.shortest[0], dtype=np.float32)
    mesh.attributes[ids.LENGTH_ATTRIBUTE].data.foreach_set("value", lengths)
    mesh.update_tag()


@pytest.mark.smoke
def test_each_channel_takes_kappa_at_its_own_length(rig: Rig) -> None:
    sun = rig.light("SUN", energy=math.pi, angle=0.0, rotation=FROM_THE_SIDE)
    obj = egg(rig)
    levels = KappaLevels(np.array([KAPPAS]), shortest=np.array([0.02]))
    store(obj.data, levels)
    material = obj.data.materials[0]
    ratio = (1.0, 0.3, 0.05)
    material.cdrf.sigma0_ratio = ratio
    normals, covered = rig.normals(obj)
    bpy.context.view_layer.update()
    towards = np.array(sun.matrix_world)[:3, 2]
    theta = np.arccos(np.clip(normals[covered] @ towards, -1.0, 1.0))
    longest = 0.02 * LEVEL_RATIO ** (LEVELS - 1) / LENGTH_PER_SIGMA0
    # Below the shortest length, between the lengths, and beyond the longest.
    for sigma0 in (0.0, 0.01, 0.05, 0.17, 0.6, 2.0 * longest):
        material.cdrf.sigma0 = sigma0
        value, _ = rig.render_exact(obj, "Shader", -0.01, 1.01)
        for channel, factor in enumerate(ratio):
            own = sigma0 * factor
            kappa = float(levels.at(LENGTH_PER_SIGMA0 * own)[0])
            error = np.abs(value[covered][:, channel] - sphere_reflectance(theta, own * kappa))
            assert error.max() <= SHADER.worst, (sigma0, channel, error.max())


def test_an_object_twice_as_large_scatters_like_the_measured_one_at_half_the_distance(
    rig: Rig,
) -> None:
    sun = rig.light("SUN", energy=math.pi, angle=0.0, rotation=FROM_THE_SIDE)
    obj = egg(rig)
    other = obj.copy()
    other.scale, other.location = (2.0, 2.0, 2.0), (50.0, 0.0, 0.0)
    rig.scene.collection.objects.link(other)
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    material = obj.data.materials[0]
    levels = KappaLevels(np.array([KAPPAS]), shortest=np.array([0.02]))
    store(obj.data, levels)
    bpy.context.view_layer.update()
    towards = np.array(sun.matrix_world)[:3, 2]
    material.cdrf.sigma0 = 0.4
    for shown, hidden, size, centre in ((obj, other, 1.0, 0.0), (other, obj, 2.0, 50.0)):
        rig.camera.data.ortho_scale, rig.camera.location.x = 2.3 * size, centre
        shown.hide_render, hidden.hide_render = False, True
        normals, covered = rig.normals(shown)
        theta = np.arccos(np.clip(normals[covered] @ towards, -1.0, 1.0))
        kappa = float(levels.at(LENGTH_PER_SIGMA0 * 0.4 / size)[0]) / size
        value, _ = rig.render_exact(shown, "Shader", -0.01, 1.01)
        error = np.abs(value[covered][:, 0] - sphere_reflectance(theta, 0.4 * kappa))
        assert error.max() <= SHADER.worst, (size, error.max())
