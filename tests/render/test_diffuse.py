# SPDX-License-Identifier: GPL-3.0-or-later
"""At sigma0 = 0 every light, whatever its settings, agrees with Blender's own Diffuse BSDF."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest
from mathutils import Vector
from numpy.typing import NDArray
from rig import Rig, cdrf_node, diffuse_material
from tolerances import DIFFUSE, DIFFUSE_AT_TERMINATOR, DIFFUSE_TERMINATOR

from cdrf_addon import ids
from cdrf_addon.blender import state
from cdrf_addon.compat import INSTANCER_LINKS

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


@pytest.mark.smoke
def test_lamps_scaled_to_nothing_are_dark(rig: Rig) -> None:
    """A spot light with any axis of no length, an area light, and a sun without a direction."""
    aimed = tuple(Vector(PLACE).to_track_quat("Z", "Y").to_euler())
    flat = [("SPOT", (0, 1, 1)), ("SPOT", (1, 0, 1)), ("SPOT", (1, 1, 0))]
    dead = []
    for kind, scale in [*flat, ("AREA", (1, 0, 1)), ("SUN", (1, 1, 0))]:
        dead.append(rig.light(kind, energy=300.0, location=PLACE, rotation=aimed))
        dead[-1].scale = scale
    sphere = rig.sphere()
    sphere.data.materials.append(diffuse_material())
    assert rig.render()[..., :3].max() == 0.0
    sphere.data.materials.clear()

    rig.light("POINT", energy=300.0, location=PLACE)
    bpy.context.view_layer.update()
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    sphere.data.materials[0].cdrf.sigma0 = 1.0  # blurred so far that no side is black by itself
    all_of_them = rig.render()
    for lamp in dead:
        bpy.data.objects.remove(lamp)
    assert bpy.ops.cdrf.update() == {"FINISHED"}
    alone = rig.render()
    assert alone[..., :3].max() > 0.3
    assert np.array_equal(all_of_them, alone)


def collection(*items: bpy.types.Object, name: str = "Group") -> bpy.types.Collection:
    found = bpy.data.collections.new(name)
    for obj in items:
        found.objects.link(obj)
    return found


def colours(rig: Rig, kinds: dict[str, dict[str, Any]]) -> list[bpy.types.Object]:
    """Add a red, a green and a blue light, so that each channel shows one of them alone."""
    aimed = tuple(Vector(PLACE).to_track_quat("Z", "Y").to_euler())
    return [
        rig.light(kind, location=PLACE, rotation=aimed, color=colour, **settings)
        for (kind, settings), colour in zip(kinds.items(), np.eye(3), strict=True)
    ]


def assert_as_diffuse(rig: Rig, items: list[bpy.types.Object]) -> NDArray[np.float64]:
    """Render at sigma0 = 0, and compare with the Diffuse BSDF channel by channel."""
    material = items[0].data.materials[0]
    material.cdrf.sigma0 = 0.0
    cdrf_node(items[0]).inputs["Base Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    ours = rig.render()
    for obj in items:
        obj.data.materials[0] = diffuse_material()
    theirs = rig.render()
    for obj in items:
        obj.data.materials[0] = material
    peaks = theirs[..., :3].max(axis=(0, 1))
    error = np.abs(ours - theirs)[..., :3].max(axis=(0, 1)) / np.maximum(peaks, 1e-3)
    print(f"peaks {peaks}, worst {error}")
    assert error.max() <= DIFFUSE_AT_TERMINATOR.worst
    return ours


@pytest.mark.smoke
def test_light_linking_is_heeded_by_each_object(rig: Rig) -> None:
    """One material on two balls: included, excluded, nested, mixed, and received by neither."""
    red, green, blue = colours(
        rig, {"SUN": {}, "POINT": {"energy": 300.0}, "AREA": {"energy": 300.0}}
    )
    white = rig.light("SUN", rotation=(1.0, 0.0, 0.0))
    left, right = rig.sphere(0.5), rig.sphere(0.5)
    left.location, right.location = (-0.5, 0.0, 0.0), (0.5, 0.0, 0.0)
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    left.data.materials.append(right.data.materials[0])
    bpy.ops.cdrf.update()

    red.light_linking.receiver_collection = collection(left)
    green.light_linking.receiver_collection = collection(left)
    green.light_linking.receiver_collection.collection_objects[
        0
    ].light_linking.link_state = "EXCLUDE"
    mixed = collection(left)
    mixed.children.link(collection(left, right, name="Inner"))
    mixed.collection_objects[0].light_linking.link_state = "EXCLUDE"
    blue.light_linking.receiver_collection = mixed
    white.light_linking.receiver_collection = collection(rig.link(None))
    due = " ".join(state.reasons_to_update(left, rig.scene, bpy.context.view_layer))
    assert "linked to other objects" in due
    bpy.ops.cdrf.update()
    assert state.reasons_to_update(left, rig.scene, bpy.context.view_layer) == []
    assert ids.UNLIT_KEY in left and ids.UNLIT_KEY in right
    shown = assert_as_diffuse(rig, [left, right])
    middle = shown.shape[1] // 2
    sides = [shown[:, :middle], shown[:, middle:]]
    assert [[bool(side[..., c].max() > 0.1) for c in range(3)] for side in sides] == [
        [True, False, False],
        [False, True, True],
    ]

    # An object without the property, such as a new one, receives every light that some object does.
    del right[ids.UNLIT_KEY]
    more = rig.render()
    assert more[:, middle:, 0].max() > 0.1
    assert np.array_equal(more[:, middle:, 1:], shown[:, middle:, 1:])
    due = " ".join(state.reasons_to_update(right, rig.scene, bpy.context.view_layer))
    assert "receives others" in due


@pytest.mark.smoke
def test_lights_in_a_collection_instance(rig: Rig) -> None:
    """Of every sort, in a collection with an origin of its own; lamps and empty move afterwards."""
    kinds = {"POINT": {}, "SPOT": {"spot_size": 0.6, "spot_blend": 0.3}, "AREA": {}}
    lamps = colours(rig, {kind: {"energy": 300.0, **more} for kind, more in kinds.items()})
    inner = collection(*lamps, name="Lamps")
    outer = collection(name="Rig")
    outer.children.link(inner)
    outer.instance_offset = (0.3, -0.2, 0.1)
    for lamp in lamps:
        rig.scene.collection.objects.unlink(lamp)
    empty = rig.link(None)
    empty.instance_type, empty.instance_collection = "COLLECTION", outer
    ball = rig.sphere()
    other = rig.sphere()
    other.location = (50.0, 0.0, 0.0)
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    ball.data.materials.append(other.data.materials[0])
    bpy.ops.cdrf.update()

    empty.location, empty.rotation_euler, empty.scale = (
        (0.4, 0.1, 0.2),
        (0.1, 0.0, -0.3),
        (1.2,) * 3,
    )
    lamps[0].location.x += 0.5
    lamps[2].rotation_euler.x += 0.2
    outer.instance_offset = (0.2, -0.1, 0.1)
    bpy.context.view_layer.update()
    assert state.reasons_to_update(ball, rig.scene, bpy.context.view_layer) == []
    assert (assert_as_diffuse(rig, [ball])[..., :3].max(axis=(0, 1)) > 0.1).all()

    # Blender 4.5 heeds the lamp's light linking, 5.2 the empty's.
    for lamp in lamps:
        lamp.light_linking.receiver_collection = collection(other)
    empty.light_linking.receiver_collection = collection(ball)
    bpy.ops.cdrf.update()
    assert ids.UNLIT_KEY in (other if INSTANCER_LINKS else ball)
    assert_as_diffuse(rig, [ball])

    empty.light_linking.receiver_collection = None
    for lamp in lamps:
        lamp.light_linking.receiver_collection = None
    bpy.ops.cdrf.update()
    empty.hide_render = True
    assert rig.render()[..., :3].max() == 0.0
    due = " ".join(state.reasons_to_update(ball, rig.scene, bpy.context.view_layer))
    assert "3 lights are gone" in due
