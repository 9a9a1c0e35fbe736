# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist may choose: Lambert, CDRF in its variants, EEVEE's scattering, textures, Cycles.

A contender is made ready on a stage, which is its preparation, and then renders any number of
samples. The extension is used through its operators and properties alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from functools import partial
from typing import Any

import bpy
import numpy as np
from pixels import pixels_of

from cdrf_addon import ids
from cdrf_addon.core.curvature.summary import CONSTANT
from cdrf_addon.core.reflectance.environment import lit_by, project, reduce_picture

from ..common.arrays import Array
from . import texture_blurring
from .lights import directions
from .settings import SEED
from .stage import Stage
from .substances import profile_of

Render = Callable[[int], Array]

EEVEE, CYCLES, NUMPY = "EEVEE", "Cycles", "NumPy"
OWN_SEED = SEED + 1000
"""Of Cycles as a contender: noise must not agree with the reference's."""
LEVELS = 4


@dataclass(frozen=True)
class Contender:
    """One way to render.

    Attributes:
        name: For tables; `family` groups the variants of one technique in plots.
        family: The technique.
        engine: EEVEE, CYCLES or NUMPY.
        ready: Prepares a stage and yields what renders so many samples; cleans up after.
        samples: At which it is measured.
        missing: Says why it cannot be measured on a stage, or "".
    """

    name: str
    family: str
    engine: str
    ready: Callable[[Stage], Any]
    samples: tuple[int, ...] = ()
    missing: Callable[[Stage], str] = lambda _: ""


# --- Blender's own -------------------------------------------------------------------------------


@contextmanager
def _plain(stage: Stage, material: str) -> Iterator[Render]:
    stage.assign(getattr(stage, material))
    yield stage.eevee


@contextmanager
def _unshadowed(stage: Stage) -> Iterator[Render]:
    with stage.without_shadows(), _plain(stage, "opaque") as render:
        yield render


@contextmanager
def _without_cdrf(stage: Stage) -> Iterator[None]:
    """Take CDRF off the scattering material meanwhile, so that EEVEE shows the node itself."""
    stage.assign(stage.scattering)
    if bpy.ops.cdrf.remove.poll():
        bpy.ops.cdrf.remove()
    yield


@contextmanager
def _node(stage: Stage) -> Iterator[Render]:
    with _without_cdrf(stage):
        yield stage.eevee


@contextmanager
def _cycles(stage: Stage, *, denoise: bool = False) -> Iterator[Render]:
    with _without_cdrf(stage):
        yield lambda samples: stage.cycles(samples, OWN_SEED, denoise=denoise)


# --- CDRF ----------------------------------------------------------------------------------------


@contextmanager
def cdrf(
    stage: Stage,
    model: str = "SPHERE",
    *,
    view: bool = False,
    shadows: bool = False,
    edges: bool = False,
    raw: bool = False,
    occlusion: bool = False,
) -> Iterator[Render]:
    """Make the stage translucent.

    Args:
        stage: In any state.
        model: RING, SPHERE, PROFILE or MEASURED.
        view: View Dependence, which a material that is read from its node has by default.
        shadows: Cast shadows.
        edges: Coloured ones.
        raw: Curvature as it is measured at each vertex, not at the length light diffuses over.
        occlusion: Ambient occlusion of the world's light.
    """
    stage.assign(stage.scattering)
    settings = stage.scattering.cdrf
    settings.shadow_edges, settings.ambient_occlusion = edges, occlusion
    settings.shadows = "ON" if shadows else "OFF"
    assert bpy.ops.cdrf.setup() == {"FINISHED"}
    assert bpy.ops.cdrf.read_shader() == {"FINISHED"}  # the sphere model, sigma0 of the node
    if model == "PROFILE":
        shape = profile_of(stage.substance.name)
        settings.profile, settings.profile_base = shape.to_text(), "SPHERE"
        assert bpy.ops.cdrf.set_model(model=model) == {"FINISHED"}
        settings.sigma0 = float(shape.rms_widths.max()) / stage.millimetres
        settings.sigma0_ratio = (1.0, 1.0, 1.0)
    elif model == "MEASURED":
        assert bpy.ops.cdrf.measure(quality=stage.settings.quality) == {"FINISHED"}
    else:
        assert bpy.ops.cdrf.set_model(model=model) == {"FINISHED"}
    settings.view_dependence = view
    assert settings.view_dependence == view
    bpy.context.view_layer.update()
    with (
        nullcontext() if shadows else stage.without_shadows(),
        _raw_curvature(stage.obj.data) if raw else nullcontext(),
    ):
        yield stage.eevee


