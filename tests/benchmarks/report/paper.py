# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper again: pictures of its figures, its fit, and what its section 5 claims."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, replace
from typing import Any

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from cdrf_addon import ids
from cdrf_addon.compat import ensure_node_tree
from cdrf_addon.core.measured.material_fit import fit_material
from cdrf_addon.core.measured.model import MeasuredModel
from cdrf_addon.core.reflectance.lut import build_lut, sample_lut
from cdrf_addon.core.reflectance.model import sphere
from cdrf_addon.measuring.figure import draw_fit
from cdrf_addon.measuring.process import measure as measure_spheres
from cdrf_addon.measuring.request import Request

from ..common.arrays import Array
from ..common.draws import node_types
from ..common.machine import machine
from ..common.timing import interleaved
from . import texture_blurring
from .cells import Cell
from .contenders import cdrf, lighting
from .lights import directions
from .matrix import keep_pictures, load_pictures, pictures_path
from .metrics import rmse
from .reference import kept
from .settings import SEED, Settings
from .stage import COVERED, Stage
from .substances import profile_of

HEAD = Cell("head", "skin", "sun")
STATUE = Cell("turned head", "skin", "sun")
RADII = (0.02, 0.06, 0.2, 0.6)
"""Red's scatter radius over the sphere's, of the spheres that are shown."""
FIT_SCALES = (0.03, 0.09, 0.25, 0.7)
"""The same, of the spheres whose fits are reported; the nearest that was measured."""
REPEATS = 5


def path_traced(stage: Stage, samples: int) -> Array:
    """A denoised picture for the eye; numbers come from the references of the matrix."""
    key = ["figure", asdict(stage.cell), stage.size, samples, stage.settings.level]
    return kept(
        stage.settings.cache / "references",
        key,
        lambda: stage.cycles(samples, SEED, denoise=True),
    )[0]


def run(settings: Settings, *, missing: bool = False) -> None:
    """Make all pictures and numbers of this section, or those that are not there."""
    results = settings.read("paper")
    results["machine"] = machine()
    for name, part in PARTS.items():
        if missing and name in results:
            continue
        start = time.perf_counter()
        results[name] = part(settings)
        settings.write("paper", results)
        print(f"{name}: {time.perf_counter() - start:.0f} s", flush=True)


def _store(settings: Settings, name: str, pictures: dict[str, Array]) -> None:
    keep_pictures(pictures_path(settings, Cell(name, "", "")), pictures)


def stored(settings: Settings, name: str) -> dict[str, NDArray[Any]]:
    """Pictures of a figure."""
    return load_pictures(pictures_path(settings, Cell(name, "", "")))


# --- Fig. 1 and 3 --------------------------------------------------------------------------------


def _wireframe(stage: Stage) -> Array:
    """The mesh as it was modelled, before its subdivision."""
    material = bpy.data.materials.new("Wire")
    tree = ensure_node_tree(material)
    tree.nodes.clear()
    wire = tree.nodes.new("ShaderNodeWireframe")
    wire.use_pixel_size = True
    wire.inputs["Size"].default_value = 0.6
    mix = tree.nodes.new("ShaderNodeMix")
    mix.data_type = "RGBA"
    tree.links.new(wire.outputs["Fac"], mix.inputs["Factor"])
    # Sockets of a Mix node share names among its data types.
    ends = [socket for socket in mix.inputs if socket.type == "RGBA"]
    ends[0].default_value, ends[1].default_value = (0.75,) * 3 + (1.0,), (0.05,) * 3 + (1.0,)
    glow = tree.nodes.new("ShaderNodeEmission")
    colour = next(socket for socket in mix.outputs if socket.type == "RGBA")
    tree.links.new(colour, glow.inputs["Color"])
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(glow.outputs["Emission"], output.inputs["Surface"])
    stage.assign(material)
    return stage.eevee(stage.settings.film)


def curvature_picture(stage: Stage) -> Array:
    """The curvature in hot colours."""
    with cdrf(stage) as render:
        assert bpy.ops.cdrf.show_curvature(display="ON", quantity="KAPPA") == {"FINISHED"}
        picture: Array = render(stage.settings.film)
        bpy.ops.cdrf.show_curvature(display="OFF")
    return picture


