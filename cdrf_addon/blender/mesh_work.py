# SPDX-License-Identifier: GPL-3.0-or-later
"""The curvature of one mesh: measured, stored as attributes, and remembered with the mesh."""

from __future__ import annotations

import time
from collections.abc import Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import bpy
import numpy as np

from .. import ids
from ..core.curvature.facets import is_faceted
from ..core.curvature.field import DEFAULT_OPTIONS, CleanCurvature, Options, curvature_steps
from ..core.curvature.scale_space import LEVELS, level_steps
from ..core.curvature.spherical import curvature_if_spherical
from ..core.curvature.summary import (
    CONSTANT,
    FLAT,
    FLAT_SUMMARY,
    VARYING,
    CurvatureSummary,
    summarise,
)
from ..core.errors import CdrfError, SceneError
from ..core.progress import portion
from . import state
from .material.install import cdrf_node
from .material.translucent import materials_on
from .mesh.attributes import (
    VertexCurvature,
    has_walk_curvature,
    mark_filled,
    remove_curvature,
    round_shape,
    write_curvature,
)
from .mesh.surface import (
    Shape,
    base_fingerprint,
    coordinate_noise,
    evaluable,
    metric_of,
    read_shape,
)
from .shader import variant

if TYPE_CHECKING:
    from numpy.typing import NDArray

SAME_SIZE = 1e-4
# Part of the median curvature that the rounding of coordinates may make up without a warning.
COARSE_COORDINATES = 0.05

Metrics = Mapping[bpy.types.Object, Sequence["NDArray[np.float64]"]]


@dataclass
class MeshWork:
    """One mesh of a job, and what was measured of it."""

    mesh: bpy.types.Mesh
    users: list[bpy.types.Object] = field(default_factory=list)
    sizes: set[float] = field(default_factory=lambda: {1.0})
    """Sizes in which it is seen, by users and their instances, relative to the first user."""
    fingerprint: str = ""
    metric: NDArray[np.float64] | None = None
    summary: CurvatureSummary | None = None
    """None where nothing had to be computed."""
    curvature: VertexCurvature | None = None
    """At the mesh's own vertices; None where nothing had to be computed."""
    evaluated_vertices: int = 0
    options: Options = DEFAULT_OPTIONS
    seconds: float = 0.0
    warnings: list[str] = field(default_factory=list)

    @property
    def kind(self) -> str:
        """FLAT, CONSTANT or VARYING."""
        return self.summary.kind if self.summary else self.mesh.cdrf.kind

    @property
    def mean_values(self) -> tuple[float, ...]:
        """Means of kappa, k1, k2 and signed mean curvature."""
        return self.summary.mean_values if self.summary else tuple(self.mesh.cdrf.mean_values)

    @property
    def median(self) -> float:
        """Median of kappa."""
        return self.summary.median if self.summary else self.mesh.cdrf.median

    @property
    def length(self) -> float:
        """Length of the object's X axis, as measured."""
        assert self.metric is not None
        return float(self.metric[0, 0] ** 0.5)


def group_by_mesh(users: Iterable[bpy.types.Object]) -> list[MeshWork]:
    """Make one piece of work of all objects that share a mesh."""
    work: dict[bpy.types.Mesh, MeshWork] = {}
    for obj in users:
        work.setdefault(obj.data, MeshWork(obj.data)).users.append(obj)
    return list(work.values())


def instance_metrics(
    users: Iterable[bpy.types.Object], depsgraph: bpy.types.Depsgraph
) -> dict[bpy.types.Object, list[NDArray[np.float64]]]:
    """Map each object to the metrics (see `Shape`) of its instances."""
    wanted = set(users)
    found: dict[bpy.types.Object, list[NDArray[np.float64]]] = {}
    for instance in depsgraph.object_instances:
        obj = instance.object.original if instance.is_instance else None
        if obj in wanted:
            found.setdefault(obj, []).append(metric_of(instance))
    return found


def known_options(mesh: bpy.types.Mesh) -> Options:
    """Return how a mesh's curvature was measured the last time."""
    known = mesh.cdrf
    return Options(known.method, known.radius, known.crease_angle)


# --- measuring ----------------------------------------------------------------------------------


