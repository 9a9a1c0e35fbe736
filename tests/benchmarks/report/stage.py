# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes and lights of the report, and the stage that holds one of each with its materials.

All shapes are as large as those of kappa_choice.py and stand before the same camera. The head is
life size; every other shape stands for a figurine of 6 cm, so that what scatters a few millimetres
can be seen to.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import bmesh
import bpy
import numpy as np
from kappa_choice import EXTENT, LIGHTS, ORTHO_SCALE, Hits, Shape, cast_camera, tree_of, unit
from mathutils import Matrix, Vector
from numpy.typing import NDArray
from rig import Rig, diffuse_material
from scipy.spatial import cKDTree

from cdrf_addon.blender.mesh.attributes import positions
from cdrf_addon.compat import EEVEE, ensure_node_tree

from .settings import Settings
from .substances import Substance, substance

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

DATA = Path(__file__).resolve().parents[2] / "data"
FIGURINE = 60.0
HEAD = 280.0
"""Height of the head in millimetres (tests/data/README.md)."""
SHADOW_OFFSET = 0.002
COVERED = 0.999
"""Opacity from which a pixel counts as the object's."""
OPEN_MARGIN = 0.3
"""Pixels this close to the rim of an open mesh are masked: light escapes through the hole."""
SOFTBOXES = "studio.exr"
"""The HDRI, one of those that come with Blender (CC0)."""


@dataclass(frozen=True)
class Cell:
    """One scene of the matrix."""

    shape: str
    material: str
    lights: str

    @property
    def name(self) -> str:
        """Name for tables and files."""
        return f"{self.shape}, {self.material}, {self.lights}"


# --- shapes --------------------------------------------------------------------------------------


def _smooth(item: bpy.types.Object, level: int) -> None:
    if level:
        modifier = item.modifiers.new("Subdivision", "SUBSURF")
        modifier.levels = modifier.render_levels = level


def _sphere(level: int) -> bpy.types.Object:
    bpy.ops.mesh.primitive_uv_sphere_add(segments=24 * 2**level, ring_count=12 * 2**level)
    return bpy.context.object


def _torus(level: int) -> bpy.types.Object:
    bpy.ops.mesh.primitive_torus_add(
        major_segments=24 * 2**level,
        minor_segments=12 * 2**level,
        major_radius=1.0,
        minor_radius=0.42,
        rotation=(math.radians(55.0), math.radians(15.0), 0.0),
    )
    return bpy.context.object


def _suzanne(level: int) -> bpy.types.Object:
    bpy.ops.mesh.primitive_monkey_add(rotation=(0.0, 0.0, math.radians(-20.0)))
    _smooth(bpy.context.object, level)
    return bpy.context.object


def _import(name: str, level: int) -> bpy.types.Object:
    bpy.ops.wm.obj_import(filepath=str(DATA / name))
    _smooth(bpy.context.object, level)
    return bpy.context.object


def _head(level: int) -> bpy.types.Object:
    return _import("human_head.obj", level)


def _turned_head(level: int) -> bpy.types.Object:
    item = _import("human_head.obj", level)
    item.rotation_euler.rotate(Matrix.Rotation(math.radians(40.0), 3, "Z"))
    return item


def _bunny(level: int) -> bpy.types.Object:
    return _import("stanford_bunny.obj", level)


def _bust(level: int) -> bpy.types.Object:
    """The head with eyes, on a chest and a plinth, all grown together."""
    item = _import("human_head.obj", 0)
    bpy.ops.object.transform_apply(location=True, rotation=True, scale=True)
    # A shell that is open anywhere has no inside to be grown together.
    mesh = bmesh.new()
    mesh.from_mesh(item.data)
    bmesh.ops.holes_fill(mesh, edges=mesh.edges[:], sides=0)
    bmesh.ops.triangulate(mesh, faces=mesh.faces[:])
    mesh.to_mesh(item.data)
    mesh.free()
    size = item.dimensions.z
    base = Vector(NECK)
    parts = [item]
    for side in (-1.0, 1.0):
        parts.append(_ball((EYE_RADIUS,) * 3, Vector((side * EYE[0], *EYE[1:]))))
    for (across, deep, high), below in CHEST:
        place = base - Vector((0.0, 0.0, below * size))
        parts.append(_ball((across * size, deep * size, high * size), place))
    for radius, high, below in PLINTH:
        bpy.ops.mesh.primitive_cylinder_add(vertices=96, radius=radius * size, depth=high * size)
        parts.append(bpy.context.object)
        parts[-1].location = base - Vector((0.0, 0.0, below * size))
    for part in parts:
        part.select_set(True)
    bpy.context.view_layer.objects.active = item
    bpy.ops.object.join()
    grown = item.modifiers.new("Grown together", "REMESH")
    grown.mode, grown.voxel_size = "VOXEL", size * 0.048 / 2.0**level
    soft = item.modifiers.new("Chisel", "SMOOTH")
    soft.factor, soft.iterations = 0.5, 2 + 2 * level
    return item


