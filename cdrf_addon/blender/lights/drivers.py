# SPDX-License-Identifier: GPL-3.0-or-later
"""The drivers by which the nodes of a light follow it.

Every driver is a *simple expression* over properties: Blender evaluates those without Python, so
they work with Auto-Run off, in background renders and without the extension. All is read through
the light's object, so that a light is followed without a click when it is moved, parented,
animated, relinked or switched off.

A path into a matrix names the column first: matrix_world[2][0] is the x of the lamp's Z axis.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import bpy

from ... import ids
from .scene_lights import SceneLight

Paths = dict[str, str | tuple[bpy.types.ID, str]]
"""What each name in a driver's expression stands for; see `drive`."""

AXES = {ids.AXIS_X: 0, ids.AXIS_Y: 1, ids.AXIS_Z: 2, ids.POSITION: 3}
"""Column of a light's matrix that feeds each input."""

# From Blender's power to the radiance of a white Lambert surface that faces the light (decision
# 003): sun E / pi, point and spot P / (4 pi^2 d^2), area P / pi^2.
CONSTANTS = {
    "SUN": 1.0 / math.pi,
    "POINT": 1.0 / (4.0 * math.pi**2),
    "SPOT": 1.0 / (4.0 * math.pi**2),
    "AREA": 1.0 / math.pi**2,
}
ONE_SIZE = {"SQUARE", "DISK"}
"""Shapes of an area light that have the same size along X and Y."""
MOST_FLAGS = 30
"""Most Exclude flags in one driver, as Blender cuts its expression at 256 characters."""


def drive_light(
    tree: bpy.types.ShaderNodeTree, node: bpy.types.ShaderNode, light: SceneLight
) -> None:
    """Drive the inputs of a light's node from the light's object.

    Args:
        tree: The node tree that owns the drivers.
        node: An instance of the group for the light's kind (nodes/lights.py).
        light: What to follow.
    """
    lamp = light.object
    inputs = node.inputs
    for name, column in AXES.items():
        if name in inputs:
            for row in range(3):
                drive(tree, inputs[name], lamp, *_placed(light, column, row), row)
    for channel in range(3):
        expression, paths = _power(light, channel)
        drive(tree, inputs[ids.POWER], lamp, expression, paths, channel)
    for name, (expression, paths) in _settings(light).items():
        drive(tree, inputs[name], lamp, expression, paths)


def _placed(light: SceneLight, column: int, row: int) -> tuple[str, Paths]:
    """Return expression and paths of an element of the matrix that places a light in the world.

    In an instance that is the empty's matrix times the lamp's, with the lamp's position relative to
    the offset of the collection.
    """
    empty = light.instance
    if empty is None:
        return "v", {"v": f"matrix_world[{column}][{row}]"}
    paths: Paths = {f"l{k}": f"matrix_world[{column}][{k}]" for k in range(3)}
    paths |= {f"e{k}": (empty, f"matrix_world[{k}][{row}]") for k in range(3)}
    if column != AXES[ids.POSITION]:
        return "e0*l0+e1*l1+e2*l2", paths
    paths |= {f"o{k}": (empty, f"instance_collection.instance_offset[{k}]") for k in range(3)}
    paths |= {"e3": (empty, f"matrix_world[3][{row}]")}
    return "e0*(l0-o0)+e1*(l1-o1)+e2*(l2-o2)+e3", paths


def _power(light: SceneLight, channel: int) -> tuple[str, Paths]:
    """Return expression and paths of a light's power in a channel."""
    paths: Paths = {
        "e": "data.energy",
        "x": "data.exposure",
        "c": f"data.color[{channel}]",
        "t": f"data.temperature_color[{channel}]",
        "d": "data.diffuse_factor",
        "h": "hide_render",
        "q": "visible_diffuse",
    }
    expression = f"{CONSTANTS[light.type]!r}*e*pow(2,x)*c*t*d*(1-h)*q"
    # Without Normalize, power is per area; the group of an area light handles that itself.
    if light.type == "SUN":
        paths |= {"n": "data.normalize", "a": "data.angle"}
        expression += "*(n+(1-n)*pi*pow(sin(a/2),2))"
    elif light.type in {"POINT", "SPOT"}:
        paths |= {"n": "data.normalize", "r": "data.shadow_soft_size"}
        expression += "*(n+(1-n)*4*pi*r*r)"
    if 0 < len(light.excluded) <= MOST_FLAGS:
        flags = {f"l{number}": path for number, path in enumerate(light.excluded)}
        paths |= {name: f"layer:{path}" for name, path in flags.items()}
        expression += f"*(1-{'*'.join(flags)})"
    if light.instance is not None:
        paths |= {"i": (light.instance, "hide_render")}
        expression += "*(1-i)"
    return expression, paths