def keep_linked(work: MeshWork) -> list[str]:
    """Keep a linked mesh's curvature as it is; warn of objects that show it in another size."""
    known = work.mesh.cdrf
    work.metric = np.array(known.metric).reshape(3, 3)
    work.evaluated_vertices = known.evaluated_vertices
    return [
        f"'{obj.name}' has another size than in the file its mesh is linked from, which the "
        "scatter distance does not follow: divide it by the scale."
        for obj in work.users
        if not np.allclose(metric_of(obj), work.metric, rtol=0.0, atol=1e-3 * np.trace(work.metric))
    ]


def measure_steps(
    work: MeshWork,
    view_layer: bpy.types.ViewLayer,
    depsgraph: bpy.types.Depsgraph,
    *,
    options: Options | None,
    instances: Metrics,
    recompute: bool,
) -> Generator[float, None, None]:
    """Measure a mesh's curvature unless it is known, yielding the part done.

    Args:
        work: The mesh; takes the results. Nothing is written to the file.
        view_layer: Where its users may be hidden.
        depsgraph: Of that view layer.
        options: How to measure; None for the way of the last time.
        instances: Metrics of the instances of objects.
        recompute: Measure even where nothing has changed.

    Raises:
        CdrfError: The mesh cannot be used; the message names the object.
    """
    start = time.perf_counter()
    first, *others = work.users
    work.options = options or known_options(work.mesh)
    with evaluable(work.users, view_layer, depsgraph):
        shape = read_shape(first, depsgraph, work.options)
        for other in others:
            work.sizes.add(_relative_size(other, first, shape, depsgraph, work.options))
    for metric in (metric for obj in work.users for metric in instances.get(obj, ())):
        work.sizes.add(float((np.trace(metric) / np.trace(shape.metric)) ** 0.5))
    work.fingerprint = shape.fingerprint
    work.metric = shape.metric
    work.evaluated_vertices = len(shape.mesh.vertices)
    known = work.mesh.cdrf
    is_stored = known.kind in {FLAT, CONSTANT} or has_walk_curvature(work.mesh)
    if known.fingerprint == shape.fingerprint and is_stored and not recompute:
        yield 1.0
        return
    try:
        measured = yield from _shape_steps(work, shape)
    except CdrfError as error:
        raise type(error)(f"'{first.name}': {error}") from error
    with evaluable(work.users, view_layer, depsgraph):
        work.curvature, lost = measured.on_original_vertices(first, depsgraph)
    if lost == len(work.mesh.vertices):
        raise SceneError(
            f"'{first.name}' has a modifier that replaces the whole mesh (Remesh, Skin, some "
            "geometry nodes), which takes the curvature off again: apply that modifier first."
        )
    if lost:
        work.warnings.append(
            f"{lost:,} vertices do not survive the modifiers; their curvature is that of the "
            "nearest point. Apply the modifiers for exact values."
        )
    if _is_coarse(work, shape):
        work.warnings.append(
            "The mesh lies far from its origin, where coordinates are coarse, so its curvature "
            "is noisy: set the origin to the geometry (Object > Set Origin) and update."
        )
    work.seconds = time.perf_counter() - start


def _relative_size(
    other: bpy.types.Object,
    first: bpy.types.Object,
    shape: Shape,
    depsgraph: bpy.types.Depsgraph,
    options: Options,
) -> float:
    """Return how many times as large as the first user of a mesh another is."""
    factor = read_shape(other, depsgraph, options).size_relative_to(shape)
    if factor is None:
        raise SceneError(
            f"'{other.name}' and '{first.name}' share a mesh, but modifiers or scale give them "
            "different shapes: make one single-user "
            "(Object > Relations > Make Single User > Object & Data)."
        )
    return factor


