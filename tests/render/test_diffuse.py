# SPDX-License-Identifier: GPL-3.0-or-later
"""At sigma0 = 0 every light, whatever its settings, agrees with Blender's own Diffuse BSDF."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest
from mathutils import Vector
from rig import Rig, cdrf_node, diffuse_material
from tolerances import DIFFUSE, DIFFUSE_AT_TERMINATOR, DIFFUSE_TERMINATOR

PLACE = (2.0, -2.5, 1.5)
TILTED = (1.2, 0.3, 0.5)
CASES: dict[str, dict[str, Any]] = {
    "sun": {"kind": "SUN", "energy": 3.0},
    "sun of 11 degrees": {"kind": "SUN", "energy": 3.0, "angle": 0.2},
    "sun of 46 degrees, not normalised": {
        "kind": "SUN",
        "energy": 3.0,
        "angle": 0.8,
        "normalize": False,
    },
    "point": {"kind": "POINT", "energy": 300.0},
    "point of 0.3 m": {"kind": "POINT", "energy": 300.0, "shadow_soft_size": 0.3},
    "point of 0.3 m, hard falloff": {
        "kind": "POINT",
        "energy": 300.0,
        "shadow_soft_size": 0.3,
        "use_soft_falloff": False,
    },
    "point, not normalised": {
        "kind": "POINT",
        "energy": 300.0,
        "shadow_soft_size": 0.3,
        "normalize": False,
    },
    "point, warm, exposed, tinted, half diffuse": {
        "kind": "POINT",
        "energy": 100.0,
        "exposure": 1.0,
        "color": (1.0, 0.5, 0.2),
        "use_temperature": True,
        "temperature": 3000.0,
        "diffuse_factor": 0.5,
    },
    "point with custom distance": {
        "kind": "POINT",
        "energy": 300.0,
        "use_custom_distance": True,
        "cutoff_distance": 4.0,
    },
    "spot": {"kind": "SPOT", "energy": 300.0, "spot_size": 0.6, "spot_blend": 0.3},
    "spot of a scaled lamp": {
        "kind": "SPOT",
        "energy": 300.0,
        "spot_size": 0.6,
        "spot_blend": 0.3,
        "scale": (2.0, 1.0, 1.0),
    },
    "square": {"kind": "AREA", "energy": 300.0, "size": 1.0},
    "large square": {"kind": "AREA", "energy": 300.0, "size": 2.0},
    "rectangle": {
        "kind": "AREA",
        "energy": 300.0,
        "shape": "RECTANGLE",
        "size_y": 0.4,
        "size": 1.0,
    },
    "disk": {"kind": "AREA", "energy": 300.0, "shape": "DISK", "size": 1.0},
    "tilted ellipse of a scaled lamp": {
        "kind": "AREA",
        "energy": 300.0,
        "shape": "ELLIPSE",
        "size": 0.5,
        "size_y": 0.3,
        "scale": (2.0, 1.0, 1.0),
        "rotation": TILTED,
    },
    "spot of 180 degrees": {"kind": "SPOT", "energy": 300.0, "spot_size": np.pi},
    "spot of a mirrored lamp": {
        "kind": "SPOT",
        "energy": 300.0,
        "spot_size": 0.6,
        "spot_blend": 0.3,
        "scale": (-1.0, 1.0, 1.0),
    },
    "square of a mirrored lamp": {
        "kind": "AREA",
        "energy": 300.0,
        "size": 1.0,
        "scale": (-1.0, 1.0, 1.0),
    },
    "spot of a lamp turned inside out": {
        "kind": "SPOT",
        "energy": 300.0,
        "spot_size": 0.6,
        "spot_blend": 0.3,
        "scale": (-2.0, -1.0, -1.0),
        "rotation": tuple((-Vector(PLACE)).to_track_quat("Z", "Y").to_euler()),
    },
    "square with a spread, which EEVEE does not heed": {
        "kind": "AREA",
        "energy": 300.0,
        "size": 1.0,
        "spread": 0.6,
    },
    "square, not normalised, scaled": {
        "kind": "AREA",
        "energy": 300.0,
        "size": 0.5,
        "normalize": False,
        "scale": (2.0, 1.0, 1.0),
    },
}


@pytest.mark.parametrize(
    "settings",
    [
        pytest.param(v, id=k, marks=[pytest.mark.smoke] if k in {"sun", "spot", "square"} else [])
        for k, v in CASES.items()
    ],
)
def test_agrees_with_the_diffuse_bsdf(rig: Rig, settings: dict[str, Any]) -> None:
    settings = dict(settings)
    scale = settings.pop("scale", (1.0, 1.0, 1.0))
    aimed = tuple(Vector(PLACE).to_track_quat("Z", "Y").to_euler())
    light = rig.light(
        settings.pop("kind"),
        location=PLACE,
        rotation=settings.pop("rotation", aimed),
        **settings,
    )
    light.scale = scale
    bpy.context.view_layer.update()
    sphere = rig.sphere()
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    sphere.data.materials[0].cdrf.sigma0 = 0.0
    cdrf_node(sphere).inputs["Base Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    ours = rig.render()
    normals, covered = rig.normals(sphere)
    sphere.data.materials[0] = diffuse_material()
    theirs = rig.render()

    peak = np.abs(theirs[covered][:, :3]).max()
    assert peak > 0.0
    error = np.abs(ours - theirs)[covered][:, :3].max(axis=1) / peak
    if light.data.type == "SUN":
        direction = np.array(light.matrix_world)[:3, 2]
        cosine = normals[covered] @ direction
    else:
        to_light = np.array(light.location) - normals[covered]  # on a unit sphere P = N
        to_light /= np.linalg.norm(to_light, axis=1, keepdims=True)
        cosine = (normals[covered] * to_light).sum(axis=1)
    edge = np.abs(cosine) < DIFFUSE_TERMINATOR
    print(f"worst {error[~edge].max():.2e}, at the terminator {error[edge].max(initial=0.0):.2e}")
    assert error[~edge].max() <= DIFFUSE.worst
    assert np.sqrt((error[~edge] ** 2).mean()) <= DIFFUSE.rms
    assert error[edge].max(initial=0.0) <= DIFFUSE_AT_TERMINATOR.worst
