# SPDX-License-Identifier: GPL-3.0-or-later
"""The lights of a scene and the drivers that carry them into the node group.

Every driver is a *simple expression* over properties: Blender evaluates those without Python, so
they work with Auto-Run off, in background renders and without the extension. Everything is read
through the light's object, so that a light moved, parented, animated, relinked or switched off is
followed without a click.

A path into a matrix names the column first: matrix_world[2][0] is the x of the lamp's Z axis.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import bpy

from ... import ids
from ...compat import INSTANCER_LINKS
from ..instances import is_instance

Paths = dict[str, str | tuple[bpy.types.ID, str]]
"""What each name of a driver's expression stands for; see `drive`."""

AXES = {ids.AXIS_X: 0, ids.AXIS_Y: 1, ids.AXIS_Z: 2, ids.POSITION: 3}

# Constants between Blender's power and the radiance of a white Lambert surface facing the light
# (decision 003): sun E / pi, point and spot P / (4 pi^2 d^2), area P / pi^2.
CONSTANTS = {
    "SUN": 1.0 / math.pi,
    "POINT": 1.0 / (4.0 * math.pi**2),
    "SPOT": 1.0 / (4.0 * math.pi**2),
    "AREA": 1.0 / math.pi**2,
}
ONE_SIZE = {"SQUARE", "DISK"}
# A sun of this angle blurs the terminator by 0.8 degrees.
HARD_SUN = math.radians(3.0)


# Blender cuts a driver's expression at 256 characters.
MOST_FLAGS = 30


@dataclass(frozen=True)
class SceneLight:
    """A light that can reach the camera's picture of a scene."""

    object: bpy.types.Object
    kind: str
    """Type of the light, and shape of an area light: "SUN", "AREA ELLIPSE"."""
    soft: bool = True
    """Whether it is, or may become, so large that its size blurs the terminator visibly."""
    casts: bool = True
    """Whether it casts shadows, or may come to by animation."""
    excluded: tuple[str, ...] = ()
    """Where some view layers leave it out: paths, from a view layer, of the Exclude flags of its
    collections. It is dark where all are set."""
    instance: bpy.types.Object | None = None
    """The empty that instances the light's collection; None for a light of the scene itself."""
    selective: bool = False
    """Whether some objects of a material receive it and others do not (linking.py)."""

    @property
    def source(self) -> tuple[bpy.types.Object, bpy.types.Object | None]:
        """What tells it from other lights: the lamp, and the empty that instances it if any."""
        return self.object, self.instance

    @property
    def name(self) -> str:
        """What to call it in the panel."""
        where = f" in {self.instance.name}" if self.instance is not None else ""
        return f"{self.object.name}{where}"

    @property
    def linker(self) -> bpy.types.Object:
        """The object whose light linking counts for it."""
        return self.instance if self.instance is not None and INSTANCER_LINKS else self.object

    @property
    def receivers(self) -> bpy.types.Collection | None:
        """Collection that says which objects receive it; None if all do."""
        linking = self.linker.light_linking
        return linking.receiver_collection if linking is not None else None

    @property
    def picks_blockers(self) -> bool:
        """Whether only some objects cast its shadows."""
        linking = self.linker.light_linking
        return linking is not None and linking.blocker_collection is not None

    @property
    def type(self) -> str:
        """SUN, POINT, SPOT or AREA."""
        return self.kind.split()[0]


def kind_of(light: bpy.types.Light) -> str:
    """Describe what decides a light's node branch; see `SceneLight.kind`."""
    return f"AREA {light.shape}" if light.type == "AREA" else light.type


def is_soft(item: bpy.types.Object) -> bool:
    """Tell whether a light has a size that counts, or one that is animated."""
    light = item.data
    if light.type == "AREA" or light.animation_data is not None:
        return True
    if light.type == "SUN":
        return bool(light.angle > HARD_SUN)
    return bool(light.shadow_soft_size > 0.0)


def is_black(item: bpy.types.Object) -> bool:
    """Tell whether a light sends nothing to diffuse surfaces, and no animation will change that.

    Should somebody turn it up by hand, the panel offers Update.
    """
    light = item.data
    if light.animation_data is not None or item.animation_data is not None:
        return False
    dark = light.energy == 0.0 or light.diffuse_factor == 0.0 or not item.visible_diffuse
    return bool(dark or max(light.color) <= 0.0)


def casts_shadow(light: bpy.types.Light) -> bool:
    """Tell whether a light casts shadows, or may come to by animation."""
    return bool(light.use_shadow) or light.animation_data is not None


