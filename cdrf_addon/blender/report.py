# SPDX-License-Identifier: GPL-3.0-or-later
"""What a job did, in numbers and in sentences for the artist, and what it cannot follow."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import bpy

from ..compat import EEVEE
from ..core.curvature.summary import FLAT
from .instances import is_instance
from .lights.drivers import MOST_FLAGS
from .lights.scene_lights import SceneLight, nested_instances
from .material.linking import lost_on_saving
from .mesh_work import MeshWork
from .world.surface import scene_world


@dataclass
class Report:
    """What a job did."""

    objects: int = 0
    materials: int = 0
    vertices: int = 0
    """Evaluated vertices at which curvature was computed."""
    computed: int = 0
    """Meshes whose curvature was computed."""
    seconds: float = 0.0
    """Time of that."""
    warnings: list[str] = field(default_factory=list)
    read: list[str] = field(default_factory=list)
    """Materials whose scatter distance was read from their own shader nodes."""

    def count(self, work: Sequence[MeshWork], materials: int) -> None:
        """Add up a job's meshes, with what was unusual about them."""
        self.objects = sum(len(each.users) for each in work)
        self.materials = materials
        for each in work:
            if each.summary is not None:
                self.computed += 1
                self.vertices += each.evaluated_vertices
                self.seconds += each.seconds
                self.warnings += [f"'{each.users[0].name}': {line}" for line in each.warnings]
            if each.kind == FLAT:
                self.warnings.append(
                    f"'{each.users[0].name}' is flat: it looks the same at any scatter distance."
                )

    def sentence(self) -> str:
        """Sum it up in one line."""
        parts = [f"{self.objects} object{'s' if self.objects != 1 else ''}"]
        parts.append(f"{self.materials} material{'s' if self.materials != 1 else ''}")
        if self.computed:
            parts.append(f"curvature at {self.vertices:,} vertices in {self.seconds:.2f} s")
        else:
            parts.append("curvature was up to date")
        if self.read:
            parts.append(f"scatter distance of {', '.join(self.read)} taken from its nodes")
        return ", ".join(parts)


def unsupported_lights(
    lights: Iterable[SceneLight],
    users: Iterable[bpy.types.Object],
    view_layer: bpy.types.ViewLayer,
    depsgraph: bpy.types.Depsgraph,
) -> list[str]:
    """Describe what of the scene's light the surface cannot follow, a sentence each.

    Args:
        lights: The scene's.
        users: The translucent objects of the job.
        view_layer: The one that is open.
        depsgraph: Of that view layer.
    """
    scene = view_layer.id_data
    return [
        *_nested_lights(view_layer),
        *_lights_instanced_otherwise(depsgraph),
        *_lights_in_many_collections(lights),
        *_unsaved_links(users),
        *_several_worlds(scene, view_layer),
    ]


def _nested_lights(view_layer: bpy.types.ViewLayer) -> list[str]:
    return [
        f"'{obj.name}' instances a collection that instances lights in its turn; these do not "
        "reach the surface: make it real (Object > Apply > Make Instances Real)."
        for obj in nested_instances(view_layer)
    ]


def _lights_instanced_otherwise(depsgraph: bpy.types.Depsgraph) -> list[str]:
    instancers = {
        instance.parent.original
        for instance in depsgraph.object_instances
        if instance.is_instance and instance.object.type == "LIGHT" and instance.parent
    }
    return [
        f"The lights that '{obj.name}' instances (by vertices, faces, particles or geometry "
        "nodes) do not reach the surface: make them real (Object > Apply > Make Instances Real)."
        for obj in instancers
        if not is_instance(obj)
    ]


def _lights_in_many_collections(lights: Iterable[SceneLight]) -> list[str]:
    return [
        f"'{light.name}' is in more than {MOST_FLAGS} collections, too many to follow which "
        "view layers exclude it: it shines in all of them."
        for light in lights
        if len(light.excluded) > MOST_FLAGS
    ]


def _unsaved_links(users: Iterable[bpy.types.Object]) -> list[str]:
    return [
        f"'{name}' is a library override, of which Blender does not save that it does not "
        "receive every light: give it a material of its own, or update after opening the file."
        for name in lost_on_saving(users)
    ]


def _several_worlds(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> list[str]:
    rendered = [layer for layer in scene.view_layers if layer.use]
    if len({scene_world(scene, layer) for layer in rendered}) <= 1:
        return []
    return [
        "The view layers have different worlds; the surface has the light of the one that was "
        f"open ('{view_layer.name}')."
    ]


def unseen_translucency(scene: bpy.types.Scene, *, is_lit: bool) -> list[str]:
    """Describe why the translucency is not to be seen, a sentence each."""
    found = []
    if not is_lit:
        found.append("The scene has no light that renders, so the surface is black.")
    if scene.render.engine not in {EEVEE, "BLENDER_WORKBENCH"}:
        found.append(
            "This scene renders with another engine: choose EEVEE in the Render properties to "
            "see the translucency."
        )
    return found