@contextmanager
def _raw_curvature(mesh: bpy.types.Mesh) -> Iterator[None]:
    """Put the curvature of each vertex in the place of that at every diffusion length."""
    diffused = mesh.attributes[ids.DIFFUSED_ATTRIBUTE].data
    kept = np.empty(4 * len(diffused), dtype=np.float32)
    diffused.foreach_get("color", kept)
    plain = np.empty_like(kept)
    mesh.attributes[ids.CURVATURE_ATTRIBUTE].data.foreach_get("color", plain)
    diffused.foreach_set("color", np.repeat(plain.reshape(-1, 4)[:, 0], LEVELS))
    mesh.update_tag()
    try:
        yield
    finally:
        mesh.attributes[ids.DIFFUSED_ATTRIBUTE].data.foreach_set("color", kept)
        mesh.update_tag()


# --- texture blurring ----------------------------------------------------------------------------


def lighting(stage: Stage) -> texture_blurring.Lighting:
    """Radiance of a white surface under the stage's lights: shadows by rays, lamps as points."""
    lamps = stage.lights
    world = _world_light(stage) if not lamps else None

    def arriving(places: Array, normals: Array) -> Array:
        if world is not None:
            return world(normals)
        total = np.zeros((len(places), 3))
        for lamp in lamps:
            towards = directions(lamp, places)
            cosine = np.maximum((normals * towards).sum(axis=1), 0.0)
            faces = np.flatnonzero(cosine > 0.0)
            seen = np.zeros(len(places))
            seen[faces] = stage.geometry.visible(places[faces], normals[faces], lamp)
            total += (strength(lamp, places, towards) * cosine * seen)[:, None]
        return total

    return arriving


def strength(lamp: bpy.types.Object, places: Array, towards: Array) -> Array:
    """Radiance of a white surface that faces a white lamp (decision 3), (n,)."""
    energy = float(lamp.data.energy)
    if lamp.data.type == "SUN":
        return np.full(len(places), energy / np.pi)
    squared = ((np.array(lamp.location) - places) ** 2).sum(axis=1)
    axis = np.array(lamp.matrix_world)[:3, 2]
    return np.asarray(energy / np.pi**2 * np.maximum(towards @ axis, 0.0) / squared)


def _world_light(stage: Stage) -> Callable[[Array], Array]:
    """Light of the world's picture in nine harmonics."""
    nodes = stage.scene.world.node_tree.nodes
    factor = float(nodes["Background"].inputs["Strength"].default_value)
    picture = next(node.image for node in nodes if node.type == "TEX_ENVIRONMENT")
    small = reduce_picture(pixels_of(picture)[..., :3].astype(np.float32), 64, 128)
    harmonics = factor * project(small).harmonics

    def arriving(normals: Array) -> Array:
        # Blender's pictures have +X in their middle, those of core/reflectance/environment.py +Y.
        x, y, z = normals.T
        return lit_by(harmonics, np.stack((-y, x, z), axis=1), np.ones((3, 3)))

    return arriving


@contextmanager
def _texture(stage: Stage) -> Iterator[Render]:
    geometry, arriving = stage.geometry, lighting(stage)

    def render(_samples: int) -> Array:
        colours, _ = texture_blurring.shade(
            geometry,
            arriving,
            np.array(stage.substance.albedo),
            profile_of(stage.substance.name),
            stage.millimetres,
            stage.settings.atlas,
        )
        picture = np.zeros((stage.size**2, 4))
        picture[geometry.hits.pixel] = np.column_stack((colours, np.ones(len(colours))))
        return picture.reshape(stage.size, stage.size, 4)

    yield render


# --- who is there --------------------------------------------------------------------------------


def _no_lamps(stage: Stage) -> str:
    return "" if stage.lights else "no lamp casts a shadow here"


def _lamps(stage: Stage) -> str:
    return "no world light to occlude" if stage.lights else ""


def _one_lamp(stage: Stage) -> str:
    if not stage.lights:
        return _no_lamps(stage)
    return "" if len(stage.lights) == 1 else "compiles for minutes on a software rasteriser"


def _varying(stage: Stage) -> str:
    if stage.obj.data.cdrf.kind == CONSTANT or stage.cell.shape == "sphere":
        return "its curvature is the same everywhere"
    return ""


def _unwrapped(stage: Stage) -> str:
    return "" if stage.obj.data.uv_layers else "it has no UV map"


