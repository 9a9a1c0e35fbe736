# SPDX-License-Identifier: GPL-3.0-or-later
"""All differences between Blender 4.5 LTS and 5.2 LTS; no other module reads the version."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy

EEVEE = "BLENDER_EEVEE" if bpy.app.version >= (5, 0, 0) else "BLENDER_EEVEE_NEXT"
"""Identifier of the EEVEE engine in `scene.render.engine`."""


HAS_RAYCAST = bpy.app.version >= (5, 1, 0)
"""Whether shader trees have the Raycast node, which coloured shadow edges need."""


INSTANCER_LINKS = bpy.app.version >= (5, 0, 0)
"""Whether an instance's lights follow the light linking of the instancing empty, not their own;
measured on 4.5 and 5.2."""


def set_still_format(settings: bpy.types.ImageFormatSettings, kind: str) -> None:
    """Make renders write single pictures; from 5.0 on a scene may be set to video or layers."""
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format = kind


@contextmanager
def still_png(scene: bpy.types.Scene) -> Iterator[None]:
    """Render a whole, plain, single 8-bit PNG with EEVEE inside the block; restore all after it.

    Formats depend on the media type, which is new in 5.0, so that comes first both ways.
    """
    settings = scene.render.image_settings
    wanted: list[tuple[Any, str, Any]] = [
        (scene.render, "engine", EEVEE),
        (scene.render, "use_multiview", False),
        (scene.render, "use_border", False),
        (scene.render, "use_compositing", False),
        (scene.render, "use_sequencer", False),
        (settings, "media_type", "IMAGE"),
        (settings, "file_format", "PNG"),
        (settings, "color_mode", "RGB"),
        (settings, "color_depth", "8"),
        (settings, "color_management", "FOLLOW_SCENE"),
    ]
    wanted = [(owner, name, value) for owner, name, value in wanted if hasattr(owner, name)]
    before = [(owner, name, getattr(owner, name)) for owner, name, _ in wanted]
    try:
        for owner, name, value in wanted:
            setattr(owner, name, value)
        yield
    finally:
        for owner, name, value in before:
            setattr(owner, name, value)


def ensure_node_tree(owner: bpy.types.Material | bpy.types.World) -> bpy.types.ShaderNodeTree:
    """Return the node tree of a material or world; 4.5 makes it only on request."""
    if owner.node_tree is None:
        owner.use_nodes = True
    return owner.node_tree


def animation_curves(tree: bpy.types.ID, path: str) -> list[bpy.types.FCurve]:
    """List the F-curves, keyframed or driven, that move a property of a node tree.

    Actions are layered from 4.4 on; 5.0 dropped the flat list of curves.
    """
    data = tree.animation_data
    if data is None:
        return []
    curves = list(data.drivers)
    if data.action is not None:
        for layer in data.action.layers:
            for strip in layer.strips:
                for bag in strip.channelbags:
                    curves += list(bag.fcurves)
    return [curve for curve in curves if curve.data_path == path]


def walk_method(method: str) -> str:
    """Return the name that the newest Blender has for a subsurface method.

    The former random walk is called legacy since another, with a longer reach, has its name.
    """
    node = bpy.types.ShaderNodeSubsurfaceScattering
    known = {each.identifier for each in node.bl_rna.properties["falloff"].enum_items}
    legacy = "RANDOM_WALK_LEGACY"
    return legacy if method == "RANDOM_WALK" and legacy not in known else method


def uses_nodes(material: bpy.types.Material | bpy.types.World) -> bool:
    """Return whether the renderer uses a material's or world's nodes; always so from 5.0 on."""
    if material.node_tree is None:
        return False
    return bpy.app.version >= (5, 0, 0) or material.use_nodes


def set_uses_nodes(material: bpy.types.Material, value: bool) -> None:
    """Switch a 4.5 material between its nodes and its plain viewport colour; 5.0 has no switch."""
    if bpy.app.version < (5, 0, 0) and material.use_nodes != value:
        material.use_nodes = value


def set_equirectangular(camera: bpy.types.Camera) -> None:
    """Make a camera equirectangular; before 5.0 the setting was Cycles' own."""
    camera.type = "PANO"
    owner = camera if hasattr(camera, "panorama_type") else camera.cycles
    owner.panorama_type = "EQUIRECTANGULAR"
