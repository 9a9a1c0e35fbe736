# SPDX-License-Identifier: GPL-3.0-or-later
"""The main job: from objects to translucent materials, in steps that can be shown and cancelled.

`Setup.steps` gathers and computes and changes nothing the artist would see; `Setup.commit` writes
everything at once. Whatever fails, fails before the first write.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import bpy
import numpy as np

from .. import ids
from ..compat import EEVEE
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
from ..core.errors import CdrfError, DependencyError, SceneError
from ..core.progress import portion
from . import state
from .display import curvature as display
from .instances import is_instance, shown_objects
from .lights.drivers import MOST_FLAGS
from .lights.scene_lights import SceneLight, nested_instances
from .material import linking
from .material import model as reflectance_models
from .material import specular as gloss
from .material.install import cdrf_node, install, is_mapped, require_editable
from .material.lighting import lights_on_skin, lit_elsewhere
from .material.scattering import Scattering, read_scattering
from .material.shadow_choice import choose_shadows
from .mesh.attributes import (
    Shape,
    base_fingerprint,
    coordinate_noise,
    evaluable,
    has_curvature,
    is_measured,
    linear_part,
    mark_filled,
    read_shape,
    remove_curvature,
    to_original_vertices,
    write_curvature,
)
from .nodes.tables import adopt_table
from .shader import variant
from .shader.bits import MOST_SELECTIVE
from .shader.group import ensure_shader_group
from .world.light import WorldLight, world_light
from .world.surface import is_animated, scene_world

if TYPE_CHECKING:
    from numpy.typing import NDArray

# sigma of the first look, at the median curvature: visible, not yet wax.
FIRST_SIGMA = 0.25
SAME_SIZE = 1e-4
# Part of the median curvature that the rounding of coordinates may make up without a warning.
COARSE_COORDINATES = 0.05


@dataclass
class Report:
    """What a job did, in numbers and in sentences for the artist."""

    objects: int = 0
    materials: int = 0
    vertices: int = 0
    computed: int = 0
    seconds: float = 0.0
    warnings: list[str] = field(default_factory=list)
    read: list[str] = field(default_factory=list)
    """Materials whose scatter distance was read from their own shader nodes."""

    def sentence(self) -> str:
        """Sum it up in one line."""
        parts = [f"{self.objects} object{'s' if self.objects != 1 else ''}"]
        parts.append(f"{self.materials} material{'s' if self.materials != 1 else ''}")
        if self.computed:
            parts.append(f"curvature at {self.vertices:,} vertices in {self.seconds:.2f} s")
        else:
            parts.append("curvature was up to date")
        if self.read:
            parts.append(f"scatter distance of {', '.join(self.read)} taken from its nodes")
        return ", ".join(parts)


@dataclass
class _MeshWork:
    """One mesh to be dealt with, and what came of it."""

    mesh: bpy.types.Mesh
    users: list[bpy.types.Object] = field(default_factory=list)
    sizes: set[float] = field(default_factory=lambda: {1.0})
    """Sizes in which it is seen, by users and their instances, relative to the first user."""
    fingerprint: str = ""
    metric: NDArray[np.float64] | None = None
    summary: CurvatureSummary | None = None
    """None where nothing had to be computed."""
    values: NDArray[np.float32] | None = None
    """(n, 10): kappa, k1, k2, signed mean; kappa at four diffusion lengths, the shortest of these
    lengths; 1 where filled."""
    evaluated_vertices: int = 0
    options: Options = DEFAULT_OPTIONS
    seconds: float = 0.0
    warnings: list[str] = field(default_factory=list)

    @property
    def kind(self) -> str:
        return self.summary.kind if self.summary else self.mesh.cdrf.kind

    @property
    def mean_values(self) -> tuple[float, ...]:
        return self.summary.mean_values if self.summary else tuple(self.mesh.cdrf.mean_values)

    @property
    def median(self) -> float:
        return self.summary.median if self.summary else self.mesh.cdrf.median

    @property
    def length(self) -> float:
        """Length of the object's X axis, as measured."""
        assert self.metric is not None
        return float(self.metric[0, 0] ** 0.5)