LAMBERT = "Lambert (Diffuse BSDF)"
PAPER = "CDRF ring, raw curvature (the paper)"
SPHERE = "CDRF sphere"
SHADOWS = "CDRF sphere, shadows"
LOOK = "CDRF path-traced look"
DEFAULT = "CDRF path-traced look, shadows"
"""What Make Translucent gives a scattering material."""
NODE = "EEVEE Subsurface Scattering"
PRINCIPLED = "EEVEE Principled, subsurface"
TEXTURE = "Texture blurring"
PATHS = "Cycles Random Walk"

CONTENDERS = [
    Contender(LAMBERT, "Lambert", EEVEE, partial(_plain, material="opaque")),
    Contender("Lambert, no shadows", "Lambert", EEVEE, _unshadowed, missing=_no_lamps),
    Contender(PAPER, "CDRF ring", EEVEE, partial(cdrf, model="RING", raw=True), missing=_varying),
    Contender("CDRF ring", "CDRF ring", EEVEE, partial(cdrf, model="RING")),
    Contender("CDRF sphere, raw curvature", "CDRF sphere", EEVEE, partial(cdrf, raw=True),
              missing=_varying),
    Contender(SPHERE, "CDRF sphere", EEVEE, cdrf),
    Contender("CDRF profile", "CDRF profile", EEVEE, partial(cdrf, model="PROFILE")),
    Contender("CDRF measured", "CDRF measured", EEVEE, partial(cdrf, model="MEASURED")),
    Contender(SHADOWS, "CDRF sphere", EEVEE, partial(cdrf, shadows=True), missing=_no_lamps),
    Contender(LOOK, "CDRF path-traced look", EEVEE, partial(cdrf, view=True)),
    Contender(DEFAULT, "CDRF path-traced look", EEVEE, partial(cdrf, view=True, shadows=True),
              missing=_no_lamps),
    Contender("CDRF measured, shadows", "CDRF measured", EEVEE,
              partial(cdrf, model="MEASURED", shadows=True), missing=_no_lamps),
    Contender("CDRF sphere, coloured shadow edges", "CDRF sphere", EEVEE,
              partial(cdrf, shadows=True, edges=True), missing=_one_lamp),
    Contender("CDRF sphere, ambient occlusion", "CDRF sphere", EEVEE,
              partial(cdrf, occlusion=True), missing=_lamps),
    Contender(NODE, "EEVEE scattering", EEVEE, _node, (1, 4, 16, 64)),
    Contender(PRINCIPLED, "EEVEE scattering", EEVEE, partial(_plain, material="principled")),
    Contender(TEXTURE, "Texture blurring", NUMPY, _texture, (1,), _unwrapped),
    Contender(PATHS, "Cycles", CYCLES, _cycles, (1, 4, 16, 64, 256, 512)),
    Contender(f"{PATHS}, denoised", "Cycles", CYCLES, partial(_cycles, denoise=True), (1, 16)),
]  # fmt: skip

QUICK = {LAMBERT, SPHERE, DEFAULT, TEXTURE, PATHS}
"""Those of the sample."""
QUICK_SAMPLES = {PATHS: (1, 8)}


SURVEY_SAMPLES = {PATHS: (1, 4, 16, 64, 256)}
SURVEY_LACKS = {"CDRF sphere, coloured shadow edges", NODE}
"""A survey leaves out what takes longest; EEVEE's node is in it as the Principled BSDF."""


def chosen(
    *, sample: bool = False, survey: bool = False
) -> list[tuple[Contender, tuple[int, ...]]]:
    """Contenders with the samples at which they are measured; none stands for EEVEE's default.

    Args:
        sample: Those of the report's sample.
        survey: Those of the scenes that are not among the first (scenes.py).
    """
    if sample:
        return [(one, QUICK_SAMPLES.get(one.name, one.samples))
                for one in CONTENDERS if one.name in QUICK]  # fmt: skip
    if survey:
        return [(one, SURVEY_SAMPLES.get(one.name, one.samples))
                for one in CONTENDERS if one.name not in SURVEY_LACKS]  # fmt: skip
    return [(one, one.samples) for one in CONTENDERS]


def row_name(name: str, samples: tuple[int, ...], count: int) -> str:
    """Name of a contender at so many samples."""
    return name if len(samples) <= 1 else f"{name}, {count}"


def contender_of(row: str) -> Contender | None:
    """Contender of a row by its name with or without samples; None if it is known no more."""
    known = {one.name: one for one in CONTENDERS}
    return known.get(row) or known.get(row.rpartition(", ")[0])
