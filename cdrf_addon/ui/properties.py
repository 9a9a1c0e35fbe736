# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties on materials and meshes.

What renders is in the node of a material; `blender/material/settings.py` reads and writes it.
"""

from __future__ import annotations

import contextlib

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

from ..blender.material import settings
from ..blender.material.model import kind_of_model, set_kind
from ..blender.material.shader_group import refresh_shadows
from ..blender.material.shadow_choice import AUTO, SHADOW_ITEMS
from ..core.curvature.creases import NO_CREASE
from ..core.curvature.estimators import DEFAULT_METHOD, DEFAULT_RADIUS
from ..core.curvature.summary import CONSTANT, FLAT, VARYING
from ..core.errors import CdrfError
from ..core.reflectance.model import MODEL_ITEMS, PROFILE, RING, SPHERE
from ..core.reflectance.profile import SKIN_PROFILE


def _get_sigma0(self: CdrfMaterial) -> float:
    return settings.sigma0(self.id_data)


def _set_sigma0(self: CdrfMaterial, value: float) -> None:
    settings.set_sigma0(self.id_data, value)


def _get_ratio(self: CdrfMaterial) -> tuple[float, ...]:
    return settings.sigma0_ratio(self.id_data)


def _set_ratio(self: CdrfMaterial, value: tuple[float, ...]) -> None:
    settings.set_sigma0_ratio(self.id_data, value)


def _get_model(self: CdrfMaterial) -> int:
    kinds = [kind for kind, *_ in MODEL_ITEMS]
    return kinds.index(kind_of_model(self.id_data))


def _set_model(self: CdrfMaterial, value: int) -> None:
    # A setter cannot report: what it cannot do it leaves. The operator cdrf.set_model says why.
    with contextlib.suppress(CdrfError):
        set_kind(self.id_data, MODEL_ITEMS[value][0])


def _profile_changed(self: CdrfMaterial, _context: bpy.types.Context) -> None:
    if kind_of_model(self.id_data) == PROFILE:
        with contextlib.suppress(CdrfError):
            set_kind(self.id_data, PROFILE)


def _get_view(self: CdrfMaterial) -> bool:
    return settings.is_view_dependent(self.id_data)


def _set_view(self: CdrfMaterial, value: bool) -> None:
    with contextlib.suppress(CdrfError):
        settings.set_view_dependent(self.id_data, value)


def _get_occlusion(self: CdrfMaterial) -> bool:
    return settings.is_occluded(self.id_data)


def _set_occlusion(self: CdrfMaterial, value: bool) -> None:
    with contextlib.suppress(CdrfError):
        settings.set_occluded(self.id_data, value)


def _get_specular(self: CdrfMaterial) -> bool:
    return settings.is_specular(self.id_data)


def _set_specular(self: CdrfMaterial, value: bool) -> None:
    settings.set_specular(self.id_data, value)


def _shadows_changed(self: CdrfMaterial, _context: bpy.types.Context) -> None:
    refresh_shadows(self.id_data)


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
        max=settings.SIGMA0_MAX,
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
        max=settings.RATIO_MAX,
        soft_max=1.0,
        step=1,
        precision=3,
        get=_get_ratio,
        set=_set_ratio,
        options=set(),
    )
    model: EnumProperty(
        name="Model",
        description="How light that spreads under the surface shades it",
        items=MODEL_ITEMS,
        get=_get_model,
        set=_set_model,
        options=set(),
    )
    profile: StringProperty(
        name="Profile",
        description=(
            "Gaussians of the diffusion profile, separated by semicolons. Each is four numbers: "
            "its width in any unit, then its part of red, green and blue"
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
        get=_get_specular,
        set=_set_specular,
        options=set(),
    )
    view_dependence: BoolProperty(
        name="View Dependence",
        description=(
            "Brighter at the rim and where the surface bulges, darker in hollows, as Cycles shows "
            "it. Off, the surface looks the same from every side. A Principled BSDF with "
            "Christensen-Burley starts without it; on, it looks as with Random Walk"
        ),
        get=_get_view,
        set=_set_view,
        options=set(),
    )
    ambient_occlusion: BoolProperty(
        name="Ambient Occlusion",
        description=(
            "Nearby surfaces block the world's light: darker nostrils, ears and collars. Only "
            "what is on screen counts, and it costs time per pixel. Lights are not affected"
        ),
        get=_get_occlusion,
        set=_set_occlusion,
        options=set(),
    )
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
    # What was chosen, for as long as the material is not translucent.
    chosen_model: StringProperty(options={"HIDDEN"})
    chosen_sigma0: FloatProperty(default=settings.UNSET, options={"HIDDEN"})
    chosen_ratio: FloatVectorProperty(size=3, default=(1.0, 1.0, 1.0), options={"HIDDEN"})
    chosen_gloss: IntProperty(default=-1, options={"HIDDEN"})
    chosen_view: IntProperty(default=-1, options={"HIDDEN"})
    chosen_walk: StringProperty(options={"HIDDEN"})
    chosen_free_path: FloatVectorProperty(size=3, default=(0.0, 0.0, 0.0), options={"HIDDEN"})
    chosen_occlusion: BoolProperty(default=False, options={"HIDDEN"})
    measured: StringProperty(options={"HIDDEN"})
    # Blender deletes pictures that nobody uses; this one is needed again.
    measured_image: PointerProperty(type=bpy.types.Image, options={"HIDDEN"})


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
    """Register the property groups and attach them to Material and Mesh."""
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