class Setup:
    """Makes objects translucent, or brings translucent ones up to date.

    Args:
        context: For the scene, the view layer and the dependency graph.
        objects: What to work on; other users of the same materials are included by themselves.
        options: How to measure curvature; None keeps how each mesh was measured before.
        only_active_slot: Convert an object's active material slot only.
        convert: False to leave materials alone that are not translucent yet.
        recompute: True to estimate the curvature even where nothing has changed.

    Raises:
        SceneError: There is nothing to work on, or something may not be changed.
    """

    def __init__(
        self,
        context: bpy.types.Context,
        objects: Iterable[bpy.types.Object],
        *,
        options: Options | None = None,
        only_active_slot: bool = False,
        convert: bool = True,
        recompute: bool = False,
    ) -> None:
        self.scene = context.scene
        self.view_layer = context.view_layer
        self.depsgraph = context.evaluated_depsgraph_get()
        self.options = options
        self.recompute = recompute
        self.report = Report()
        self.slots: list[bpy.types.MaterialSlot] = []
        self.bare: list[bpy.types.Object] = []
        self.borrowed: list[bpy.types.MaterialSlot] = []
        """Slots whose translucent material another file owns: they get a copy of it."""
        self._own: dict[bpy.types.Material, Scattering | None] = {}
        self.world: WorldLight | None = None
        self._choose(list(objects), only_active_slot, convert)
        self.work = self._gather()
        self.instances = self._instances()

    # --- gathering ----------------------------------------------------------------------------

    def _choose(
        self, objects: list[bpy.types.Object], only_active_slot: bool, convert: bool
    ) -> None:
        """Find the material slots to convert and the objects that need a first material."""
        self.objects = []
        instance = ""
        for item in objects:
            if item.type != "MESH":
                if item.type == "EMPTY" and item.instance_collection is not None:
                    instance = item.name
                if convert and item.type not in {"LIGHT", "CAMERA", "EMPTY"}:
                    self.report.warnings.append(
                        f"'{item.name}' is not a mesh: convert it first (Object > Convert > Mesh)."
                    )
                continue
            if (
                not convert
                and item.hide_render
                and not item.visible_get(view_layer=self.view_layer)
            ):
                continue  # nobody sees it
            if item.mode == "EDIT":
                raise SceneError(f"'{item.name}' is in Edit Mode: leave it first (Tab).")
            self.objects.append(item)
        if not self.objects:
            raise SceneError(self._nothing_to_do(convert, instance))
        for item in self.objects:
            slots = list(item.material_slots)
            if only_active_slot and slots:
                slots = [slots[item.active_material_index]]
            if not convert:
                slots = [slot for slot in slots if self._is_ours(slot.material)]
            elif not slots:
                require_editable(item.data)
                if all(other.data != item.data for other in self.bare):
                    self.bare.append(item)
            for slot in slots:
                borrowed = slot.material is not None and not slot.material.is_editable
                if borrowed and item.is_editable and cdrf_node(slot.material) is not None:
                    self.borrowed.append(slot)
                    continue
                require_editable(slot.material or item.data)
                self.slots.append(slot)
        if not (self.slots or self.bare or self.borrowed):
            raise SceneError(self.report.warnings[-1])
        if convert:
            self._warn_of_other_scenes()

    def _is_ours(self, material: bpy.types.Material | None) -> bool:
        """Tell whether Update may change a material: translucent, local, lit by this scene."""
        if material is None or cdrf_node(material) is None or not material.is_editable:
            return False
        other = lit_elsewhere(material, self.scene)
        if other is not None:
            line = (
                f"'{material.name}' was left as it is, with the lights of the scene "
                f"'{other.name}', where it is seen too. Give this scene objects and materials of "
                "its own (Object > Relations > Make Single User > Object & Data & Materials) and "
                "update again, or take them over with Make Translucent."
            )
            if line not in self.report.warnings:
                self.report.warnings.append(line)
        return other is None

    def _warn_of_other_scenes(self) -> None:
        for material in dict.fromkeys(slot.material for slot in self.slots):
            other = lit_elsewhere(material, self.scene) if material is not None else None
            if other is not None:
                self.report.warnings.append(
                    f"'{material.name}' has this scene's lights now, in the scene '{other.name}' "
                    "too: press Make Translucent there to change back."
                )

    def _nothing_to_do(self, convert: bool, instance: str) -> str:
        if convert and instance:
            return (
                f"'{instance}' is an instance of a collection: make the objects in it "
                "translucent, or turn it into a library override (Object > Library Override > "
                "Make) or into real objects (Object > Apply > Make Instances Real) first."
            )
        if convert:
            return "No mesh object is selected: click the object that should become translucent."
        if translucent_objects(self.view_layer):
            return "Every translucent object is hidden: show one and update again."
        if any(linked_skins(item) for item in shown_objects(self.view_layer)):
            return (
                "The translucent materials here are linked from another file and have its lights: "
                "update them there, or turn their objects into library overrides (Object > Library "
                "Override > Make) and press Make Translucent for copies lit by this scene."
            )
        return "Nothing in this scene is translucent yet: press Make Translucent first."

    def _gather(self) -> list[_MeshWork]:
        """Group by mesh all objects of the scene that show one of the materials."""
        materials = {slot.material for slot in self.slots if slot.material is not None}
        users = list(self.objects)
        for item in shown_objects(self.view_layer):
            if item.type == "MESH" and item not in users and materials & _materials(item):
                users.append(item)
        others = len(users) - len(self.objects)
        if others:
            self.report.warnings.append(
                f"{others} more object{'s' if others > 1 else ''} with the same material "
                f"{'are' if others > 1 else 'is'} translucent with it."
            )
        work: dict[bpy.types.Mesh, _MeshWork] = {}
        for item in users:
            if not is_measured(item.data):  # a linked mesh keeps what was measured in its file
                require_editable(item.data)
            work.setdefault(item.data, _MeshWork(item.data)).users.append(item)
        return list(work.values())

    # --- computing ----------------------------------------------------------------------------

    def steps(self) -> Generator[tuple[float, str], None, None]:
        """Compute what has changed, yielding the part done and what is being done.

        A mesh that cannot be used is left as it is, with a warning, if there are others.

        Raises:
            CdrfError: No mesh can be used; nothing has been changed.
        """
        sizes = [max(len(work.mesh.vertices), 1) for work in self.work]
        total, done = float(sum(sizes)), 0
        for work, size in zip(list(self.work), sizes, strict=True):
            try:
                for part in self._compute(work):
                    yield (done + part * size) / total, f"Curvature of {work.users[0].name}"
            except DependencyError:
                raise
            except CdrfError as error:
                if len(self.work) == 1:
                    raise
                self._leave_out(work, str(error))
            done += size
        yield 1.0, "The world's light"
        self._read_world()

    def _read_world(self) -> None:
        """See what the world gives; without it the lights still shine."""
        found = scene_world(self.scene, self.view_layer)
        try:
            self.world = world_light(found, again=self.recompute)
        except CdrfError as error:
            self.report.warnings.append(str(error))
        if found is not None and self.world is not None and is_animated(found):
            self.report.warnings.append(
                f"The world '{found.name}' is animated: its strength is followed, the rest is that "
                f"of frame {self.scene.frame_current}."
            )

    def _leave_out(self, work: _MeshWork, reason: str) -> None:
        self.work.remove(work)
        self.bare = [item for item in self.bare if item.data != work.mesh]
        owners = {*work.users, work.mesh}
        self.slots = [slot for slot in self.slots if slot.id_data not in owners]
        self.report.warnings.append(f"Left out: {reason}")

    def _instances(self) -> dict[bpy.types.Object, list[NDArray[np.float64]]]:
        """Metrics (see `Shape`) of the instances of each object."""
        users = {item for work in self.work for item in work.users}
        found: dict[bpy.types.Object, list[NDArray[np.float64]]] = {}
        for instance in self.depsgraph.object_instances:
            item = instance.object.original if instance.is_instance else None
            if item in users:
                linear = linear_part(instance)
                found.setdefault(item, []).append(linear.T @ linear)
        return found

    def _keep(self, work: _MeshWork) -> None:
        """Take a linked mesh's curvature as it is."""
        known = work.mesh.cdrf
        work.metric = np.array(known.metric).reshape(3, 3)
        work.evaluated_vertices = known.evaluated_vertices
        for item in work.users:
            linear = linear_part(item)
            if not np.allclose(
                linear.T @ linear, work.metric, rtol=0.0, atol=1e-3 * np.trace(work.metric)
            ):
                self.report.warnings.append(
                    f"'{item.name}' has another size than in the file its mesh is linked from, "
                    "which the scatter distance does not heed: divide it by the scale."
                )

    def _compute(self, work: _MeshWork) -> Generator[float, None, None]:
        if not work.mesh.is_editable:
            self._keep(work)
            yield 1.0
            return
        start = time.perf_counter()
        first, *others = work.users
        work.options = self.options or known_options(work.mesh)
        with evaluable(work.users, self.view_layer, self.depsgraph):
            shape = read_shape(first, self.depsgraph, work.options)
            for other in others:
                work.sizes.add(self._relative_size(other, shape, first, work.options))
        for metric in (m for item in work.users for m in self.instances.get(item, ())):
            work.sizes.add(float((np.trace(metric) / np.trace(shape.metric)) ** 0.5))
        work.fingerprint = shape.fingerprint
        work.metric = shape.metric
        work.evaluated_vertices = len(shape.mesh.vertices)
        known = work.mesh.cdrf
        kept = known.kind in {FLAT, CONSTANT} or has_curvature(work.mesh)
        if known.fingerprint == shape.fingerprint and kept and not self.recompute:
            yield 1.0
            return
        try:
            values = yield from self._measure(work, shape)
        except CdrfError as error:
            raise type(error)(f"'{first.name}': {error}") from error
        assert work.summary is not None
        with evaluable(work.users, self.view_layer, self.depsgraph):
            work.values, lost = to_original_vertices(first, self.depsgraph, values)
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
        noise = coordinate_noise(shape.mesh)
        if work.summary.kind != FLAT and noise > COARSE_COORDINATES * work.summary.median > 0.0:
            work.warnings.append(
                "The mesh lies far from its origin, where coordinates are coarse, so its curvature "
                "is noisy: set the origin to the geometry (Object > Set Origin) and update."
            )
        work.seconds = time.perf_counter() - start

    def _measure(
        self, work: _MeshWork, shape: Shape
    ) -> Generator[float, None, NDArray[np.float32]]:
        """Measure and sum up a shape's curvature; return what is stored, (n, 10)."""
        if is_faceted(shape.mesh):
            work.summary = FLAT_SUMMARY
            return np.zeros((len(shape.mesh.vertices), 4 + LEVELS + 2), dtype=np.float32)
        cleaned: CleanCurvature | None = None
        found = curvature_if_spherical(shape.mesh)
        if found is None:
            cleaned = yield from portion(curvature_steps(shape.mesh, work.options), 0.0, 0.75)
            found = cleaned.on_source()
        work.summary = summarise(shape.mesh, found)
        work.warnings = found.sentences()
        principal = np.stack((found.kappa, found.k1, found.k2, found.mean), axis=1)
        levels = np.repeat(found.kappa[:, None], LEVELS, axis=1)
        finest = np.ones_like(found.kappa)
        if cleaned is not None and work.summary.kind == VARYING:
            diffused = yield from portion(level_steps(cleaned), 0.75, 1.0)
            levels, finest = diffused.values, diffused.shortest
        limit = np.finfo(np.float32).max
        values = np.column_stack((principal, levels, finest, found.filled))
        return np.clip(values, -limit, limit).astype(np.float32)

    def _relative_size(
        self, other: bpy.types.Object, shape: Shape, first: bpy.types.Object, options: Options
    ) -> float:
        factor = read_shape(other, self.depsgraph, options).size_relative_to(shape)
        if factor is None:
            raise SceneError(
                f"'{other.name}' and '{first.name}' share a mesh, but modifiers or scale give them "
                "different shapes: make one single-user "
                "(Object > Relations > Make Single User > Object & Data)."
            )
        return factor

    # --- writing ------------------------------------------------------------------------------

    def commit(self) -> Report:
        """Write attributes, groups and materials; the only part that changes the file."""
        # Read first: what fails here fails before the first write.
        self._own = {
            slot.material: read_scattering(slot.material)
            for slot in self.slots
            if slot.material is not None and _asks_for_sigma0(slot.material)
        }
        self._give_materials()
        lights = lights_on_skin(self.scene, self.view_layer, self.objects)
        sources = {
            material: self._source(material)
            for material in dict.fromkeys(slot.material for slot in self.slots)
        }
        for work in self.work:
            self._store(work, sources)
        for material, source in sources.items():
            self._install(material, source, linking.reaching(lights, material, self.view_layer))
        linking.write_unlit()
        display.refresh(self.scene, skins_of(self.view_layer))
        reflectance_models.remove_unused()
        self._sum_up(lights, sources)
        return self.report

    def _give_materials(self) -> None:
        for item in self.bare:
            item.data.materials.append(_new_material(item.name))
            self.slots.append(item.material_slots[0])
        for slot in self.slots:
            if slot.material is None:
                slot.material = _new_material(slot.id_data.name)
        copies: dict[bpy.types.Material, bpy.types.Material] = {}
        for slot in self.borrowed:
            linked = slot.material
            if linked not in copies:
                copies[linked] = linked.copy()
                adopt_table(reflectance_models.model_key(linked))
                self.report.warnings.append(
                    f"'{linked.name}' is linked: a copy of it is lit by this scene."
                )
            if not slot.id_data.data.is_editable:
                slot.link = "OBJECT"
            slot.material = copies[linked]
            self.slots.append(slot)

    def _work_of(self, material: bpy.types.Material) -> list[_MeshWork]:
        return [
            work for work in self.work if any(material in _materials(item) for item in work.users)
        ]

    def _source(self, material: bpy.types.Material) -> str:
        """Decide where the shader takes kappa from: the least that serves all users."""
        work = self._work_of(material)
        if all(item.kind == FLAT for item in work):
            return variant.FLAT
        if any(abs(size - 1.0) > SAME_SIZE for item in work for size in item.sizes):
            return variant.SCALED
        if all(item.kind == CONSTANT for item in work):
            kappas = [item.mean_values[0] for item in work]
            if max(kappas) - min(kappas) <= 0.01 * max(kappas):
                return variant.CONSTANT
        return variant.ATTRIBUTE

    def _store(self, work: _MeshWork, sources: dict[bpy.types.Material, str]) -> None:
        if not work.mesh.is_editable:
            return
        # Materials outside this job may be translucent too and read the same attribute.
        read = {
            sources.get(material) or _present_source(material)
            for item in work.users
            for material in _materials(item)
        }
        if not read & {variant.ATTRIBUTE, variant.SCALED}:
            remove_curvature(work.mesh)
        elif work.values is not None:
            principal, levels, rest = np.split(work.values, (4, 4 + LEVELS), axis=1)
            write_curvature(work.mesh, principal, levels, rest[:, 0])
            mark_filled(work.mesh, rest[:, 1] > 0.5)
        elif not has_curvature(work.mesh):
            # A constant mesh that now shares its material with one that is not.
            constant = np.array(work.mean_values, dtype=np.float32)
            principal = np.tile(constant, (len(work.mesh.vertices), 1))
            levels = np.repeat(principal[:, :1], LEVELS, axis=1)
            write_curvature(work.mesh, principal, levels, np.ones_like(principal[:, 0]))
        for item in work.users:
            scaled = any(sources.get(m) == variant.SCALED for m in _materials(item))
            if scaled:
                item[ids.SCALE_KEY] = work.length
            elif ids.SCALE_KEY in item:
                del item[ids.SCALE_KEY]
        if work.summary is not None:
            _remember(work)

    def _install(self, material: bpy.types.Material, source: str, lights: list[SceneLight]) -> None:
        settings = material.cdrf
        fresh = cdrf_node(material) is None
        ratio = tuple(settings.sigma0_ratio)
        model, lost = reflectance_models.ensure_chosen(material)
        if lost:
            self.report.warnings.append(lost)
        wanted = variant.variant_of(
            ratio,
            source,
            model,
            mapped=is_mapped(material),
            occluded=settings.ambient_occlusion,
            shadows=choose_shadows(material, self.view_layer),
            links=linking.links_of(lights),
        )
        group = ensure_shader_group(wanted, self.scene, lights, self.world)
        beyond = linking.without_bit(group)
        if beyond:
            self.report.warnings.append(
                f"More than {MOST_SELECTIVE} lights are linked to some of the objects that "
                f"share a material: '{beyond[0]}' shines on all of them. Use more materials."
            )
        before = cdrf_node(material)
        had_detail = before is not None and ids.DETAIL_SIZE in before.inputs
        node = install(material, group)
        work = self._work_of(material)
        if fresh:
            node.inputs[ids.SIGMA0_RATIO].default_value = ratio
            own = self._own.get(material)
            if own is not None:
                reflectance_models.set_scattering(material, own)
                self.report.read.append(material.name)
                self.report.warnings += [f"'{material.name}': {note}" for note in own.notes]
            elif settings.chosen_sigma0 < 0.0:
                settings.chosen_sigma0 = _first_sigma0(work)
            node.inputs[ids.SIGMA0].default_value = settings.chosen_sigma0
        if settings.gloss if not fresh else settings.wants_gloss():
            # The artist's node may have changed since, or been removed.
            gloss.add_gloss(material)
        if wanted.mapped and not had_detail:
            reflectance_models.choose_detail(material)
        if source == variant.CONSTANT:
            kappas = [item.mean_values[0] for item in work]
            node.inputs[ids.CURVATURE].default_value = float(np.mean(kappas))

    def _strange_lights(self, lights: list[SceneLight]) -> list[str]:
        """Say what of the scene's light cannot be followed."""
        told = []
        makers = {
            instance.parent.original
            for instance in self.depsgraph.object_instances
            if instance.is_instance and instance.object.type == "LIGHT" and instance.parent
        }
        told += [
            f"The lights that '{maker.name}' instances (by vertices, faces, particles or geometry "
            "nodes) do not reach the surface: make them real (Object > Apply > Make Instances "
            "Real)."
            for maker in makers
            if not is_instance(maker)
        ]
        told += [
            f"'{light.name}' is in more than {MOST_FLAGS} collections, too many to follow which "
            "view layers exclude it: it shines in all of them."
            for light in lights
            if len(light.excluded) > MOST_FLAGS
        ]
        told += [
            f"'{name}' is a library override, of which Blender does not save that it does not "
            "receive every light: give it a material of its own, or update after opening the file."
            for name in linking.lost_on_saving({item for work in self.work for item in work.users})
        ]
        used = [layer for layer in self.scene.view_layers if layer.use]
        if len({scene_world(self.scene, layer) for layer in used}) > 1:
            told.append(
                "The view layers have different worlds; the surface has the light of the one that "
                f"was open ('{self.view_layer.name}')."
            )
        return told

    def _sum_up(self, lights: list[SceneLight], sources: dict[bpy.types.Material, str]) -> None:
        report = self.report
        report.objects = sum(len(work.users) for work in self.work)
        report.materials = len(sources)
        for work in self.work:
            if work.summary is not None:
                report.computed += 1
                report.vertices += work.evaluated_vertices
                report.seconds += work.seconds
                report.warnings += [f"'{work.users[0].name}': {line}" for line in work.warnings]
            if work.kind == FLAT:
                report.warnings.append(
                    f"'{work.users[0].name}' is flat: it looks the same at any scatter distance."
                )
        for item in nested_instances(self.view_layer):
            report.warnings.append(
                f"'{item.name}' instances a collection that instances lights in its turn; these do "
                "not reach the surface: make it real (Object > Apply > Make Instances Real)."
            )
        report.warnings += self._strange_lights(lights)
        if not lights and self.world is None:
            report.warnings.append("The scene has no light that renders, so the surface is black.")
        if self.scene.render.engine not in {EEVEE, "BLENDER_WORKBENCH"}:
            report.warnings.append(
                "This scene renders with another engine: choose EEVEE in the Render properties to "
                "see the translucency."
            )


