# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene of the matrix in Blender: one object, its lights, and its materials."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property

import bpy
import numpy as np
from rig import Rig, diffuse_material

from cdrf_addon.compat import EEVEE, ensure_node_tree

from ..common.arrays import Array, Mask
from ..common.rays import ORTHO_SCALE
from ..common.shapes import EXTENT
from .cells import Cell
from .geometry import Geometry, read_geometry
from .lights import RIGS, directions
from .settings import Settings
from .shapes import SHAPES, make_shape
from .substances import Substance, substance

COVERED = 0.999
"""Opacity from which a pixel counts as the object's."""


class Stage:
    """A cell as a scene: one object, its lights, and its materials."""

    def __init__(self, cell: Cell, settings: Settings, size: int = 0) -> None:
        self.cell, self.settings = cell, settings
        self.size = size or settings.size
        self.rig = Rig(ORTHO_SCALE)
        self.obj = make_shape(cell.shape, settings.level)
        RIGS[cell.lights](self.rig)
        self.substance: Substance = substance(cell.material)
        self.millimetres = SHAPES[cell.shape].height / EXTENT
        self.scene = self.rig.scene
        # By default EEVEE fades lamps out with distance: a weak one loses a quarter of its light.
        self.scene.eevee.light_threshold = 0.0
        self.scattering = self._scattering()
        self.opaque = diffuse_material(self.substance.albedo)
        self.principled = self._principled()
        self.assign(self.scattering)
        render = self.scene.render
        render.resolution_x = render.resolution_y = self.size
        render.filter_size = 1.5
        bpy.context.view_layer.update()

    @cached_property
    def geometry(self) -> Geometry:
        """What the camera sees."""
        return read_geometry(self.obj, self.size)

    @property
    def lights(self) -> list[bpy.types.Object]:
        """All lights but the world."""
        return [obj for obj in self.scene.objects if obj.type == "LIGHT"]

    @property
    def sigma0(self) -> Array:
        """Scatter distance of each channel, units."""
        return self.substance.sigma0(self.millimetres)

    def use_method(self, method: str) -> None:
        """Let both scattering materials take another subsurface method, at the same sigma0."""
        radius = self.substance.radius(self.millimetres, method)
        for material, node_type, setting, name in (
            (self.scattering, "SUBSURFACE_SCATTERING", "falloff", "Radius"),
            (self.principled, "BSDF_PRINCIPLED", "subsurface_method", "Subsurface Radius"),
        ):
            node = next(one for one in material.node_tree.nodes if one.type == node_type)
            setattr(node, setting, method)
            node.inputs[name].default_value = radius

    def _scattering(self) -> bpy.types.Material:
        material = bpy.data.materials.new("Subsurface")
        tree = ensure_node_tree(material)
        tree.nodes.clear()
        scatter = tree.nodes.new("ShaderNodeSubsurfaceScattering")
        scatter.falloff = "RANDOM_WALK"
        scatter.inputs["Color"].default_value = (*self.substance.albedo, 1.0)
        scatter.inputs["Radius"].default_value = self.substance.radius(self.millimetres)
        scatter.inputs["Scale"].default_value = 1.0
        output = tree.nodes.new("ShaderNodeOutputMaterial")
        tree.links.new(scatter.outputs["BSSRDF"], output.inputs["Surface"])
        return material

    def _principled(self) -> bpy.types.Material:
        material = bpy.data.materials.new("Principled")
        nodes = ensure_node_tree(material).nodes
        node = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
        node.inputs["Base Color"].default_value = (*self.substance.albedo, 1.0)
        node.inputs["Subsurface Weight"].default_value = 1.0
        node.inputs["Subsurface Radius"].default_value = self.substance.radius(self.millimetres)
        node.inputs["Subsurface Scale"].default_value = 1.0
        # The question is how light scatters, not how it shines.
        node.inputs["Specular IOR Level"].default_value = 0.0
        return material

    def assign(self, material: bpy.types.Material) -> None:
        """Assign a material to the object, which stays selected and active."""
        self.obj.data.materials.clear()
        self.obj.data.materials.append(material)
        bpy.ops.object.select_all(action="DESELECT")
        self.obj.select_set(True)
        bpy.context.view_layer.objects.active = self.obj
        bpy.context.view_layer.update()

    @contextmanager
    def without_shadows(self) -> Iterator[None]:
        """Let nothing in EEVEE's scene cast a shadow meanwhile.

        By the scene's switch: a light that casts none still costs EEVEE what shadows cost.
        """
        self._cast_shadows(False)
        try:
            yield
        finally:
            self._cast_shadows(True)

    def _cast_shadows(self, cast: bool) -> None:
        self.scene.eevee.use_shadows = cast
        # A change not yet taken up would be taken up anew by every viewport draw: a fifth more.
        bpy.context.view_layer.update()

    def eevee(self, samples: int) -> Array:
        """Render as it is with EEVEE; (size, size, 4), linear, row 0 at the bottom."""
        self.scene.render.engine = EEVEE
        self.scene.eevee.taa_render_samples = samples
        return self.rig.render()

    def cycles(self, samples: int, seed: int, *, denoise: bool = False, bounces: int = 0) -> Array:
        """Path-trace as it is; without `bounces` no light goes from surface to surface."""
        self.scene.render.engine = "CYCLES"
        cycles = self.scene.cycles
        cycles.device, cycles.samples, cycles.seed = "CPU", samples, seed
        cycles.use_adaptive_sampling = False
        cycles.use_denoising = denoise
        cycles.denoiser = "OPENIMAGEDENOISE"
        cycles.max_bounces = bounces
        cycles.sample_clamp_indirect = 0.0
        return self.rig.render()

    def masks(self, pictures: Sequence[Array]) -> dict[str, Mask]:
        """Pixels that count, (size, size) each.

        Returns:
            `all`: those the object covers wholly in every picture; `lit`: of these, the ones that
            are in no light's cast shadow and not next to a hole in the mesh.
        """
        covered = np.all([picture[..., 3] > COVERED for picture in pictures], axis=0)
        geometry = self.geometry
        hits, normal = geometry.hits, geometry.normal
        clear = ~geometry.near_rim()
        for light in self.lights:
            faces = (normal * directions(light, hits.position)).sum(axis=1) > 0.0
            clear &= ~faces | geometry.visible(hits.position, normal, light)
        lit = np.zeros(self.size**2, dtype=bool)
        lit[hits.pixel] = clear
        return {"all": covered, "lit": covered & lit.reshape(self.size, self.size)}
