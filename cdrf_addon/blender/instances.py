# SPDX-License-Identifier: GPL-3.0-or-later
"""What a view layer shows beyond its own objects."""

from __future__ import annotations

import bpy


def is_instance(obj: bpy.types.Object) -> bool:
    """Return whether an object is an empty that instances a collection."""
    return obj.instance_type == "COLLECTION" and obj.instance_collection is not None


def shown_objects(view_layer: bpy.types.ViewLayer) -> list[bpy.types.Object]:
    """List a view layer's objects and those that its instances of collections show."""
    found = dict.fromkeys(view_layer.objects)
    pending = list(found)
    while pending:
        obj = pending.pop()
        for part in obj.instance_collection.all_objects if is_instance(obj) else ():
            if part not in found:
                found[part] = None
                pending.append(part)
    return list(found)
