# SPDX-License-Identifier: GPL-3.0-or-later
"""What a view layer shows beyond its own objects."""

from __future__ import annotations

import bpy


def is_instance(item: bpy.types.Object) -> bool:
    """Tell whether an object is an empty that instances a collection."""
    return item.instance_type == "COLLECTION" and item.instance_collection is not None


def shown_objects(view_layer: bpy.types.ViewLayer) -> list[bpy.types.Object]:
    """List a view layer's objects and those that its instances of collections show."""
    found = dict.fromkeys(view_layer.objects)
    pending = list(found)
    while pending:
        item = pending.pop()
        for part in item.instance_collection.all_objects if is_instance(item) else ():
            if part not in found:
                found[part] = None
                pending.append(part)
    return list(found)
