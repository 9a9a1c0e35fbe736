# SPDX-License-Identifier: GPL-3.0-or-later
"""Which lights a render of a view layer uses, and what of each decides its wiring.

Reads the scene; `drivers.py` makes the wired nodes follow the lights.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy

from ...compat import INSTANCER_LINKS
from ..instances import is_instance

HARD_SUN = math.radians(3.0)
"""Angle of a sun that blurs the terminator by 0.8 degrees, which is hardly visible."""


@dataclass(frozen=True)
class SceneLight:
    """A light that a render of a scene may use."""

    object: bpy.types.Object
    kind: str
    """Type of the light, and shape of an area light: "SUN", "AREA ELLIPSE"."""
    soft: bool = True
    """Whether its size, now or by animation, blurs the terminator visibly."""
    casts: bool = True
    """Whether it casts shadows, now or by animation."""
    excluded: tuple[str, ...] = ()
    """Paths, from a view layer, of the Exclude flags of the collections that show it: where all are
    set it is dark. Empty if no view layer leaves it out."""
    instance: bpy.types.Object | None = None
    """The empty that instances the light's collection; None for a light of the scene itself."""
    selective: bool = False
    """Whether some objects of a material receive it and others do not (material/linking.py)."""

    @property
    def source(self) -> tuple[bpy.types.Object, bpy.types.Object | None]:
        """What identifies it: the lamp, and the empty that instances it if there is one."""
        return self.object, self.instance

    @property
    def name(self) -> str:
        """Its name in the panel."""
        where = f" in {self.instance.name}" if self.instance is not None else ""
        return f"{self.object.name}{where}"

    @property
    def linker(self) -> bpy.types.Object:
        """The object whose light linking applies to it."""
        return self.instance if self.instance is not None and INSTANCER_LINKS else self.object

    @property
    def receivers(self) -> bpy.types.Collection | None:
        """Collection that decides which objects receive it; None if all do."""
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
    """Return what decides the wiring of a light; see `SceneLight.kind`."""
    return f"AREA {light.shape}" if light.type == "AREA" else light.type


def is_soft(lamp: bpy.types.Object) -> bool:
    """Return whether a light's size blurs the terminator visibly, or is animated."""
    light = lamp.data
    if light.type == "AREA" or light.animation_data is not None:
        return True
    if light.type == "SUN":
        return bool(light.angle > HARD_SUN)
    return bool(light.shadow_soft_size > 0.0)


def is_black(lamp: bpy.types.Object) -> bool:
    """Return whether a light sends nothing to diffuse surfaces and no animation changes that.

    Once the artist turns it up, the panel offers Update.
    """
    light = lamp.data
    if light.animation_data is not None or lamp.animation_data is not None:
        return False
    dark = light.energy == 0.0 or light.diffuse_factor == 0.0 or not lamp.visible_diffuse
    return bool(dark or max(light.color) <= 0.0)


def casts_shadow(light: bpy.types.Light) -> bool:
    """Return whether a light casts shadows, now or by animation."""
    return bool(light.use_shadow) or light.animation_data is not None


def scene_lights(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> list[SceneLight]:
    """List the lights that a render of this view layer uses, sorted by name.

    Left out are lights that are switched off for renders, unless their visibility is animated, and
    black ones that no animation changes. A light in an instanced collection is listed once for each
    empty that instances it.
    """
    found = []
    for obj in _rendered(view_layer):
        if obj.type == "LIGHT" and not is_black(obj):
            found.append(_scene_light(obj))
        elif is_instance(obj):
            inside = _rendered_in(obj.instance_collection)
            found += [
                _scene_light(lamp, obj)
                for lamp in inside
                if lamp.type == "LIGHT" and not is_black(lamp)
            ]
    return sorted(found, key=lambda light: light.name)


def nested_instances(view_layer: bpy.types.ViewLayer) -> list[bpy.types.Object]:
    """List the empties whose instance holds an instance with lights, which are not supported."""
    return [
        obj
        for obj in _rendered(view_layer)
        if is_instance(obj)
        and any(
            lamp.type == "LIGHT"
            for part in _rendered_in(obj.instance_collection)
            if is_instance(part)
            for lamp in part.instance_collection.all_objects
        )
    ]


def _scene_light(lamp: bpy.types.Object, instance: bpy.types.Object | None = None) -> SceneLight:
    light = lamp.data
    return SceneLight(lamp, kind_of(light), is_soft(lamp), casts_shadow(light), instance=instance)


def _rendered(view_layer: bpy.types.ViewLayer) -> list[bpy.types.Object]:
    shown = _render_visible(view_layer.layer_collection)
    return [obj for obj in view_layer.objects if obj.name in shown and _renders(obj)]


def _rendered_in(collection: bpy.types.Collection) -> list[bpy.types.Object]:
    """List the objects that an instance of a collection shows in a render, each once."""
    if collection.hide_render:
        return []
    found = [obj for obj in collection.objects if _renders(obj)]
    for child in collection.children:
        found += _rendered_in(child)
    return list(dict.fromkeys(found))


def _renders(obj: bpy.types.Object) -> bool:
    return not obj.hide_render or _may_animate(obj, "hide_render")


def _render_visible(layer: bpy.types.LayerCollection) -> set[str]:
    """Return the names of the objects in collections that a render shows."""
    if layer.collection.hide_render:
        return set()
    # A collection inside an excluded one may be shown nevertheless.
    names = set() if layer.exclude else {obj.name for obj in layer.collection.objects}
    for child in layer.children:
        names |= _render_visible(child)
    return names


def _may_animate(obj: bpy.types.Object, path: str) -> bool:
    """Return whether animation may change a property of an object."""
    data = obj.animation_data
    if data is None:
        return False
    if any(driver.data_path == path for driver in data.drivers):
        return True
    # Where an action keeps its curves depends on Blender's version; having one is enough here.
    return data.action is not None or len(data.nla_tracks) > 0
