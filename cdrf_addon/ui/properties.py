# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties on materials and meshes. What renders lives in node sockets; these show it."""

from __future__ import annotations

import contextlib
import math

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from .. import ids
from ..blender.material import model as reflectance_models
from ..blender.material import specular as gloss
from ..blender.material.install import cdrf_node
from ..blender.material.shadow_choice import AUTO, SHADOW_ITEMS
from ..blender.shader.variant import stamped_variant
from ..core.curvature.creases import NO_CREASE
from ..core.curvature.estimators import DEFAULT_METHOD, DEFAULT_RADIUS
from ..core.curvature.summary import CONSTANT, FLAT, VARYING
from ..core.errors import CdrfError
from ..core.reflectance.model import MODEL_ITEMS, PROFILE, RING, SPHERE
from ..core.reflectance.profile import SKIN_PROFILE

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
    reflectance_models.change_variant(self.id_data, ratio=ratio)


def _get_model(self: CdrfMaterial) -> int:
    kinds = [item[0] for item in MODEL_ITEMS]
    return kinds.index(reflectance_models.kind_of_model(self.id_data))


def _set_model(self: CdrfMaterial, value: int) -> None:
    # A setter cannot report: what it cannot do it leaves. The operator cdrf.set_model says why.
    with contextlib.suppress(CdrfError):
        reflectance_models.set_kind(self.id_data, MODEL_ITEMS[value][0])


def _profile_changed(self: CdrfMaterial, _context: bpy.types.Context) -> None:
    if reflectance_models.kind_of_model(self.id_data) == PROFILE:
        with contextlib.suppress(CdrfError):
            reflectance_models.set_kind(self.id_data, PROFILE)


def _get_occlusion(self: CdrfMaterial) -> bool:
    node = cdrf_node(self.id_data)
    return stamped_variant(node.node_tree).occluded if node else self.chosen_occlusion


def _set_occlusion(self: CdrfMaterial, value: bool) -> None:
    self.chosen_occlusion = value
    with contextlib.suppress(CdrfError):
        reflectance_models.change_variant(self.id_data, occluded=value)


def _get_gloss(self: CdrfMaterial) -> bool:
    if cdrf_node(self.id_data) is None:
        return self.wants_gloss()
    return gloss.has_gloss(self.id_data)


def _set_gloss(self: CdrfMaterial, value: bool) -> None:
    self.chosen_gloss = int(value)
    if cdrf_node(self.id_data) is None or not self.id_data.is_editable:
        return
    if value:
        gloss.add_gloss(self.id_data)
    else:
        gloss.remove_gloss(self.id_data)


def _shadows_changed(self: CdrfMaterial, _context: bpy.types.Context) -> None:
    reflectance_models.refresh_shadows(self.id_data)


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
    model: EnumProperty(
        name="Model",
        description="How the light that spreads under the surface shades it",
        items=MODEL_ITEMS,
        get=_get_model,
        set=_set_model,
        options=set(),
    )
    profile: StringProperty(
        name="Profile",
        description=(
            "Gaussians of the diffusion profile, parted by semicolons. Each is four numbers: its "
            "width in any unit, then its part of red, green and blue"
        ),
        default=SKIN_PROFILE.to_text(),
        update=_profile_changed,
        options=set(),
    )
    profile_base: EnumProperty(
        name="Spread Along",
        description="What each Gaussian of the profile is spread along",
        items=[
            (SPHERE, "Sphere", "Keeps the energy"),
            (RING, "Ring", "As the paper does"),
        ],
        default=SPHERE,
        update=_profile_changed,
        options=set(),
    )
    gloss: BoolProperty(
        name="Gloss",
        description=(
            "Keep the specular half of the material's Principled BSDF (roughness, coat, sheen, "
            "emission) on top of the translucent surface"
        ),
        get=_get_gloss,
        set=_set_gloss,
        options=set(),
    )
    chosen_gloss: IntProperty(default=-1, options={"HIDDEN"})
    ambient_occlusion: BoolProperty(
        name="Ambient Occlusion",
        description=(
            "What is near takes away from the world's light: darker nostrils, ears and collars. "
            "Found in what is on screen, so it costs time per pixel. Lights are not affected"
        ),
        get=_get_occlusion,
        set=_set_occlusion,
        options=set(),
    )
    chosen_occlusion: BoolProperty(default=False, options={"HIDDEN"})

    def wants_gloss(self) -> bool:
        """What was chosen; without a choice, whether the material has gloss to keep."""
        return gloss.suits(self.id_data) if self.chosen_gloss < 0 else bool(self.chosen_gloss)

    shadows: EnumProperty(
        name="Shadows",
        description=(
            "Whether other objects, and distant parts of this one, cast shadows on the surface. "
            "Its own terminator stays soft. Shadows cost more than light does"
        ),
        items=SHADOW_ITEMS,
        default=AUTO,
        update=_shadows_changed,
        options=set(),
    )
    shadow_edges: BoolProperty(
        name="Coloured Edges",
        description=(
            "Soften the edges of shadows as far as each colour scatters. From Blender 5.1 on, for "
            "occluders that the camera sees; costs several times a shadow, and some samples"
        ),
        default=False,
        update=_shadows_changed,
        options=set(),
    )
    chosen_model: StringProperty(options={"HIDDEN"})
    measured: StringProperty(options={"HIDDEN"})
    # Blender deletes pictures that nobody uses; this one is wanted again.
    measured_image: PointerProperty(type=bpy.types.Image, options={"HIDDEN"})
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