def _shape_steps(work: MeshWork, shape: Shape) -> Generator[float, None, VertexCurvature]:
    """Measure and summarise a shape's curvature; return it at the evaluated vertices."""
    if is_faceted(shape.mesh):
        work.summary = FLAT_SUMMARY
        return VertexCurvature.flat(len(shape.mesh.vertices))
    cleaned: CleanCurvature | None = None
    found = curvature_if_spherical(shape.mesh)
    if found is None:
        cleaned = yield from portion(curvature_steps(shape.mesh, work.options), 0.0, 0.75)
        found = cleaned.on_source()
    work.summary = summarise(shape.mesh, found)
    work.warnings = found.sentences()
    principal = np.stack((found.kappa, found.k1, found.k2, found.mean), axis=1)
    levels = np.repeat(found.kappa[:, None], LEVELS, axis=1)
    means = np.repeat(found.mean[:, None], LEVELS, axis=1)
    shape_operator = round_shape(_as_stored(found.mean))
    shortest = np.ones_like(found.kappa)
    if cleaned is not None and work.summary.kind == VARYING:
        diffused = yield from portion(level_steps(cleaned), 0.75, 1.0)
        levels, shortest = diffused.kappa.values, diffused.kappa.shortest
        means = diffused.mean
        shape_operator = _as_stored(shape.in_object_axes(diffused.shape))
    return VertexCurvature(
        _as_stored(principal),
        _as_stored(levels),
        _as_stored(means),
        shape_operator,
        _as_stored(shortest),
        _as_stored(found.filled),
    )


def _as_stored(values: NDArray[np.float64] | NDArray[np.bool_]) -> NDArray[np.float32]:
    limit = np.finfo(np.float32).max
    return np.clip(values.astype(np.float64), -limit, limit).astype(np.float32)


def _is_coarse(work: MeshWork, shape: Shape) -> bool:
    """Return whether the rounding of coordinates makes up much of the curvature."""
    assert work.summary is not None
    if work.summary.kind == FLAT:
        return False
    return coordinate_noise(shape.mesh) > COARSE_COORDINATES * work.summary.median > 0.0


# --- what the shader reads ----------------------------------------------------------------------


def source_for(work: Sequence[MeshWork]) -> str:
    """Choose where a shader for all of these meshes reads kappa: the least that serves them."""
    if all(each.kind == FLAT for each in work):
        return variant.FLAT
    if any(abs(size - 1.0) > SAME_SIZE for each in work for size in each.sizes):
        return variant.SCALED
    if all(each.kind == CONSTANT for each in work):
        kappas = [each.mean_values[0] for each in work]
        if max(kappas) - min(kappas) <= 0.01 * max(kappas):
            return variant.CONSTANT
    return variant.ATTRIBUTE


def store(work: MeshWork, sources: Mapping[bpy.types.Material, str]) -> None:
    """Write a mesh's attributes as its materials read them, and remember what was measured.

    Args:
        work: A linked mesh stays as it is.
        sources: Where the materials of the job read kappa, by `source_for`.
    """
    mesh = work.mesh
    if not mesh.is_editable:
        return
    # Materials outside this job may be translucent too and read the same attribute.
    read = {
        sources.get(material) or _present_source(material)
        for obj in work.users
        for material in materials_on(obj)
    }
    if not read & {variant.ATTRIBUTE, variant.SCALED}:
        remove_curvature(mesh)
    elif work.curvature is not None:
        write_curvature(mesh, work.curvature)
        mark_filled(mesh, work.curvature)
    elif not has_walk_curvature(mesh):
        # A constant mesh that now shares its material with one that is not.
        write_curvature(mesh, VertexCurvature.constant(len(mesh.vertices), work.mean_values))
    for obj in work.users:
        if any(sources.get(material) == variant.SCALED for material in materials_on(obj)):
            obj[ids.SCALE_KEY] = work.length
        elif ids.SCALE_KEY in obj:
            del obj[ids.SCALE_KEY]
    if work.summary is not None:
        _remember(work, work.summary)


def _present_source(material: bpy.types.Material) -> str:
    node = cdrf_node(material)
    return variant.stamped_variant(node.node_tree).source if node is not None else ""


def _remember(work: MeshWork, summary: CurvatureSummary) -> None:
    """Keep with the mesh what was measured, so that it is not measured again."""
    known = work.mesh.cdrf
    assert work.metric is not None
    known.fingerprint = work.fingerprint
    known.base_fingerprint = base_fingerprint(work.mesh)
    known.kind = summary.kind
    known.low, known.median, known.high = summary.low, summary.median, summary.high
    known.mean_high = summary.mean_high
    known.mean_values = summary.mean_values
    known.metric = work.metric.ravel()
    known.method = work.options.method
    known.radius = work.options.radius
    known.crease_angle = work.options.crease_angle
    known.vertices = len(work.mesh.vertices)
    known.evaluated_vertices = work.evaluated_vertices
    known.seconds = work.seconds
    known.warnings = "\n".join(work.warnings)
    state.mark_current(work.mesh)