def scene_lights(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> list[SceneLight]:
    """List the lights that a render of this view layer would use, by name.

    A light that is switched off for renders is left out, unless its visibility is animated, and
    so is one that is black and cannot change by itself. A light in a collection that an empty
    instances is one for each such empty.
    """
    found = []
    for item in _rendered(view_layer):
        if item.type == "LIGHT" and not is_black(item):
            found.append(_scene_light(item))
        elif is_instance(item):
            inside = _rendered_in(item.instance_collection)
            found += [
                _scene_light(lamp, item)
                for lamp in inside
                if lamp.type == "LIGHT" and not is_black(lamp)
            ]
    return sorted(found, key=lambda light: light.name)


def nested_instances(view_layer: bpy.types.ViewLayer) -> list[bpy.types.Object]:
    """List the empties whose lights are inside an instance in their instance: too deep for us."""
    return [
        item
        for item in _rendered(view_layer)
        if is_instance(item)
        and any(
            lamp.type == "LIGHT"
            for part in _rendered_in(item.instance_collection)
            if is_instance(part)
            for lamp in part.instance_collection.all_objects
        )
    ]


def _scene_light(lamp: bpy.types.Object, instance: bpy.types.Object | None = None) -> SceneLight:
    light = lamp.data
    return SceneLight(lamp, kind_of(light), is_soft(lamp), casts_shadow(light), instance=instance)


def _rendered(view_layer: bpy.types.ViewLayer) -> list[bpy.types.Object]:
    shown = _render_visible(view_layer.layer_collection)
    return [item for item in view_layer.objects if item.name in shown and _renders(item)]


def _rendered_in(collection: bpy.types.Collection) -> list[bpy.types.Object]:
    """List the objects that an instance of a collection shows, each once."""
    if collection.hide_render:
        return []
    found = [item for item in collection.objects if _renders(item)]
    for child in collection.children:
        found += _rendered_in(child)
    return list(dict.fromkeys(found))


def _renders(item: bpy.types.Object) -> bool:
    return not item.hide_render or _animates(item, "hide_render")


def _render_visible(layer: bpy.types.LayerCollection) -> set[str]:
    if layer.collection.hide_render:
        return set()
    # A collection inside an excluded one may be shown by itself.
    names = set() if layer.exclude else {item.name for item in layer.collection.objects}
    for child in layer.children:
        names |= _render_visible(child)
    return names


def _animates(item: bpy.types.Object, path: str) -> bool:
    data = item.animation_data
    if data is None:
        return False
    if any(driver.data_path == path for driver in data.drivers):
        return True
    # An action's curves lie elsewhere in every version; that it has one is reason enough.
    return data.action is not None or len(data.nla_tracks) > 0


def drive_light(
    tree: bpy.types.ShaderNodeTree, node: bpy.types.ShaderNode, light: SceneLight
) -> None:
    """Drive the inputs of a light group's instance from the light's object."""
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
    """A number of the matrix that places the light in the world.

    In an instance that is the empty's matrix times the lamp's, its position taken from the point
    of the collection that stands in the empty.
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
    # Without Normalize, power is per area; an area light's group sees to its own.
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
    """EEVEE's cut-off: the custom distance, or where the light falls below the threshold."""
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
    """Drive a socket's default by an expression over properties of `source`.

    Args:
        tree: The node tree that owns the driver.
        socket: An unlinked input; addressed by node and socket name, which survives reordering.
        source: Data the paths start from. A path "scene:..." starts from the active scene.
        expression: Over the names of `paths`, in Blender's Python-free subset.
        paths: Property path of each name; or some other data, and a path that starts from it. A
            path "layer:..." starts from the view layer that is drawn, and counts as 0 where that
            layer has no such property.
        index: Component of a vector socket, -1 for a scalar.
    """
    node = bpy.utils.escape_identifier(socket.node.name)
    path = f'nodes["{node}"].inputs["{socket.name}"].default_value'
    curve = tree.driver_add(path, index) if index >= 0 else tree.driver_add(path)
    # A new driver comes with keyframes at (0, 0) and (1, 1), and Blender snaps what it computes to
    # them within 1e-4: a narrow cone or a weak light would vanish.
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
            # A collection that was renamed since: the light shines until the next Update.
            variable.targets[0].use_fallback_value = True
        else:
            variable.targets[0].id_type = owner.id_type
            variable.targets[0].id = owner
            variable.targets[0].data_path = where
    driver.expression = expression
    if not driver.is_simple_expression:
        raise ValueError(f"this driver would need Python: {expression}")