def _figure_1_and_3(settings: Settings) -> dict[str, Any]:
    coarse = Stage(HEAD, replace(settings, level=0), settings.large)
    pictures = {"mesh": _wireframe(coarse)}
    stage = Stage(HEAD, settings, settings.large)
    pictures["Path tracing"] = path_traced(stage, settings.samples // 4)
    pictures["curvature"] = curvature_picture(stage)
    known = stage.obj.data.cdrf
    stage.assign(stage.opaque)
    pictures["Lambert"] = stage.eevee(settings.film)
    with cdrf(stage, shadows=True) as render:
        pictures["CDRF, shadows"] = render(settings.film)
    geometry = stage.geometry
    colours, cost = texture_blurring.shade(
        geometry,
        lighting(stage),
        np.array(stage.substance.albedo),
        profile_of(stage.substance.name),
        stage.millimetres,
        settings.atlas,
    )
    blurred = np.zeros((stage.size**2, 4))
    blurred[geometry.hits.pixel] = np.column_stack((colours, np.ones(len(colours))))
    pictures["Texture blurring"] = blurred.reshape(stage.size, stage.size, 4)
    _store(settings, "figure3", pictures)
    range_of = {"low": known.low, "median": known.median, "high": known.high}
    return {
        "curvature": range_of,
        "texture cost": asdict(cost),
        "sigma0 mm": list(stage.substance.preset.sigma0),
        "vertices": len(stage.obj.data.vertices),
    }


# --- Fig. 2 --------------------------------------------------------------------------------------


def _figure_2(settings: Settings) -> dict[str, Any]:
    stage = Stage(Cell("sphere", "skin", "sun"), settings, settings.large // 2)
    albedo = stage.substance.albedo
    ratio = stage.substance.radius(1.0)
    ratio /= ratio.max()
    scatter = next(n for n in stage.scattering.node_tree.nodes if n.type == "SUBSURFACE_SCATTERING")
    turn = Vector((1.0, 0.0, 0.0)).to_track_quat("Z", "Y").to_euler()
    stage.lights[0].rotation_euler = turn
    radius = float(np.abs(stage.geometry.shape.vertices).max())
    pictures = {}
    for part in RADII:
        scatter.inputs["Radius"].default_value = ratio * part * radius
        pictures[f"{part:g}"] = stage.cycles(settings.samples // 8, SEED, denoise=True)
    _store(settings, "figure2", pictures)
    request = Request((albedo[0], albedo[1], albedo[2]), settings.quality, SEED)
    spheres = measure_spheres(request, settings.cache / "spheres")
    fitted = fit_material(spheres)
    shape = (float(ratio[0]), float(ratio[1]), float(ratio[2]))
    model = MeasuredModel(spheres, shape)
    settings.pictures.mkdir(parents=True, exist_ok=True)
    draw_fit(model, fitted, settings.pictures / "figure2_fit.png")
    rows = []
    for wanted in FIT_SCALES:
        for channel, one in enumerate(fitted.channels):
            row = int(np.abs(np.log(spheres.scales / (wanted * shape[channel]))).argmin())
            fits = {f"{name} {kind}": asdict(table[name][row])
                    for name in ("ring", "sphere")
                    for kind, table in (("fixed", one.fixed), ("free", one.free))}  # fmt: skip
            rows.append({"channel": "RGB"[channel], "albedo": one.albedo,
                         "scale": float(spheres.scales[row]), "lambert": one.lambert[row],
                         "noise": one.noise[row], **fits})  # fmt: skip
    holds = [{name: end if np.isfinite(end) else None for name, end in c.proportional_to.items()}
             for c in fitted.channels]  # fmt: skip
    return {"rows": rows, "proportional to": holds, "sentences": fitted.sentences()}


# --- Fig. 4 --------------------------------------------------------------------------------------


def _figure_4(settings: Settings) -> dict[str, Any]:
    stage = Stage(STATUE, settings, settings.large)
    pictures = {"Path tracing": path_traced(stage, settings.samples // 4)}
    stage.assign(stage.opaque)
    pictures["Lambert"] = stage.eevee(settings.film)
    for name, arguments in (
        ("CDRF ring (the paper)", {"model": "RING", "raw": True}),
        ("CDRF sphere, shadows", {"shadows": True}),
    ):
        with cdrf(stage, **arguments) as render:
            pictures[name] = render(settings.film)
    _store(settings, "figure4", pictures)
    truth = pictures.pop("Path tracing")
    covered = np.all([one[..., 3] > COVERED for one in (truth, *pictures.values())], axis=0)
    return {
        "millimetres": stage.millimetres,
        "rmse": {name: rmse(one, truth, covered) for name, one in pictures.items()},
    }


# --- section 5 -----------------------------------------------------------------------------------


def _claims(settings: Settings) -> dict[str, Any]:
    return {
        "nodes": _nodes(settings),
        "arithmetic": _arithmetic(settings),
        "without UV": _without_uv(settings),
    }


def _nodes(settings: Settings) -> dict[str, dict[str, int]]:
    """Nodes and look-ups of the materials under one sun."""
    stage = Stage(replace(HEAD), settings)
    found = {}
    for name, make in (("3 colours", stage.scattering), ("grey", stage.scattering)):
        with cdrf(stage):
            if name == "grey":
                make.cdrf.sigma0_ratio = (1.0, 1.0, 1.0)
            tree = make.node_tree.nodes[ids.NODE].node_tree
            inside = node_types(tree)
            found[name] = {"nodes": len(inside), "look-ups": inside.count("TEX_IMAGE")}
    return found


def _arithmetic(settings: Settings) -> dict[str, Any]:
    """Lambert, CDRF and texture blurring of the same pixels, all in NumPy on one core."""
    stage = Stage(HEAD, settings, settings.large)
    with cdrf(stage):
        kappa = _diffused(stage)
    geometry = stage.geometry
    hits, normal = geometry.hits, geometry.normal
    towards = directions(stage.lights[0], hits.position)
    albedo = np.array(stage.substance.albedo)
    table = build_lut(sphere())
    profile = profile_of(stage.substance.name)
    shape = geometry.shape
    assert geometry.corners is not None
    atlas = texture_blurring.make_atlas(
        shape.vertices, shape.triangles, geometry.corners, settings.atlas
    )
    places = atlas.interpolate(shape.triangles, shape.normals)
    uv = np.einsum("pc,pck->pk", hits.weights, geometry.corners[hits.triangle])
    cost = texture_blurring.Cost()

    def lambert() -> Array:
        return np.maximum((normal * towards).sum(axis=1), 0.0)[:, None] * albedo

    def curved() -> Array:
        cosine = (normal * towards).sum(axis=1)
        looked = [sample_lut(table, cosine, (own * kappa) ** 2) for own in stage.sigma0]
        return np.stack(looked, axis=1) * albedo

    def blurred() -> Array:
        texels = np.zeros((settings.atlas, settings.atlas, 3))
        arriving = np.maximum(places @ towards[0], 0.0)
        texels[atlas.mask] = arriving[:, None] * np.sqrt(albedo)
        cost.passes = cost.taps = 0
        spread = texture_blurring.diffuse(texels, atlas, profile, stage.millimetres, cost)
        return texture_blurring.sample(spread, uv) * np.sqrt(albedo)

    calls: dict[str, Callable[[], Array]] = {
        "Lambert": lambert, "CDRF": curved, "Texture blurring": blurred
    }  # fmt: skip
    seconds = interleaved(calls, REPEATS)
    return {"seconds": seconds, "pixels": len(hits.pixel), "texels": cost.texels,
            "passes": cost.passes, "taps": cost.taps, "look-ups": 3 * len(hits.pixel),
            "atlas": settings.atlas}  # fmt: skip


def _diffused(stage: Stage) -> Array:
    """Curvature at the pixels, at the length of the widest channel's nearest level."""
    data = stage.obj.data.attributes[ids.DIFFUSED_ATTRIBUTE].data
    values = np.empty(4 * len(data), dtype=np.float32)
    data.foreach_get("color", values)
    geometry = stage.geometry
    levels = values.reshape(-1, 4).astype(np.float64)
    return geometry.hits.interpolate(geometry.shape, levels[:, 1:2])[:, 0]


def _without_uv(settings: Settings) -> dict[str, Any]:
    """Make a mesh without UVs translucent, and look whether light bleeds over its terminator."""
    stage = Stage(Cell("bunny", "milk", "sun"), settings)
    mesh = stage.obj.data
    while mesh.uv_layers:
        mesh.uv_layers.remove(mesh.uv_layers[0])
    with cdrf(stage) as render:
        soft = render(1)
    stage.assign(stage.opaque)
    with stage.without_shadows():
        hard = stage.eevee(1)
    covered = (soft[..., 3] > COVERED) & (hard[..., 3] > COVERED)
    dark = covered & (hard[..., :3].max(axis=-1) <= 1e-4)
    return {"uv maps": len(mesh.uv_layers), "light behind the terminator":
            float(soft[..., :3].max(axis=-1)[dark].max()) if dark.any() else 0.0}  # fmt: skip


PARTS: dict[str, Callable[[Settings], dict[str, Any]]] = {
    "figure3": _figure_1_and_3,
    "figure2": _figure_2,
    "figure4": _figure_4,
    "claims": _claims,
}
