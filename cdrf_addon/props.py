# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties on materials and meshes. What renders lives in node sockets; these show it."""

from __future__ import annotations

import math

import bpy
from bpy.props import (
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from . import ids
from .blender.materials import cdrf_node, install
from .blender.setup import scene_of_group
from .blender.shader import ensure_shader_group, stamped_variant, variant_of
from .core.estimators import DEFAULT_METHOD, DEFAULT_RADIUS
from .core.mesh import NO_CREASE
from .core.summary import CONSTANT, FLAT, VARYING

UNSET = -1.0
SIGMA0_MAX = 1e6
RATIO_MAX = 1e3


def _clean(value: float, high: float) -> float:
    return min(max(value, 0.0), high) if math.isfinite(value) else (high if value > 0.0 else 0.0)


def _get_sigma0(self: CdrfMaterial) -> float:
    node = cdrf_node(self.id_data)
    if node is not None:
        return float(node.inputs[ids.SIGMA0].default_value)
    return max(self.chosen_sigma0, 0.0)


def _set_sigma0(self: CdrfMaterial, value: float) -> None:
    self.chosen_sigma0 = _clean(value, SIGMA0_MAX)
    node = cdrf_node(self.id_data)
    if node is not None:
        node.inputs[ids.SIGMA0].default_value = self.chosen_sigma0


def _get_ratio(self: CdrfMaterial) -> tuple[float, ...]:
    node = cdrf_node(self.id_data)
    source = node.inputs[ids.SIGMA0_RATIO].default_value if node else self.chosen_ratio
    return tuple(source)


def _set_ratio(self: CdrfMaterial, value: tuple[float, ...]) -> None:
    ratio = tuple(_clean(factor, RATIO_MAX) for factor in value)
    self.chosen_ratio = ratio
    node = cdrf_node(self.id_data)
    if node is None:
        return
    node.inputs[ids.SIGMA0_RATIO].default_value = ratio
    # As many look-ups as there are different sigma0, no more.
    variant = stamped_variant(node.node_tree)
    wanted = variant_of(ratio, variant.source)
    where = scene_of_group(node.node_tree)
    if wanted != variant and where is not None:
        install(self.id_data, ensure_shader_group(wanted, *where))


class CdrfMaterial(bpy.types.PropertyGroup):
    """`material.cdrf`: the translucency of a material."""

    sigma0: FloatProperty(
        name="Scatter Distance",
        description=(
            "How far light travels under the surface (sigma0 of Kubo et al. 2011), in world units. "
            "0 is an opaque surface. To animate it, keyframe the Sigma0 input of the CDRF node"
        ),
        subtype="DISTANCE",
        min=0.0,
        max=SIGMA0_MAX,
        soft_max=1.0,
        step=0.1,
        precision=4,
        get=_get_sigma0,
        set=_set_sigma0,
        options=set(),
    )
    sigma0_ratio: FloatVectorProperty(
        name="Colour Ratio",
        description=(
            "Scatter distance of red, green and blue as factors of the slider. Skin scatters red "
            "furthest: 1, 0.35, 0.2. Equal factors need one table look-up per light, not three"
        ),
        size=3,
        default=(1.0, 1.0, 1.0),
        min=0.0,
        max=RATIO_MAX,
        soft_max=1.0,
        step=1,
        precision=3,
        get=_get_ratio,
        set=_set_ratio,
        options=set(),
    )
    chosen_sigma0: FloatProperty(default=UNSET, options={"HIDDEN"})
    chosen_ratio: FloatVectorProperty(size=3, default=(1.0, 1.0, 1.0), options={"HIDDEN"})


class CdrfMesh(bpy.types.PropertyGroup):
    """`mesh.cdrf`: what is known of a mesh's curvature, so that it is not computed again."""

    fingerprint: StringProperty(options={"HIDDEN"})
    base_fingerprint: StringProperty(options={"HIDDEN"})
    kind: EnumProperty(
        name="Curvature",
        items=[
            (VARYING, "Varying", "Stored at each vertex"),
            (CONSTANT, "Constant", "The same everywhere: one number serves the whole mesh"),
            (FLAT, "Flat", "Nothing bends, so nothing is translucent"),
        ],
        options={"HIDDEN"},
    )
    low: FloatProperty(options={"HIDDEN"})
    median: FloatProperty(options={"HIDDEN"})
    high: FloatProperty(options={"HIDDEN"})
    mean_high: FloatProperty(options={"HIDDEN"})
    mean_values: FloatVectorProperty(size=4, options={"HIDDEN"})
    metric: FloatVectorProperty(size=9, options={"HIDDEN"})
    method: StringProperty(default=DEFAULT_METHOD, options={"HIDDEN"})
    radius: IntProperty(default=DEFAULT_RADIUS, options={"HIDDEN"})
    crease_angle: FloatProperty(default=NO_CREASE, options={"HIDDEN"})
    vertices: IntProperty(options={"HIDDEN"})
    evaluated_vertices: IntProperty(options={"HIDDEN"})
    seconds: FloatProperty(options={"HIDDEN"})
    warnings: StringProperty(options={"HIDDEN"})


CLASSES = (CdrfMaterial, CdrfMesh)


def register() -> None:
    """Register the property groups and hang them on Material and Mesh."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Material.cdrf = PointerProperty(type=CdrfMaterial)
    bpy.types.Mesh.cdrf = PointerProperty(type=CdrfMesh)


def unregister() -> None:
    """Undo `register`."""
    del bpy.types.Mesh.cdrf
    del bpy.types.Material.cdrf
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
