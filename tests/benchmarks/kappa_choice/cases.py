# SPDX-License-Identifier: GPL-3.0-or-later
"""Path-traced references, and the pixels of a shape and a material under all lights."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray
from rig import Rig

from cdrf_addon.compat import ensure_node_tree

from ..common.arrays import Array
from ..common.rays import ORTHO_SCALE, Hits, cast_camera, near_rim, reached, tree_of, unit
from ..common.shapes import Shape, to_blender
from .kernels import SIGMA_MOST, SIGMA_NODES, THETA_NODES
from .settings import ALBEDO, BOUNCES, LIGHTS, RATIO, SCALES


@dataclass(frozen=True)
class SssMaterial:
    """A material of the references: scale of the radii RATIO, and one albedo for all channels."""

    scale: float
    albedo: float = ALBEDO


MATERIALS = [SssMaterial(scale) for scale in SCALES]


def render_reference(
    shape: Shape,
    material: SssMaterial,
    towards: Sequence[float],
    size: int,
    samples: int,
    bounces: int,
) -> Array:
    """Path-trace the shape; (size * size, 3), where 1 is a white surface facing the sun.

    Args:
        shape: At its place before the camera.
        material: Of its subsurface scattering.
        towards: Direction towards the sun.
        size: Pixels each way.
        samples: Paths through a pixel.
        bounces: Of light from surface to surface.
    """
    rig = Rig(ORTHO_SCALE)
    scene = rig.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = size
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.samples = samples
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = True
    cycles.denoiser = "OPENIMAGEDENOISE"
    cycles.max_bounces = bounces
    cycles.seed = 1
    # A pixel is the point in its middle, where the rays of `cast_camera` go.
    cycles.pixel_filter_type = "BOX"
    cycles.filter_width = 0.01
    cycles.sample_clamp_indirect = 0.0
    turn = Vector(towards).to_track_quat("Z", "Y").to_euler()
    rig.light("SUN", energy=math.pi, angle=0.0, use_shadow=True, rotation=turn)
    obj = to_blender(shape.vertices, shape.triangles)
    made = bpy.data.materials.new("Subsurface")
    tree = ensure_node_tree(made)
    tree.nodes.clear()
    scatter = tree.nodes.new("ShaderNodeSubsurfaceScattering")
    scatter.falloff = "RANDOM_WALK"
    scatter.inputs["Color"].default_value = (material.albedo,) * 3 + (1.0,)
    scatter.inputs["Radius"].default_value = RATIO
    scatter.inputs["Scale"].default_value = material.scale
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(scatter.outputs["BSSRDF"], output.inputs["Surface"])
    obj.data.materials.append(made)
    return rig.render()[..., :3].reshape(-1, 3)


@dataclass
class Case:
    """A shape and a material under all lights: pixels of one light after those of another."""

    shape: str
    scale: float
    hits: Hits
    theta: Array
    tangent: Array
    """Unit direction towards the light along the surface."""
    reference: Array
    masks: dict[str, str]
    albedo: float = ALBEDO

    def __post_init__(self) -> None:
        place = self.theta / math.pi * (THETA_NODES - 1)
        self._lower = np.minimum(place.astype(np.int64), THETA_NODES - 2)
        self._part = (place - self._lower)[:, None]
        self._rows: dict[str, NDArray[np.float32]] = {}

    @property
    def name(self) -> str:
        """Name for tables."""
        return f"{self.shape} {self.scale:g}"

    def prepare(self, kernel: str, table: Array) -> None:
        """Keep the kernel's row for the angle of every pixel."""
        rows = table[self._lower] * (1.0 - self._part) + table[self._lower + 1] * self._part
        self._rows[kernel] = np.ascontiguousarray(rows, dtype=np.float32)

    def take(self, keep: NDArray[Any]) -> Case:
        """Choose pixels."""
        arrays = self.theta[keep], self.tangent[keep], self.reference[keep]
        part = Case(self.shape, self.scale, self.hits.take(keep), *arrays, self.masks, self.albedo)
        part._rows = {kernel: rows[keep] for kernel, rows in self._rows.items()}
        return part

    def image(self, kernel: str, sigma: Array) -> Array:
        """Radiance of one channel at widths given per pixel."""
        rows = self._rows[kernel]
        place = np.sqrt(np.clip(sigma / SIGMA_MOST, 0.0, 1.0)) * (SIGMA_NODES - 1)
        lower = np.minimum(place.astype(np.int64), SIGMA_NODES - 2)
        part = place - lower
        flat = lower + np.arange(len(rows)) * SIGMA_NODES
        values = rows.ravel()
        return np.asarray(self.albedo * (values[flat] * (1.0 - part) + values[flat + 1] * part))

    def lambert(self) -> float:
        """RMSE without scattering, mean over R, G, B."""
        off = self.albedo * np.maximum(np.cos(self.theta), 0.0)[:, None] - self.reference
        return float(np.sqrt((off**2).mean(axis=0)).mean())

    def error(self, kernel: str, channel: int, sigma: Array) -> float:
        """RMSE of one channel."""
        off = self.image(kernel, sigma) - self.reference[:, channel]
        return float(np.sqrt((off**2).mean()))


def make_cases(
    shape: Shape,
    cache: Path,
    size: int,
    samples: int,
    bounces: int = BOUNCES,
    materials: Sequence[SssMaterial] = MATERIALS,
) -> list[Case]:
    """Render what is not in the cache yet, and mask out what no local shading can know.

    Args:
        shape: Of all cases.
        cache: Folder of the renders.
        size: Pixels each way.
        samples: Paths through a pixel.
        bounces: Of light from surface to surface.
        materials: One case each.
    """
    hits = cast_camera(shape, size)
    normal = unit(hits.interpolate(shape, shape.normals))
    tree = tree_of(shape)
    at_rim = near_rim(shape, hits)
    cases = []
    for material in materials:
        parts: list[tuple[Any, ...]] = []
        masks = {}
        for label, direction in LIGHTS.items():
            light = np.array(direction) / np.linalg.norm(direction)
            colour = "" if material.albedo == ALBEDO else f"-{material.albedo:g}"
            key = f"{shape.name}-{material.scale:g}{colour}-{label}-{size}-{samples}-{bounces}.npz"
            if not (cache / key).exists():
                start = time.perf_counter()
                picture = render_reference(shape, material, tuple(light), size, samples, bounces)
                np.savez_compressed(cache / key, picture=picture.astype(np.float32))
                print(f"  {key}: {time.perf_counter() - start:.0f} s", flush=True)
            picture = np.load(cache / key)["picture"].astype(np.float64)
            cosine = normal @ light
            towards = np.broadcast_to(light, normal.shape)
            shadow = (cosine > 0.0) & ~reached(tree, hits.position, normal, towards)
            keep = np.flatnonzero(~shadow & ~at_rim)
            masks[label] = (
                f"{len(keep)} of {len(cosine)} pixels used, {int(shadow.sum())} in cast shadow, "
                f"{int((at_rim & ~shadow).sum())} near the rim, "
                f"{int((cosine[keep] <= 0.0).sum())} of those used face away from the sun"
            )
            across = unit(light - cosine[keep, None] * normal[keep])
            angle = np.arccos(np.clip(cosine[keep], -1.0, 1.0))
            parts.append((keep, angle, across, picture[hits.pixel[keep]]))
        chosen, theta, tangent, reference = map(np.concatenate, zip(*parts, strict=True))
        pixels = hits.take(chosen), theta, tangent, reference
        cases.append(Case(shape.name, material.scale, *pixels, masks, material.albedo))
    return cases