def run(job: Setup) -> Report:
    """Do a whole job at once."""
    for _ in job.steps():
        pass
    return job.commit()


def translucent_objects(view_layer: bpy.types.ViewLayer) -> list[bpy.types.Object]:
    """List mesh objects with a CDRF material of this file, in instances too."""
    return [
        item
        for item in shown_objects(view_layer)
        if item.type == "MESH"
        and any(cdrf_node(material) and material.is_editable for material in _materials(item))
    ]


def skins_on(item: bpy.types.Object) -> list[bpy.types.Material]:
    """List the translucent materials of an object, slot by slot."""
    return [
        slot.material
        for slot in item.material_slots
        if item.type == "MESH" and cdrf_node(slot.material) is not None
    ]


def skins_of(layer: bpy.types.ViewLayer) -> dict[bpy.types.Material, list[bpy.types.Mesh]]:
    """List the translucent materials of a view layer, each with the meshes that show it."""
    skins: dict[bpy.types.Material, list[bpy.types.Mesh]] = {}
    for item in translucent_objects(layer):
        for skin in skins_on(item):
            skins.setdefault(skin, []).append(item.data)
    return skins


def linked_skins(item: bpy.types.Object) -> list[bpy.types.Material]:
    """List the translucent materials of an object that another file owns."""
    return [m for m in _materials(item) if cdrf_node(m) is not None and not m.is_editable]