NECK = (0.0, -0.18, 5.76)
"""Middle of the hole at the neck, in the units of the file; the sockets are EYE to each side."""
EYE, EYE_RADIUS = (0.32, -1.22, 7.285), 0.17
CHEST = (((0.43, 0.24, 0.3), 0.16), ((0.2, 0.17, 0.2), -0.02))
"""Half-axes of balls under the head, and how far below the neck; parts of the head's height."""
PLINTH = ((0.13, 0.16, 0.5), (0.25, 0.08, 0.6))
"""Radius and height of cylinders, and how far below."""


def _ball(axes: Sequence[float], place: Vector) -> bpy.types.Object:
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, location=place)
    bpy.context.object.scale = axes
    return bpy.context.object


@dataclass(frozen=True)
class Kind:
    """A shape: how it is made, and the height in millimetres that it stands for."""

    make: Callable[[int], bpy.types.Object]
    height: float = FIGURINE


SHAPES = {
    "sphere": Kind(_sphere),
    "torus": Kind(_torus),
    "Suzanne": Kind(_suzanne),
    "head": Kind(_head, HEAD),
    "bunny": Kind(_bunny),
    "bust": Kind(_bust),
    "turned head": Kind(_turned_head),
}


def make_shape(name: str, level: int) -> bpy.types.Object:
    """Build a shape at the origin, EXTENT large, smooth, its modifiers and transform applied."""
    item = SHAPES[name].make(level)
    bpy.ops.object.select_all(action="DESELECT")
    item.select_set(True)
    bpy.context.view_layer.objects.active = item
    bpy.ops.object.convert(target="MESH")
    bpy.ops.object.transform_apply(location=True, rotation=True, scale=True)
    bpy.ops.object.shade_smooth()
    places = positions(item.data).reshape(-1, 3).astype(np.float64)
    low, high = places.min(axis=0), places.max(axis=0)
    fit = Matrix.Scale(EXTENT / float((high - low).max()), 4)
    item.data.transform(fit @ Matrix.Translation(-Vector((low + high) / 2.0)))
    item.data.materials.clear()
    item.name = name
    return item


# --- lights --------------------------------------------------------------------------------------


def _sun(rig: Rig) -> None:
    turn = Vector(LIGHTS["left"]).to_track_quat("Z", "Y").to_euler()
    rig.light("SUN", name="Sun", energy=math.pi, angle=0.0, use_shadow=True, rotation=turn)


SOFT = {
    "Key": ((-0.7, -0.6, 0.45), 0.8, 1.5),
    "Fill": ((0.85, -0.6, 0.1), 0.2, 3.0),
    "Rim": ((0.55, 0.75, 0.6), 0.9, 1.0),
}
"""Direction, radiance of a white surface that faces it, diameter."""
SOFT_DISTANCE = 6.0


def _key_fill_rim(rig: Rig) -> None:
    for name, (direction, radiance, size) in SOFT.items():
        towards = Vector(direction).normalized()
        rig.light(
            "AREA",
            name=name,
            shape="DISK",
            size=size,
            energy=radiance * (math.pi * SOFT_DISTANCE) ** 2,
            use_shadow=True,
            location=SOFT_DISTANCE * towards,
            rotation=towards.to_track_quat("Z", "Y").to_euler(),
        )


HDRI_STRENGTH = 0.4


def _hdri(rig: Rig) -> None:
    folder = Path(bpy.utils.system_resource("DATAFILES")) / "studiolights" / "world"
    tree = ensure_node_tree(rig.scene.world)
    picture = tree.nodes.new("ShaderNodeTexEnvironment")
    picture.image = bpy.data.images.load(str(folder / SOFTBOXES))
    background = tree.nodes["Background"]
    background.inputs["Strength"].default_value = HDRI_STRENGTH
    tree.links.new(picture.outputs["Color"], background.inputs["Color"])
    # EEVEE would take the softboxes together for one sun with a hard shadow (matrix.sun_taken_out).
    rig.scene.world.sun_threshold = 0.0


RIGS: dict[str, Callable[[Rig], None]] = {
    "sun": _sun,
    "key + fill + rim": _key_fill_rim,
    "HDRI": _hdri,
}

MATERIALS = ("skin", "marble", "milk")
MATRIX = [
    Cell(shape, material, lights)
    for lights in RIGS
    for material in MATERIALS
    for shape in ("head", "sphere", "bust", "bunny", "Suzanne", "torus")
]
FIRST = [
    Cell("head", "skin", "sun"),
    Cell("sphere", "skin", "sun"),
    Cell("bust", "marble", "key + fill + rim"),
    Cell("bunny", "milk", "sun"),
    Cell("Suzanne", "marble", "sun"),
    Cell("torus", "milk", "sun"),
    Cell("head", "skin", "HDRI"),
    Cell("head", "skin", "key + fill + rim"),
    Cell("bust", "marble", "sun"),
    Cell("sphere", "milk", "HDRI"),
    Cell("Suzanne", "skin", "key + fill + rim"),
]
"""What is measured first, with all contenders, and shown: every shape, material and light."""
CELLS = [*FIRST, *(cell for cell in MATRIX if cell not in FIRST)]


