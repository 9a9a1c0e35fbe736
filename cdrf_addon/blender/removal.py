# SPDX-License-Identifier: GPL-3.0-or-later
"""The way back: materials become opaque again, and meshes lose what was measured of them."""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from .. import ids
from .display import viewport
from .display.curvature import hide, show_surface, shows_curvature
from .material import linking
from .material.install import remove, require_editable
from .material.shader_group import remove_unused
from .material.translucent import translucent_materials_of, translucent_materials_on
from .material.walk import keep_free_path
from .mesh.attributes import remove_curvature


def remove_translucency(
    context: bpy.types.Context, materials: Iterable[bpy.types.Material]
) -> None:
    """Restore materials, remove the curvature that no other material needs, and what is left over.

    Args:
        context: For the view layer and the window's 3D Views.
        materials: Translucent materials.

    Raises:
        SceneError: One is linked from another file; nothing has been changed.
    """
    chosen = set(materials)
    for material in chosen:
        require_editable(material)
    users = [obj for obj in bpy.data.objects if chosen & set(translucent_materials_on(obj))]
    for material in chosen:
        show_surface(material)
        keep_free_path(material)
        remove(material)
    _end_unused_display(context)
    for obj in users:
        if not translucent_materials_on(obj):
            _forget_object(obj)
    _forget_meshes({obj.data for obj in users})
    linking.write_unlit()
    remove_unused()


def _end_unused_display(context: bpy.types.Context) -> None:
    """Restore the view settings and the viewport if no material shows its curvature any more."""
    if not any(
        shows_curvature(material) for material in translucent_materials_of(context.view_layer)
    ):
        hide(())
        viewport.restore(context)


def _forget_object(obj: bpy.types.Object) -> None:
    """Remove what an object says of its size."""
    if obj.is_editable and ids.SCALE_KEY in obj:
        del obj[ids.SCALE_KEY]


def _forget_meshes(meshes: set[bpy.types.Mesh]) -> None:
    """Remove what was measured of meshes, of which no object is translucent any more."""
    needed = {obj.data for obj in bpy.data.objects if translucent_materials_on(obj)}
    for mesh in meshes - needed:
        if mesh.is_editable:
            remove_curvature(mesh)
            mesh.cdrf.fingerprint = ""