def _settings(light: SceneLight) -> dict[str, tuple[str, Paths]]:
    """Return expression and paths of the inputs that not every type of light has, by name."""
    if light.type == "SUN":
        # EEVEE's limits: half-angles from 0.001 rad to just under a right angle.
        return {
            ids.SIN2_HALF_ANGLE: ("pow(sin(min(a,3.1398)/2),2)", {"a": "data.angle"}),
        }
    settings: dict[str, tuple[str, Paths]] = {ids.INVERSE_RANGE2: _inverse_range2()}
    if light.type in {"POINT", "SPOT"}:
        settings[ids.RADIUS] = ("r", {"r": "data.shadow_soft_size"})
        settings[ids.SOFT_FALLOFF] = ("s", {"s": "data.use_soft_falloff"})
    if light.type == "SPOT":
        cone: Paths = {"s": "data.spot_size"}
        settings[ids.CONE_COSINE] = ("cos(s/2)", cone)
        settings[ids.CONE_SHARPNESS] = (
            "1/max(1e-8,(1-cos(s/2))*b)",
            cone | {"b": "data.spot_blend"},
        )
    if light.type == "AREA":
        second = "data.size" if light.kind.split()[1] in ONE_SIZE else "data.size_y"
        settings[ids.HALF_X] = ("s/2", {"s": "data.size"})
        settings[ids.HALF_Y] = ("s/2", {"s": second})
        settings[ids.NORMALIZE] = ("n", {"n": "data.normalize"})
    return settings


def _inverse_range2() -> tuple[str, Paths]:
    """Return EEVEE's cut-off: the custom distance, or where the light falls below the threshold."""
    paths: Paths = {
        "u": "data.use_custom_distance",
        "k": "data.cutoff_distance",
        "e": "data.energy",
        "x": "data.exposure",
        "d": "data.diffuse_factor",
        "s": "data.specular_factor",
        "h": "scene:eevee.light_threshold",
    }
    for name, path in (("c", "color"), ("t", "temperature_color")):
        paths |= {f"{name}{i}": f"data.{path}[{i}]" for i in range(3)}
    peak = "max(c0*t0,max(c1*t1,c2*t2))*abs(e)*pow(2,x)*max(d,s)"
    return f"1/max(1e-12,u*k*k+(1-u)*{peak}/max(1e-8,100*h))", paths


def drive(
    tree: bpy.types.ShaderNodeTree,
    socket: bpy.types.NodeSocket,
    source: bpy.types.ID,
    expression: str,
    paths: Mapping[str, str | tuple[bpy.types.ID, str]],
    index: int = -1,
) -> None:
    """Drive the value of an input by an expression over properties of `source`.

    Args:
        tree: The node tree that owns the driver.
        socket: An unlinked input; addressed by node and socket name, which survives reordering.
        source: Data from which the paths start. A path "scene:..." starts from the active scene.
        expression: Over the names of `paths`, in Blender's Python-free subset.
        paths: Property path of each name; or some other data, and a path that starts from it. A
            path "layer:..." starts from the view layer that is drawn, and counts as 0 where that
            layer has no such property.
        index: Component of a vector socket, -1 for a scalar.

    Raises:
        ValueError: The expression is none that Blender evaluates without Python.
    """
    node = bpy.utils.escape_identifier(socket.node.name)
    path = f'nodes["{node}"].inputs["{socket.name}"].default_value'
    curve = tree.driver_add(path, index) if index >= 0 else tree.driver_add(path)
    # A new driver comes with keyframes at (0, 0) and (1, 1), and Blender snaps its result to them
    # within 1e-4: a narrow cone or a weak light would vanish.
    for point in reversed(curve.keyframe_points):
        curve.keyframe_points.remove(point)
    for modifier in list(curve.modifiers):
        curve.modifiers.remove(modifier)
    driver = curve.driver
    driver.type = "SCRIPTED"
    for name, given in paths.items():
        owner, where = given if isinstance(given, tuple) else (source, given)
        variable = driver.variables.new()
        variable.name = name
        if where.startswith("scene:"):
            variable.type = "CONTEXT_PROP"
            variable.targets[0].context_property = "ACTIVE_SCENE"
            variable.targets[0].data_path = where.removeprefix("scene:")
        elif where.startswith("layer:"):
            variable.type = "CONTEXT_PROP"
            variable.targets[0].context_property = "ACTIVE_VIEW_LAYER"
            variable.targets[0].data_path = where.removeprefix("layer:")
            # If a collection was renamed since, the light shines until the next Update.
            variable.targets[0].use_fallback_value = True
        else:
            variable.targets[0].id_type = owner.id_type
            variable.targets[0].id = owner
            variable.targets[0].data_path = where
    driver.expression = expression
    if not driver.is_simple_expression:
        raise ValueError(f"this driver would need Python: {expression}")