# --- what the camera sees ------------------------------------------------------------------------


@dataclass(frozen=True)
class Geometry:
    """A shape as arrays, with the point in the middle of every pixel."""

    shape: Shape
    corners: Array | None
    """UV of the triangles' corners, (n, 3, 2), or None."""
    hits: Hits

    @property
    def normal(self) -> Array:
        """Smooth normal at each hit, (p, 3)."""
        return unit(self.hits.interpolate(self.shape, self.shape.normals))

    @cached_property
    def tree(self) -> Any:
        """The shape, ready for rays."""
        return tree_of(self.shape)

    def visible(self, places: Array, normals: Array, light: bpy.types.Object) -> Mask:
        """Tell which places on the surface a light's centre reaches, by rays."""
        towards = directions(light, places)
        starts = places + SHADOW_OFFSET * normals
        far = np.linalg.norm(np.array(light.location) - places, axis=1)
        reach = np.full(len(places), 1e3) if light.data.type == "SUN" else far
        hit = (
            self.tree.ray_cast(Vector(start), Vector(way), distance)[0]
            for start, way, distance in zip(starts, towards, reach, strict=True)
        )
        return np.array([place is None for place in hit], dtype=bool)

    def near_rim(self) -> Mask:
        """Tell which hits are next to a hole."""
        rim = self.shape.rim()
        if not len(rim):
            return np.zeros(len(self.hits.pixel), dtype=bool)
        return np.asarray(cKDTree(rim).query(self.hits.position)[0] < OPEN_MARGIN)


def directions(light: bpy.types.Object, places: Array) -> Array:
    """Unit vectors towards a light, (n, 3)."""
    if light.data.type == "SUN":
        along = np.array(light.matrix_world)[:3, 2]
        return np.broadcast_to(along / np.linalg.norm(along), places.shape)
    return unit(np.array(light.location) - places)


def read_geometry(item: bpy.types.Object, size: int) -> Geometry:
    """Read a mesh object without modifiers, and cast the camera's rays."""
    mesh = item.data
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    loops = np.empty(3 * count, dtype=np.int32)
    mesh.loop_triangles.foreach_get("loops", loops)
    vertices = np.empty(3 * count, dtype=np.int32)
    mesh.loop_triangles.foreach_get("vertices", vertices)
    normals = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertex_normals.foreach_get("vector", normals)
    corners = None
    if mesh.uv_layers.active is not None:
        uv = np.empty(2 * len(mesh.loops), dtype=np.float32)
        mesh.uv_layers.active.uv.foreach_get("vector", uv)
        corners = uv.reshape(-1, 2)[loops].reshape(-1, 3, 2).astype(np.float64)
    shape = Shape(
        item.name,
        positions(mesh).reshape(-1, 3).astype(np.float64),
        vertices.reshape(-1, 3).astype(np.int64),
        normals.reshape(-1, 3).astype(np.float64),
    )
    return Geometry(shape, corners, cast_camera(shape, size))


# --- the stage -----------------------------------------------------------------------------------


class Stage:
    """A cell as a scene: one object, its lights, and the materials it may wear."""

    def __init__(self, cell: Cell, settings: Settings, size: int = 0) -> None:
        self.cell, self.settings = cell, settings
        self.size = size or settings.size
        self.rig = Rig(ORTHO_SCALE)
        self.item = make_shape(cell.shape, settings.level)
        RIGS[cell.lights](self.rig)
        self.substance: Substance = substance(cell.material)
        self.millimetres = SHAPES[cell.shape].height / EXTENT
        self.scene = self.rig.scene
        # By default EEVEE fades lamps out with distance: a weak one loses a quarter of its light.
        self.scene.eevee.light_threshold = 0.0
        self.wax = self._wax()
        self.opaque = diffuse_material(self.substance.albedo)
        self.principled = self._principled()
        self.wear(self.wax)
        render = self.scene.render
        render.resolution_x = render.resolution_y = self.size
        render.filter_size = 1.5
        bpy.context.view_layer.update()

    @cached_property
    def geometry(self) -> Geometry:
        """What the camera sees."""
        return read_geometry(self.item, self.size)

    @property
    def lights(self) -> list[bpy.types.Object]:
        """All lights but the world."""
        return [item for item in self.scene.objects if item.type == "LIGHT"]

    @property
    def sigma0(self) -> Array:
        """Scatter distance of each channel, units."""
        return self.substance.sigma0(self.millimetres)

    def _wax(self) -> bpy.types.Material:
        material = bpy.data.materials.new("Wax")
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

    def wear(self, material: bpy.types.Material) -> None:
        """Put a material on the object, which stays selected and active."""
        self.item.data.materials.clear()
        self.item.data.materials.append(material)
        bpy.ops.object.select_all(action="DESELECT")
        self.item.select_set(True)
        bpy.context.view_layer.objects.active = self.item
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
