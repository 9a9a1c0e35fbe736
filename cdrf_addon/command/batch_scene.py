# SPDX-License-Identifier: GPL-3.0-or-later
"""Open one input of the batch and prepare it: translucent, up to date, ready to render."""

from __future__ import annotations

import bpy

from .. import compat, ids
from ..blender import setup
from ..blender.display import curvature as display
from ..blender.material import model
from ..blender.material.install import cdrf_node
from ..blender.material.scatter_distance import apply_preset
from ..blender.material.translucent import linked_translucent_materials, translucent_objects
from ..blender.units import metres_per_unit
from ..core.errors import SceneError
from ..core.scattering.presets import PRESETS
from . import stage
from .batch_job import SceneJob
from .batch_options import BatchOptions
from .batch_summary import SceneRecord
from .console import run_with_progress

# Longer work than this prints its progress.
PROGRESS_SECONDS = 0.5


def prepare(job: SceneJob, record: SceneRecord) -> None:
    """Load or import the scene, make it translucent or bring it up to date, and set the render.

    Raises:
        CdrfError: The file cannot be used.
    """
    with record.stage("load"):
        _open(job)
    _set_render(job, record)
    with record.stage("curvature and nodes"):
        _make_translucent(job, record)
    for material in translucent_materials():
        _adjust(material, job, record)


def translucent_materials() -> list[bpy.types.Material]:
    """List the translucent materials of the open file that can be changed."""
    return [
        material
        for material in bpy.data.materials
        if material.is_editable and cdrf_node(material) is not None
    ]


def _open(job: SceneJob) -> None:
    if job.from_mesh_file:
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        meshes = stage.import_mesh(job.path, job.options.scale, job.options.subdivide)
        stage.light_and_frame(meshes)
        return
    try:
        bpy.ops.wm.open_mainfile(filepath=str(job.path.resolve()), load_ui=False)
    except RuntimeError as error:
        raise SceneError(f"{job.path.name} cannot be opened: {str(error).strip()}") from error


def _set_render(job: SceneJob, record: SceneRecord) -> None:
    options, scene = job.options, bpy.context.scene
    if scene.camera is None:
        raise SceneError(f"{job.path.name} has no camera; add one.")
    if scene.render.engine != compat.EEVEE:
        record.warnings.append(f"The scene was set to {scene.render.engine}; rendered with EEVEE.")
        scene.render.engine = compat.EEVEE
    if options.frames:
        scene.frame_set(options.frames[0])
    if options.resolution:
        scene.render.resolution_x, scene.render.resolution_y = options.resolution
        scene.render.resolution_percentage = 100
    if options.samples:
        scene.eevee.taa_render_samples = options.samples
    output = scene.render.image_settings
    compat.set_still_format(output, "OPEN_EXR" if options.format == "EXR" else "PNG")
    output.color_depth = "32" if options.format == "EXR" else "8"
    if scene.render.use_multiview:
        record.warnings.append("The scene was set to stereo; rendered as one picture.")
        scene.render.use_multiview = False


def _make_translucent(job: SceneJob, record: SceneRecord) -> None:
    layer = bpy.context.view_layer
    objects = translucent_objects(layer)
    linked = sorted({m.name for obj in layer.objects for m in linked_translucent_materials(obj)})
    if linked:
        record.warnings.append(
            f"Linked, so left as in their own file, --sigma0 or not: {', '.join(linked)}."
        )
    if not objects and linked:
        return
    if not objects:
        objects = [obj for obj in layer.objects if obj.type == "MESH" and not obj.hide_render]
        if not job.from_mesh_file:
            record.warnings.append("Nothing was translucent yet: every mesh was set up.")
    work = setup.Setup(bpy.context, objects, options=job.options.estimation)
    run_with_progress(work.steps(), PROGRESS_SECONDS)
    report = work.commit()
    record.vertices = report.vertices
    record.warnings += report.warnings


def _adjust(material: bpy.types.Material, job: SceneJob, record: SceneRecord) -> None:
    """Set what the command line asks of a material, and remove what would override it."""
    node = cdrf_node(material)
    assert node is not None
    if display.shows_curvature(material):
        record.warnings.append(
            f"'{material.name}' was showing its curvature; rendered translucent instead."
        )
        display.hide([material])
    _set_model(material, job.options)
    given = job.options.sigma0 or job.options.preset
    if given and _disconnect(material, node.inputs[ids.SIGMA0]):
        record.warnings.append(
            f"'{material.name}': {ids.SIGMA0} is animated or connected; the command line "
            "replaces that."
        )
    if job.options.albedo and job.from_mesh_file:
        colour = node.inputs[ids.BASE_COLOR]
        _disconnect(material, colour)
        colour.default_value = (*job.options.albedo, 1.0)


def _set_model(material: bpy.types.Material, options: BatchOptions) -> None:
    """Set the model and the scatter distances, as far as the command line names them."""
    if options.preset:
        metres = metres_per_unit(bpy.context.scene)
        apply_preset(material, PRESETS[options.preset], metres, 1.0)
    if options.model:
        model.set_kind(material, options.model)
    if options.ratio:
        material.cdrf.sigma0_ratio = options.ratio


def _disconnect(material: bpy.types.Material, socket: bpy.types.NodeSocket) -> bool:
    """Free a socket from links, keyframes and drivers; return whether it had any."""
    tree = material.node_tree
    links = list(socket.links)
    for link in links:
        tree.links.remove(link)
    path = socket.path_from_id("default_value")
    curves = compat.animation_curves(tree, path)
    for curve in curves:
        curve.mute = True
    return bool(links or curves)
