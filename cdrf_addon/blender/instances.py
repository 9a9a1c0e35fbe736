# SPDX-License-Identifier: GPL-3.0-or-later
"""What a view layer shows beyond its own objects."""

from __future__ import annotations

import bpy


def shown_objects(view_layer: bpy.types.ViewLayer) -> list[bpy.types.Object]:
    """List a view layer's objects and those that its instances of collections show."""
    found = dict.fromkeys(view_layer.objects)
    pending = list(found)
    while pending:
        item = pending.pop()
        inside = item.instance_collection if item.instance_type == "COLLECTION" else None
        for part in inside.all_objects if inside is not None else ():
            if part not in found:
                found[part] = None
                pending.append(part)
    return list(found)
