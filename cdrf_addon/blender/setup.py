# SPDX-License-Identifier: GPL-3.0-or-later
"""The main job in order: from objects to translucent materials, in steps that can be cancelled.

`Setup.steps` gathers and computes and changes nothing the artist would see; `Setup.commit` writes
everything at once. Whatever fails, fails before the first write.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Mapping, Sequence

import bpy
import numpy as np

from .. import ids
from ..core.curvature.field import Options
from ..core.curvature.summary import FLAT
from ..core.errors import CdrfError, DependencyError
from .display import curvature
from .lights.scene_lights import SceneLight
from .material import linking, settings
from .material.install import cdrf_node, install, is_mapped
from .material.lighting import lights_of_translucent
from .material.model import ensure_chosen, model_key
from .material.scatter_distance import choose_detail, set_scattering
from .material.scattering import Scattering, read_scattering
from .material.shader_group import remove_unused
from .material.shadow_choice import choose_shadows
from .material.specular import add_specular
from .material.translucent import materials_on, translucent_materials_of
from .material.walk import ON, UNSET, walk_for, write_mean_curvature
from .mesh_work import (
    MeshWork,
    group_by_mesh,
    instance_metrics,
    keep_linked,
    measure_steps,
    source_for,
    store,
)
from .nodes.tables import adopt_table
from .report import Report, unseen_translucency, unsupported_lights
from .selection import select, users_of
from .shader.bits import MOST_SELECTIVE
from .shader.group import ensure_shader_group
from .shader.variant import CONSTANT, Variant, variant_of
from .world.light import WorldLight, world_light
from .world.surface import is_world_animated, scene_world

# sigma at the median curvature with the first scatter distance: visible, not yet waxy.
FIRST_SIGMA = 0.25


class Setup:
    """Makes objects translucent, or brings translucent ones up to date.

    Args:
        context: For the scene, the view layer and the dependency graph.
        objects: What to work on; other users of the same materials are included.
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
        self.world: WorldLight | None = None
        self.selection = select(
            self.scene,
            self.view_layer,
            list(objects),
            only_active_slot=only_active_slot,
            convert=convert,
        )
        users = users_of(self.selection, self.view_layer)
        self.work = group_by_mesh(users)
        self.instances = instance_metrics(users, self.depsgraph)
        self.report = Report(warnings=self.selection.warnings)

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
                for part in self._mesh_steps(work):
                    yield (done + part * size) / total, f"Curvature of {work.users[0].name}"
            except DependencyError:
                raise
            except CdrfError as error:
                if len(self.work) == 1:
                    raise
                self.work.remove(work)
                self.selection.leave_out(work.mesh, work.users)
                self.report.warnings.append(f"Left out: {error}")
            done += size
        yield 1.0, "The world's light"
        self._read_world()

    def _mesh_steps(self, work: MeshWork) -> Generator[float, None, None]:
        if work.mesh.is_editable:
            yield from measure_steps(
                work,
                self.view_layer,
                self.depsgraph,
                options=self.options,
                instances=self.instances,
                recompute=self.recompute,
            )
        else:
            self.report.warnings += keep_linked(work)
            yield 1.0

    def _read_world(self) -> None:
        """Read the world's light; without it the lights still shine."""
        found = scene_world(self.scene, self.view_layer)
        try:
            self.world = world_light(found, again=self.recompute)
        except CdrfError as error:
            self.report.warnings.append(str(error))
        if found is not None and self.world is not None and is_world_animated(found):
            self.report.warnings.append(
                f"The world '{found.name}' is animated: its strength is followed, the rest is that "
                f"of frame {self.scene.frame_current}."
            )

    # --- writing ------------------------------------------------------------------------------

    def commit(self) -> Report:
        """Write attributes, groups and materials; the only part that changes the file."""
        # Read first: what fails here fails before the first write.
        found = self._read_nodes()
        self._give_materials()
        lights = lights_of_translucent(self.scene, self.view_layer, self.selection.objects)
        sources = {
            material: source_for(self._work_with(material))
            for material in dict.fromkeys(slot.material for slot in self.selection.slots)
        }
        for work in self.work:
            store(work, sources)
        for material, source in sources.items():
            reaching = linking.lights_reaching(lights, material, self.view_layer)
            self._make_translucent(material, source, reaching, found.get(material))
        linking.write_unlit()
        curvature.refresh(self.scene, translucent_materials_of(self.view_layer))
        remove_unused()
        self._complete_report(lights, sources)
        return self.report

    def _read_nodes(self) -> dict[bpy.types.Material, Scattering]:
        """Read the scattering of materials for which nobody has chosen a scatter distance yet."""
        found = {
            slot.material: read_scattering(slot.material)
            for slot in self.selection.slots
            if slot.material is not None
            and cdrf_node(slot.material) is None
            and not settings.is_sigma0_chosen(slot.material)
        }
        return {material: own for material, own in found.items() if own is not None}

    def _give_materials(self) -> None:
        """Fill empty slots, and put copies in the place of linked materials."""
        selection = self.selection
        for obj in selection.bare:
            obj.data.materials.append(_new_material(obj.name))
            selection.slots.append(obj.material_slots[0])
        for slot in selection.slots:
            if slot.material is None:
                slot.material = _new_material(slot.id_data.name)
        copies: dict[bpy.types.Material, bpy.types.Material] = {}
        for slot in selection.linked_slots:
            linked = slot.material
            if linked not in copies:
                copies[linked] = linked.copy()
                adopt_table(model_key(linked))
                self.report.warnings.append(
                    f"'{linked.name}' is linked: a copy of it is lit by this scene."
                )
            if not slot.id_data.data.is_editable:
                slot.link = "OBJECT"
            slot.material = copies[linked]
            selection.slots.append(slot)

    def _work_with(self, material: bpy.types.Material) -> list[MeshWork]:
        return [
            work for work in self.work if any(material in materials_on(obj) for obj in work.users)
        ]

    def _make_translucent(
        self,
        material: bpy.types.Material,
        source: str,
        lights: list[SceneLight],
        own: Scattering | None,
    ) -> None:
        """Give a material its shader group and, if it is new, its first settings.

        Args:
            material: Any of the job.
            source: Where it reads kappa.
            lights: Those that reach it.
            own: What its own nodes scatter, where that is to be its scatter distance.
        """
        before = cdrf_node(material)
        had_detail = before is not None and ids.DETAIL_SIZE in before.inputs
        variant = self._variant(material, source, lights)
        node = install(material, self._shader_group(variant, lights))
        work = self._work_with(material)
        if before is None:
            self._first_settings(material, own, work)
        wanted = settings.wants_specular if before is None else settings.is_specular
        if wanted(material):
            # The artist's node may have changed since, or been removed.
            add_specular(material)
        if variant.mapped and not had_detail:
            choose_detail(material)
        if source == CONSTANT:
            kappas = [each.mean_values[0] for each in work]
            node.inputs[ids.CURVATURE].default_value = float(np.mean(kappas))
            write_mean_curvature(material, [each.mesh for each in work])

    def _variant(
        self, material: bpy.types.Material, source: str, lights: list[SceneLight]
    ) -> Variant:
        ratio = settings.sigma0_ratio(material)
        model, warning = ensure_chosen(material)
        if warning:
            self.report.warnings.append(warning)
        return variant_of(
            ratio,
            source,
            model,
            mapped=is_mapped(material),
            occluded=settings.is_occluded(material),
            shadows=choose_shadows(material, self.view_layer),
            links=linking.links_of(lights),
            walk=walk_for(material, model),
        )

    def _shader_group(self, variant: Variant, lights: list[SceneLight]) -> bpy.types.ShaderNodeTree:
        group = ensure_shader_group(variant, self.scene, lights, self.world)
        beyond = linking.without_bit(group)
        if beyond:
            self.report.warnings.append(
                f"More than {MOST_SELECTIVE} lights are linked to some of the objects that "
                f"share a material: '{beyond[0]}' shines on all of them. Use more materials."
            )
        return group

    def _first_settings(
        self, material: bpy.types.Material, own: Scattering | None, work: Sequence[MeshWork]
    ) -> None:
        """Give a new node what was chosen before, what its nodes scatter, or a first guess."""
        settings.write_to_node(material)
        if own is not None:
            chosen = material.cdrf.chosen_view
            set_scattering(material, own)
            if chosen != UNSET:
                settings.set_view_dependent(material, chosen == ON)
            self.report.read.append(material.name)
            notes = own.notes_for(settings.is_view_dependent(material))
            self.report.warnings += [f"'{material.name}': {note}" for note in notes]
        elif not settings.is_sigma0_chosen(material):
            settings.set_sigma0(material, _first_sigma0(work))

    def _complete_report(
        self, lights: Sequence[SceneLight], sources: Mapping[bpy.types.Material, str]
    ) -> None:
        report = self.report
        report.count(self.work, len(sources))
        users = {obj for work in self.work for obj in work.users}
        report.warnings += unsupported_lights(lights, users, self.view_layer, self.depsgraph)
        is_lit = bool(lights) or self.world is not None
        report.warnings += unseen_translucency(self.scene, is_lit=is_lit)


def run(job: Setup) -> Report:
    """Do a whole job at once."""
    for _ in job.steps():
        pass
    return job.commit()


def _new_material(name: str) -> bpy.types.Material:
    material = bpy.data.materials.new(f"{name} Translucent")
    # Blender's defaults for a new material are nobody's choice.
    settings.set_specular(material, False)
    return material


def _first_sigma0(work: Iterable[MeshWork]) -> float:
    """Choose a sigma0 at which the middle of the mesh is visibly translucent, in two digits."""
    medians = [each.median for each in work if each.kind != FLAT and each.median > 0.0]
    if not medians:
        return 0.0
    return float(f"{FIRST_SIGMA / float(np.median(medians)):.2g}")