def _present_source(material: bpy.types.Material) -> str:
    node = cdrf_node(material)
    return variant.stamped_variant(node.node_tree).source if node is not None else ""


def _asks_for_sigma0(material: bpy.types.Material) -> bool:
    """Tell whether nobody has chosen a scatter distance yet; reading one may mean a picture."""
    return cdrf_node(material) is None and material.cdrf.chosen_sigma0 < 0.0


def _materials(item: bpy.types.Object) -> set[bpy.types.Material]:
    return {slot.material for slot in item.material_slots if slot.material is not None}


def _new_material(name: str) -> bpy.types.Material:
    material = bpy.data.materials.new(f"{name} Translucent")
    material.cdrf.chosen_gloss = 0  # what Blender puts into a new material is nobody's choice
    return material


def _first_sigma0(work: list[_MeshWork]) -> float:
    """Choose a sigma0 at which the middle of the mesh is visibly translucent, in two digits."""
    medians = [item.median for item in work if item.kind != FLAT and item.median > 0.0]
    if not medians:
        return 0.0
    return float(f"{FIRST_SIGMA / float(np.median(medians)):.2g}")


def known_options(mesh: bpy.types.Mesh) -> Options:
    """How a mesh's curvature was measured the last time."""
    known = mesh.cdrf
    return Options(known.method, known.radius, known.crease_angle)


def _remember(work: _MeshWork) -> None:
    known, summary = work.mesh.cdrf, work.summary
    assert summary is not None and work.metric is not None
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
