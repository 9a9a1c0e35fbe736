# SPDX-License-Identifier: GPL-3.0-or-later
"""Which curvature, at which length: writes results/kappa_choice.md and data/kappa_choice.json.

    ./dev python tests/benchmarks/kappa_choice.py                         everything
    ./dev python tests/benchmarks/kappa_choice.py --only interpolation    one part, or several
    ./dev python tests/benchmarks/kappa_choice.py --only                  the page from the JSON

Everything takes about half an hour on two cores, half of it path tracing; renders are kept in the
folder given by --cache and used again. No EEVEE is involved: every pixel's normal and curvature are
interpolated from the vertices in NumPy, and the reflectance is evaluated there, so that only the
choice of the curvature shows.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "support")]

import bpy  # noqa: E402  (the checkout must be importable first)
import igl  # noqa: E402
import numpy as np  # noqa: E402
from machine import machine  # noqa: E402
from mathutils import Vector  # noqa: E402
from mathutils.bvhtree import BVHTree  # noqa: E402
from numpy.typing import NDArray  # noqa: E402
from rig import Rig  # noqa: E402
from scipy.optimize import minimize_scalar  # noqa: E402
from scipy.sparse.linalg import splu  # noqa: E402
from scipy.spatial import cKDTree  # noqa: E402

from cdrf_addon.compat import ensure_node_tree  # noqa: E402
from cdrf_addon.core.reflectance.ring import reflectance  # noqa: E402

Array = NDArray[np.float64]

SEED = 20111106
LEVEL = 2
OTHER_LEVELS = (1, 3)
EXTENT = 2.7864
"""Every shape is scaled to the height of the head."""
ORTHO_SCALE = 3.0
ALBEDO = 0.9
RATIO = (1.0, 0.35, 0.2)
SCALES = (0.03, 0.1)
LIGHTS = {"left": (-0.85, -0.40, 0.35), "right": (0.95, 0.15, 0.25)}
"""Directions towards the sun; the camera looks along +Y. Two, as a slider must serve them all."""
BOUNCES = 0
"""No light from surface to surface: neither CDRF nor a Diffuse BSDF in EEVEE has it."""
MANY_BOUNCES = 12
SHADOW_OFFSET = 0.002
OPEN_MARGIN = 0.3
"""Pixels this close to the rim of an open mesh are left out: light escapes through the hole."""

FIXED = (0.02, 0.04, 0.08, 0.16, 0.32, 0.64)
FACTORS = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
LADDER_START, LADDER_STEP, LADDER_COUNT = 0.004, 2.0 ** (1.0 / 3.0), 31
LADDER = (0.0, *(LADDER_START * LADDER_STEP**i for i in range(LADDER_COUNT)))
SIGMA0_RANGE = (1e-3, 3.0)
SIGMA0_GRID = 18
RINGS = 2
"""Neighbours in libigl's fit, as the extension's default."""
NOISES = (0.01, 0.05, 0.2)
"""Standard deviations of the vertices along their normals, in median edges."""
PRESMOOTH = (256, 128)
"""Two-stage kinds: the tensor diffused over sqrt(area) / this, its curvedness diffused again."""
QUOTIENTS = (3, 4, 5)
STORED = 4
SLIDER_STEPS = (0.1, 0.25, 0.5, 1.0, 2.0)
RECOMMENDED = ("mean and Gaussian over √area/256, curvedness", 2.0)
PLAIN = "curvedness"

# Kernels are tabulated over theta and sqrt(sigma).
THETA_NODES, SIGMA_NODES, SIGMA_MOST, DEGREES = 2049, 384, 8.0, 1600


# --- the two kernels ---------------------------------------------------------------------------


def sigma_nodes() -> Array:
    """Widths at which the kernels are tabulated."""
    return SIGMA_MOST * np.linspace(0.0, 1.0, SIGMA_NODES) ** 2


def ring_table() -> Array:
    """The paper's reflectance: blur along a circle."""
    theta = np.linspace(0.0, math.pi, THETA_NODES)
    return reflectance(theta[:, None], sigma_nodes()[None, :])


def sphere_table() -> Array:
    """Blur by the heat kernel of the sphere, as a Legendre series; keeps the energy."""
    theta, sigma = np.linspace(0.0, math.pi, THETA_NODES), sigma_nodes()
    cosine = np.cos(theta)

    def damping(degree: int) -> Array:
        return np.exp(-0.5 * degree * (degree + 1) * sigma**2)

    total = 0.25 + 0.5 * cosine[:, None] * damping(1)[None, :]
    before, now = np.ones_like(cosine), cosine
    moment = 0.125  # integral of x P_2 over [0, 1]
    for degree in range(2, DEGREES):
        before, now = now, ((2 * degree - 1) * cosine * now - (degree - 1) * before) / degree
        if degree % 2:
            continue
        damped = damping(degree)
        seen = int((damped > 1e-9).sum())
        total[:, :seen] += (degree + 0.5) * moment * now[:, None] * damped[None, :seen]
        moment *= -(degree - 1) / (degree + 4)
    total[:, 0] = np.maximum(cosine, 0.0)
    return np.asarray(total)


KERNELS: dict[str, Callable[[], Array]] = {"ring": ring_table, "sphere": sphere_table}


# --- shapes and their curvature ----------------------------------------------------------------


@dataclass(frozen=True)
class Shape:
    """A triangle mesh with Blender's smooth normals."""

    name: str
    vertices: Array
    triangles: NDArray[np.int64]
    normals: Array

    @cached_property
    def edge(self) -> float:
        """Median length of an edge."""
        corners = self.vertices[self.triangles]
        return float(np.median(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)))

    @property
    def area(self) -> float:
        """Area of the whole surface."""
        return float(igl.doublearea(self.vertices, self.triangles).sum() / 2.0)

    def rim(self) -> Array:
        """Vertices on the edges of holes, (n, 3)."""
        loops = igl.boundary_facets(self.triangles)
        edges = loops[0] if isinstance(loops, tuple) else loops
        return self.vertices[np.unique(edges)] if len(edges) else np.empty((0, 3))

    def noisy(self, noise: float) -> Shape:
        """Move the vertices along the normals at random, by a part of the median edge."""
        rng = np.random.default_rng(SEED)
        push = rng.normal(0.0, noise * self.edge, (len(self.vertices), 1))
        moved = self.vertices + push * self.normals
        return Shape(f"{self.name}, noisy", moved, self.triangles, self.normals)


def read_obj(path: Path) -> tuple[Array, list[list[int]]]:
    """Read positions and faces, turned to Blender's Z up, centred, EXTENT large."""
    points, faces = [], []
    for line in path.read_text(encoding="utf-8").splitlines():
        kind, *words = line.split() or [""]
        if kind == "v":
            points.append([float(word) for word in words[:3]])
        elif kind == "f":
            faces.append([int(word.split("/")[0]) - 1 for word in words])
    x, y, z = np.array(points).T
    turned = np.stack((x, -z, y), axis=1)
    low, high = turned.min(axis=0), turned.max(axis=0)
    return (turned - (low + high) / 2.0) * (EXTENT / float((high - low).max())), faces


def to_blender(
    vertices: Array, faces: Sequence[Sequence[int]] | NDArray[np.int64]
) -> bpy.types.Object:
    """Link a smooth mesh to the scene."""
    mesh = bpy.data.meshes.new("Shape")
    mesh.from_pydata(vertices, [], faces)
    mesh.shade_smooth()
    item = bpy.data.objects.new("Shape", mesh)
    bpy.context.scene.collection.objects.link(item)
    return item


def subdivided(name: str, path: Path, level: int) -> Shape:
    """Subdivide by Catmull-Clark and triangulate, as Blender does it."""
    Rig()
    item = to_blender(*read_obj(path))
    modifier = item.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = level
    evaluated = item.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    mesh.calc_loop_triangles()
    places = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get("co", places)
    corners = np.empty(3 * len(mesh.loop_triangles), dtype=np.int32)
    mesh.loop_triangles.foreach_get("vertices", corners)
    vertices = places.reshape(-1, 3).astype(np.float64)
    triangles = corners.reshape(-1, 3).astype(np.int64)
    smooth = to_blender(vertices, triangles).data
    smooth.vertex_normals.foreach_get("vector", places)
    return Shape(name, vertices, triangles, places.reshape(-1, 3).astype(np.float64))


SCALARS = ("curvedness", "curvedness^2", "|mean|", "mean", "largest |k|")
TENSOR = slice(len(SCALARS), len(SCALARS) + 6)
"""Columns xx, yy, zz, xy, xz, yz; those of PRESMOOTH follow."""


def curvatures(shape: Shape) -> Array:
    """Everything that gets diffused but the two-stage kinds, at the vertices."""
    *directions, k1, k2, bad = igl.principal_curvature(
        shape.vertices / shape.edge, shape.triangles, RINGS
    )
    if len(bad):
        print(f"  {shape.name}: {len(bad)} vertices without a fit count as flat", flush=True)
    values = [np.where(np.isfinite(k), k, 0.0) / shape.edge for k in (k1, k2)]
    for k in values:
        k[np.asarray(bad, dtype=np.int64)] = 0.0
    tensor = np.zeros((len(shape.vertices), 3, 3))
    for along, k in zip(directions, values, strict=True):
        tensor += k[:, None, None] * np.nan_to_num(along[:, :, None] * along[:, None, :])
    mean = (values[0] + values[1]) / 2.0
    square = (values[0] ** 2 + values[1] ** 2) / 2.0
    largest = np.maximum(np.abs(values[0]), np.abs(values[1]))
    scalars = (np.sqrt(square), square, np.abs(mean), mean, largest)
    six = [tensor[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    return np.stack((*scalars, *six), axis=1)


class Diffusion:
    """One implicit heat step (M + l^2 L / 2) x = M b on a shape."""

    def __init__(self, shape: Shape) -> None:
        self.values = curvatures(shape)
        self._stiffness = -igl.cotmatrix(shape.vertices, shape.triangles)
        self._mass = igl.massmatrix(
            shape.vertices, shape.triangles, igl.MASSMATRIX_TYPE_BARYCENTRIC
        )
        lengths = [math.sqrt(shape.area) / part for part in PRESMOOTH]
        smooth = [_norm(self.at(length)) for length in lengths]
        plain = self.values
        # k1^2 + k2^2 = 4 mean^2 - 2 k1 k2: both parts are signed, so noise averages out of them.
        self.values = np.stack((plain[:, 3], 2.0 * plain[:, 3] ** 2 - plain[:, 1]), axis=1)
        mean, gaussian = self.at(lengths[0]).T
        smooth.append(np.sqrt(np.maximum(2.0 * mean**2 - gaussian, mean**2)))
        self.values = np.column_stack((plain, *smooth))

    def at(self, length: float) -> Array:
        """Diffuse the curvatures over a length; 0 leaves them."""
        values = self.values
        if length == 0.0:
            return values
        system = (self._mass + 0.5 * length**2 * self._stiffness).tocsc()
        right = self._mass @ values
        # Minimum degree is faster on small meshes, and four times slower on half a million faces.
        order = "MMD_AT_PLUS_A" if len(values) < 150_000 else "COLAMD"
        options = {"SymmetricMode": True}
        factors = splu(system, permc_spec=order, diag_pivot_thresh=0.0, options=options)
        return np.asarray(factors.solve(right))


# --- pixels ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Hits:
    """What the camera's rays meet: flat arrays over the pixels that hit."""

    pixel: NDArray[np.int64]
    triangle: NDArray[np.int64]
    weights: Array
    position: Array

    def interpolate(self, shape: Shape, values: Array) -> Array:
        """Interpolate values at the vertices of the shape, (n, k)."""
        corners = values[shape.triangles[self.triangle]]
        return np.einsum("pc,pck->pk", self.weights, corners)

    def take(self, keep: NDArray[Any]) -> Hits:
        """Choose pixels."""
        return Hits(*(array[keep] for array in vars(self).values()))


def tree_of(shape: Shape) -> BVHTree:
    """Make the shape ready for rays."""
    return BVHTree.FromPolygons(shape.vertices.tolist(), shape.triangles.tolist())


def cast_camera(shape: Shape, size: int) -> Hits:
    """Shoot one ray through the middle of every pixel; row 0 at the bottom."""
    tree = tree_of(shape)
    steps = (np.arange(size) + 0.5 - size / 2.0) / size * ORTHO_SCALE
    found = []
    for number, (z, x) in enumerate(itertools.product(steps, steps)):
        place, _, triangle, _ = tree.ray_cast(Vector((x, -10.0, z)), Vector((0.0, 1.0, 0.0)))
        if place is not None:
            found.append((number, triangle, *place))
    table = np.array(found)
    triangle = table[:, 1].astype(np.int64)
    position = table[:, 2:]
    a, b, c = np.moveaxis(shape.vertices[shape.triangles[triangle]], 1, 0)
    weights = igl.barycentric_coordinates(*map(np.ascontiguousarray, (position, a, b, c)))
    weights = np.clip(weights, 0.0, 1.0)
    weights /= weights.sum(axis=1, keepdims=True)
    return Hits(table[:, 0].astype(np.int64), triangle, weights, position)


def unit(vectors: Array) -> Array:
    """Normalise rows."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, 1e-12))


@dataclass(frozen=True)
class Wax:
    """A material of the references: scale of the radii RATIO, and one albedo for all channels."""

    scale: float
    albedo: float = ALBEDO


WAXES = [Wax(scale) for scale in SCALES]


def render_reference(
    shape: Shape, wax: Wax, towards: Sequence[float], size: int, samples: int, bounces: int
) -> Array:
    """Path-trace the shape; (size * size, 3), where 1 is a white surface facing the sun."""
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
    item = to_blender(shape.vertices, shape.triangles)
    material = bpy.data.materials.new("Wax")
    tree = ensure_node_tree(material)
    tree.nodes.clear()
    scatter = tree.nodes.new("ShaderNodeSubsurfaceScattering")
    scatter.falloff = "RANDOM_WALK"
    scatter.inputs["Color"].default_value = (wax.albedo,) * 3 + (1.0,)
    scatter.inputs["Radius"].default_value = RATIO
    scatter.inputs["Scale"].default_value = wax.scale
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(scatter.outputs["BSSRDF"], output.inputs["Surface"])
    item.data.materials.append(material)
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
    waxes: Sequence[Wax] = WAXES,
) -> list[Case]:
    """Render what is not in the cache yet, and mask out what no local shading can know."""
    hits = cast_camera(shape, size)
    normal = unit(hits.interpolate(shape, shape.normals))
    tree = tree_of(shape)
    rim = shape.rim()
    near_rim = np.zeros(len(normal), dtype=bool)
    if len(rim):
        near_rim = cKDTree(rim).query(hits.position)[0] < OPEN_MARGIN
    cases = []
    for wax in waxes:
        parts: list[tuple[Any, ...]] = []
        masks = {}
        for label, direction in LIGHTS.items():
            light = np.array(direction) / np.linalg.norm(direction)
            colour = "" if wax.albedo == ALBEDO else f"-{wax.albedo:g}"
            key = f"{shape.name}-{wax.scale:g}{colour}-{label}-{size}-{samples}-{bounces}.npz"
            if not (cache / key).exists():
                start = time.perf_counter()
                picture = render_reference(shape, wax, tuple(light), size, samples, bounces)
                np.savez_compressed(cache / key, picture=picture.astype(np.float32))
                print(f"  {key}: {time.perf_counter() - start:.0f} s", flush=True)
            picture = np.load(cache / key)["picture"].astype(np.float64)
            cosine = normal @ light
            start_at = hits.position + SHADOW_OFFSET * normal
            blocked = np.array(
                [tree.ray_cast(Vector(p), Vector(light))[0] is not None for p in start_at]
            )
            shadow = (cosine > 0.0) & blocked
            keep = np.flatnonzero(~shadow & ~near_rim)
            masks[label] = (
                f"{len(keep)} of {len(cosine)} pixels used, {int(shadow.sum())} in cast shadow, "
                f"{int((near_rim & ~shadow).sum())} near the rim, "
                f"{int((cosine[keep] <= 0.0).sum())} of those used face away from the sun"
            )
            across = unit(light - cosine[keep, None] * normal[keep])
            angle = np.arccos(np.clip(cosine[keep], -1.0, 1.0))
            parts.append((keep, angle, across, picture[hits.pixel[keep]]))
        chosen, theta, tangent, reference = map(np.concatenate, zip(*parts, strict=True))
        pixels = hits.take(chosen), theta, tangent, reference
        cases.append(Case(shape.name, wax.scale, *pixels, masks, wax.albedo))
    return cases


# --- candidates --------------------------------------------------------------------------------


def _tensor(fields: NDArray[Any]) -> NDArray[Any]:
    xx, yy, zz, xy, xz, yz = np.moveaxis(fields[..., TENSOR], -1, 0)
    rows = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _norm(fields: NDArray[Any]) -> NDArray[Any]:
    six = fields[..., TENSOR] ** 2
    squares = six[..., :3].sum(axis=-1) + 2.0 * six[..., 3:].sum(axis=-1)
    return np.asarray(np.sqrt(squares / 2.0))


Kind = Callable[[NDArray[Any], NDArray[Any]], NDArray[Any]]
TWO_STAGE = "tensor over"
INVARIANTS = "mean and Gaussian over √area/256, curvedness"
KINDS: dict[str, Kind] = {
    "curvedness": lambda fields, _: np.maximum(fields[..., 0], 0.0),
    "RMS curvedness": lambda fields, _: np.sqrt(np.maximum(fields[..., 1], 0.0)),
    "|mean|": lambda fields, _: np.maximum(fields[..., 2], 0.0),
    "signed mean, then |.|": lambda fields, _: np.abs(fields[..., 3]),
    "signed mean, hollows 0": lambda fields, _: np.maximum(fields[..., 3], 0.0),
    "largest |k|": lambda fields, _: np.maximum(fields[..., 4], 0.0),
    "tensor, curvedness": lambda fields, _: _norm(fields),
    "tensor, largest |k|": lambda fields, _: np.abs(np.linalg.eigvalsh(_tensor(fields))).max(-1),
    "tensor, along the light": lambda fields, tangent: np.linalg.norm(
        np.einsum("...pij,pj->...pi", _tensor(fields), tangent), axis=-1
    ),
    f"{TWO_STAGE} √area/256, curvedness": lambda fields, _: np.maximum(fields[..., 11], 0.0),
    f"{TWO_STAGE} √area/128, curvedness": lambda fields, _: np.maximum(fields[..., 12], 0.0),
    INVARIANTS: lambda fields, _: np.maximum(fields[..., 13], 0.0),
}
Rule = tuple[str, float]
"""("raw", 0), ("fixed", l) or ("factor", c), where l = c * sigma0 of the channel."""
RULES: tuple[Rule, ...] = (
    ("raw", 0.0),
    *(("fixed", length) for length in FIXED),
    *(("factor", factor) for factor in FACTORS),
)


def length_of(rule: Rule, sigma0: float) -> float:
    """Length over which the curvature of one channel is diffused."""
    return rule[1] * sigma0 if rule[0] == "factor" else rule[1]


class Levels:
    """The curvature of every pixel of a case at rising lengths, linear in log l in between."""

    def __init__(self, kappa: NDArray[Any], lengths: Sequence[float]) -> None:
        self.kappa = kappa
        self._lengths = np.array(lengths)
        positive = self._lengths[self._lengths > 0.0]
        step = positive[1] / positive[0]
        # Unchanged values, l = 0, stand one step before the first.
        self._log = np.log(np.where(self._lengths > 0.0, self._lengths, positive[0] / step))

    def at(self, length: float) -> Array:
        """Curvature at one length; beyond the ends, that of the end."""
        if length <= 0.0:
            return self.kappa[0].astype(np.float64)
        place = float(np.interp(math.log(length), self._log, np.arange(len(self._log))))
        lower = min(int(place), len(self._log) - 2)
        part = place - lower
        return np.asarray(
            self.kappa[lower] * (1.0 - part) + self.kappa[lower + 1] * part, dtype=np.float64
        )


@dataclass
class Fit:
    """Fitted slider and errors of one candidate on one case."""

    sigma0: float
    rmse: float
    sigma0_channels: list[float]
    rmse_channels: float


def least(objective: Callable[[float], float]) -> tuple[float, float]:
    """Minimise over the logarithm of sigma0: a grid, then a search around its best point."""
    grid = np.linspace(math.log(SIGMA0_RANGE[0]), math.log(SIGMA0_RANGE[1]), SIGMA0_GRID)
    values = [objective(math.exp(x)) for x in grid]
    at = int(np.argmin(values))
    ends = grid[max(at - 1, 0)], grid[min(at + 1, SIGMA0_GRID - 1)]
    found = minimize_scalar(
        lambda x: objective(math.exp(x)), bounds=ends, method="bounded", options={"xatol": 2e-3}
    )
    if found.fun > values[at]:
        return math.exp(grid[at]), values[at]
    return math.exp(found.x), float(found.fun)


def channel_rmse_at(
    case: Case, levels: Levels, rule: Rule, kernel: str, channel: int, sigma0: float
) -> float:
    """RMSE of one channel with its own slider."""
    return case.error(kernel, channel, sigma0 * levels.at(length_of(rule, sigma0)))


def rmse_at(case: Case, levels: Levels, rule: Rule, kernel: str, sigma0: float) -> float:
    """Mean over R, G, B of the RMSE with one slider."""
    errors = [
        channel_rmse_at(case, levels, rule, kernel, channel, sigma0 * ratio)
        for channel, ratio in enumerate(RATIO)
    ]
    return sum(errors) / 3.0


def fit(case: Case, levels: Levels, rule: Rule, kernel: str) -> Fit:
    """Fit the slider, and each channel by itself."""
    sigma0, rmse = least(partial(rmse_at, case, levels, rule, kernel))
    channels = [
        least(partial(channel_rmse_at, case, levels, rule, kernel, channel)) for channel in range(3)
    ]
    each = [value for value, _ in channels]
    return Fit(sigma0, rmse, each, sum(error for _, error in channels) / 3.0)


def pixel_fields(
    shape: Shape, hits: Hits, diffusion: Diffusion, lengths: Iterable[float]
) -> NDArray[np.float32]:
    """Diffused curvatures at the pixels: (lengths, pixels, columns)."""
    return np.stack(
        [hits.interpolate(shape, diffusion.at(length)).astype(np.float32) for length in lengths]
    )


def levels_of(case: Case, fields: NDArray[np.float32]) -> dict[str, Levels]:
    """Every kind of curvature of a case on the ladder."""
    return {
        kind: Levels(make(fields, case.tangent.astype(np.float32)), LADDER)
        for kind, make in KINDS.items()
    }


# --- the study ---------------------------------------------------------------------------------


def rule_name(rule: Rule) -> str:
    """Head of a column."""
    if rule[0] == "raw":
        return "raw"
    return f"l = {rule[1]:g}" if rule[0] == "fixed" else f"{rule[1]:g} σ0"


Candidates = list[tuple[Case, dict[str, Levels]]]


@dataclass(frozen=True)
class Study:
    """Where things are, and how finely to look."""

    shapes: dict[str, Path]
    cache: Path
    size: int
    samples: int

    def shape(self, name: str) -> Shape:
        """Make a shape at the level of the renders."""
        return subdivided(name, self.shapes[name], LEVEL)

    def cases(self, shape: Shape, bounces: int = BOUNCES) -> list[Case]:
        """Make the cases of a shape, ready for both kernels."""
        cases = make_cases(shape, self.cache, self.size, self.samples, bounces)
        for name, make in KERNELS.items():
            table = make()
            for case in cases:
                case.prepare(name, table)
        return cases

    def candidates(self, shape: Shape, cases: list[Case]) -> Candidates:
        """Every kind of curvature at every length, of a shape that may differ from the render's."""
        hits, rows = self.hits(shape)
        fields = pixel_fields(shape, hits, Diffusion(shape), LADDER)
        return [(case, levels_of(case, fields[:, rows[case.hits.pixel]])) for case in cases]

    def hits(self, shape: Shape) -> tuple[Hits, NDArray[np.int64]]:
        """Cast the camera's rays; also the row in the hits of every pixel, or -1."""
        hits = cast_camera(shape, self.size)
        rows = np.full(self.size**2, -1)
        rows[hits.pixel] = np.arange(len(hits.pixel))
        return hits, rows


def measure_fits(study: Study, results: dict[str, Any]) -> None:
    """Fit every candidate to every case, then disturb it."""
    for key in ("cases", "fits", "noise"):
        results[key] = {}
    everything: Candidates = []
    for name in study.shapes:
        shape = study.shape(name)
        cases = study.cases(shape)
        clean = study.candidates(shape, cases)
        for case, levels in clean:
            results["cases"][case.name] = describe(case, shape)
            results["fits"][case.name] = fit_case(case, levels)
            print(f"  {case.name} fitted", flush=True)
        # The rays see the smooth shape; only the curvature is that of the noisy one.
        hits, rows = study.hits(shape)
        for noise in NOISES:
            noisy = shape.noisy(noise)
            rough = pixel_fields(noisy, hits, Diffusion(noisy), LADDER)
            place = results["noise"].setdefault(f"{noise:g}", {})
            for case in cases:
                levels = levels_of(case, rough[:, rows[case.hits.pixel]])
                place[case.name] = errors_of(case, levels, results["fits"][case.name])
        everything += clean
    results["joint"] = joint_fits(everything)


def describe(case: Case, shape: Shape) -> dict[str, Any]:
    """Facts of a case, with the losers that need no curvature."""
    facts: dict[str, Any] = {
        "vertices": len(shape.vertices),
        "edge": shape.edge,
        "area": shape.area,
        "pixels": case.masks,
        "lambert": case.lambert(),
    }
    same = Levels(np.ones((2, len(case.theta))), (1.0, 2.0))
    facts["constant"] = {kernel: vars(fit(case, same, ("raw", 0.0), kernel)) for kernel in KERNELS}
    return facts


def fit_case(case: Case, levels: dict[str, Levels]) -> dict[str, Any]:
    """Fit every candidate."""
    fits: dict[str, Any] = {}
    for kernel, kind, rule in itertools.product(KERNELS, KINDS, RULES):
        place = fits.setdefault(kernel, {}).setdefault(kind, {})
        place[rule_name(rule)] = vars(fit(case, levels[kind], rule, kernel))
    return fits


def errors_of(case: Case, levels: dict[str, Levels], fits: dict[str, Any]) -> dict[str, Any]:
    """RMSE of every candidate with other curvature, the slider left where it was fitted."""
    errors: dict[str, Any] = {}
    for kernel, kind, rule in itertools.product(KERNELS, KINDS, RULES):
        sigma0 = fits[kernel][kind][rule_name(rule)]["sigma0"]
        place = errors.setdefault(kernel, {}).setdefault(kind, {})
        place[rule_name(rule)] = {"rmse": rmse_at(case, levels[kind], rule, kernel, sigma0)}
    return errors


def joint_fits(everything: Candidates) -> dict[str, Any]:
    """Fit one number sigma0 / scale for all cases: does the slider mean the same everywhere?"""
    lambert = [case.lambert() for case, _ in everything]
    result: dict[str, Any] = {}
    for kernel, kind, rule in itertools.product(KERNELS, KINDS, RULES):

        def relative(
            value: float, kernel: str = kernel, kind: str = kind, rule: Rule = rule
        ) -> float:
            errors = [
                rmse_at(case, levels[kind], rule, kernel, value * case.scale / SCALES[-1])
                for case, levels in everything
            ]
            return float(np.mean([e / base for e, base in zip(errors, lambert, strict=True)]))

        at, error = least(relative)
        entry = {"sigma0_over_scale": at / SCALES[-1], "relative_rmse": error}
        result.setdefault(kernel, {}).setdefault(kind, {})[rule_name(rule)] = entry
    return result


RESOLUTION_MOST = 0.6
RESOLUTION_RULES: tuple[Rule, ...] = (
    ("raw", 0.0),
    ("fixed", 0.16),
    ("factor", 2.0),
    ("factor", 4.0),
)


def measure_resolution(study: Study, results: dict[str, Any]) -> None:
    """Take the curvature from a coarser and a finer mesh, the slider from the fit at LEVEL.

    Normals stay those of the render, so that only the curvature shows. Every third step of the
    ladder serves, up to RESOLUTION_MOST for all levels alike: half a million triangles take long.
    """
    head = study.shape("head")
    everything = study.candidates(head, study.cases(head))
    fits = results["fits"]
    steps = [0, *range(1, len(LADDER), 3)]
    steps = [i for i in steps if LADDER[i] < RESOLUTION_MOST]
    ladder = [LADDER[i] for i in steps]
    result = results["resolution"] = {}
    for level in OTHER_LEVELS:
        shape = subdivided("head", study.shapes["head"], level)
        print(f"  head at level {level}: {len(shape.vertices)} vertices", flush=True)
        hits, lookup = study.hits(shape)
        fields = pixel_fields(shape, hits, Diffusion(shape), ladder)
        for case, levels in everything:
            rows = lookup[case.hits.pixel]
            seen = np.flatnonzero(rows >= 0)
            part = case.take(seen)
            for kind, make in KINDS.items():
                new = Levels(make(fields[:, rows[seen]], part.tangent.astype(np.float32)), ladder)
                own = Levels(levels[kind].kappa[steps][:, seen], ladder)
                for kernel, rule in itertools.product(KERNELS, RESOLUTION_RULES):
                    sigma0 = fits[case.name][kernel][kind][rule_name(rule)]["sigma0"]
                    place = result.setdefault(str(level), {}).setdefault(case.name, {})
                    place.setdefault(kernel, {}).setdefault(kind, {})[rule_name(rule)] = {
                        "rmse": rmse_at(part, new, rule, kernel, sigma0),
                        "rmse_own": rmse_at(part, own, rule, kernel, sigma0),
                        "drift": difference(part, new, own, rule, kernel, sigma0),
                    }


def difference(
    case: Case, one: Levels, other: Levels, rule: Rule, kernel: str, sigma0: float
) -> float:
    """RMS difference of two images, mean over the channels."""
    total = 0.0
    for ratio in RATIO:
        own = sigma0 * ratio
        length = length_of(rule, own)
        images = [case.image(kernel, own * levels.at(length)) for levels in (one, other)]
        total += float(np.sqrt(((images[0] - images[1]) ** 2).mean()))
    return total / 3.0


def measure_interpolation(study: Study, results: dict[str, Any]) -> None:
    """Interpolate the curvature from a few stored lengths instead of diffusing it exactly."""
    shape = study.shape("head")
    fits = results["fits"]
    kind, factor = RECOMMENDED
    rule: Rule = ("factor", factor)
    diffusion = Diffusion(shape)
    result = results["interpolation"] = {}
    stored = {}
    for quotient in QUOTIENTS:
        lengths = sorted(math.sqrt(shape.area) / quotient**i for i in range(1, STORED + 1))
        stored[quotient] = (lengths, [diffusion.at(length) for length in lengths])
    for case in study.cases(shape):

        def kappa_of(values: Array, case: Case = case) -> Array:
            fields = case.hits.interpolate(shape, values)
            return KINDS[kind](fields, case.tangent)

        ladders = {
            quotient: Levels(np.stack([kappa_of(v) for v in values]).astype(np.float32), lengths)
            for quotient, (lengths, values) in stored.items()
        }
        for kernel in KERNELS:
            best = fits[case.name][kernel][kind][rule_name(rule)]["sigma0"]
            # The slider at its fit and at other places: the loss depends on where between levels.
            for step in SLIDER_STEPS:
                sigma0 = best * step
                exact = [
                    case.image(kernel, sigma0 * r * kappa_of(diffusion.at(factor * sigma0 * r)))
                    for r in RATIO
                ]
                off = np.stack(exact, axis=1) - case.reference
                truth = float(np.sqrt((off**2).mean(axis=0)).mean())
                entry: dict[str, Any] = {"sigma0": sigma0, "exact": truth}
                for quotient, levels in ladders.items():
                    images = [
                        case.image(kernel, sigma0 * r * levels.at(factor * sigma0 * r))
                        for r in RATIO
                    ]
                    own = rmse_at(case, levels, rule, kernel, sigma0)
                    apart = [
                        float(np.sqrt(((a - b) ** 2).mean()))
                        for a, b in zip(images, exact, strict=True)
                    ]
                    entry[str(quotient)] = {
                        "rmse": own,
                        "lost": own - truth,
                        "difference": sum(apart) / 3.0,
                    }
                place = result.setdefault(case.name, {}).setdefault(kernel, {})
                place[f"{step:g}"] = entry


def measure_bounces(study: Study, results: dict[str, Any]) -> None:
    """Repeat the fits of the head against renders with light from surface to surface."""
    head = study.shape("head")
    result = results["bounces"] = {}
    for case, levels in study.candidates(head, study.cases(head, bounces=MANY_BOUNCES)):
        found = result.setdefault(case.name, {"lambert": case.lambert()})
        for kernel, kind, rule in itertools.product(KERNELS, KINDS, RULES):
            sigma0, rmse = least(partial(rmse_at, case, levels[kind], rule, kernel))
            place = found.setdefault(kernel, {}).setdefault(kind, {})
            place[rule_name(rule)] = {"sigma0": sigma0, "rmse": rmse}


PARTS = {
    "fits": measure_fits,
    "interpolation": measure_interpolation,
    "bounces": measure_bounces,
    "resolution": measure_resolution,
}


# --- the page ----------------------------------------------------------------------------------


def to_table(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> list[str]:
    """Render one table."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    escaped = ([str(cell).replace("|", r"\|") for cell in row] for row in rows)
    lines += ["| " + " | ".join(row) + " |" for row in escaped]
    return [*lines, ""]


def matrix(
    value: Callable[[str, str], float], rules: Sequence[Rule] = RULES, form: str = ".4f"
) -> list[str]:
    """Kinds down, rules across; the best of each matrix in bold."""
    names = [rule_name(rule) for rule in rules]
    numbers = {(kind, name): value(kind, name) for kind in KINDS for name in names}
    least_of_all = min(numbers.values())
    rows = []
    for kind in KINDS:
        cells = [
            f"**{numbers[kind, n]:{form}}**"
            if numbers[kind, n] == least_of_all
            else f"{numbers[kind, n]:{form}}"
            for n in names
        ]
        rows.append([kind, *cells])
    return to_table(["kappa", *names], rows)


def rounded(value: Any) -> Any:
    """Keep five digits of every number: the rest is noise of the renders."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [rounded(item) for item in value]
    return float(f"{value:.5g}") if isinstance(value, float) else value


class Report:
    """Numbers derived from the results, and the page made of them."""

    def __init__(self, results: dict[str, Any]) -> None:
        self.results = results
        self.cases: list[str] = list(results["cases"])

    def relative(
        self, fits: dict[str, Any], kernel: str, kind: str, rule: str, field: str = "rmse"
    ) -> float:
        """RMSE as a part of Lambert's, mean over the cases."""
        parts = [
            fits[case][kernel][kind][rule][field] / self.results["cases"][case]["lambert"]
            for case in self.cases
        ]
        return float(np.mean(parts))

    def both(self, kind: str, rule: str, noise: str = "") -> float:
        """Mean over the two kernels."""
        fits = self.results["noise"][noise] if noise else self.results["fits"]
        return float(np.mean([self.relative(fits, kernel, kind, rule) for kernel in KERNELS]))

    def conclusions(self) -> list[str]:
        """What the numbers say, in sentences."""
        best = [
            f"{kernel}: *{kind}* with {rule} ({error:.3f})"
            for kernel in KERNELS
            for error, kind, rule in [
                min(
                    (self.relative(self.results["fits"], kernel, kind, rule_name(rule)), kind, name)
                    for kind, rule in itertools.product(KINDS, RULES)
                    for name in [rule_name(rule)]
                )
            ]
        ]
        scores = {
            (kind, rule_name(rule)): self.both(kind, rule_name(rule))
            for kind, rule in itertools.product(KINDS, RULES)
        }
        ranked = sorted(scores, key=lambda pair: scores[pair])
        chosen = (RECOMMENDED[0], rule_name(("factor", RECOMMENDED[1])))
        raw = min(scores[kind, "raw"] for kind in KINDS if "√area" not in kind)
        fixed = min(scores[pair] for pair in ranked if pair[1].startswith("l = "))
        constant = float(
            np.mean(
                [
                    self.results["cases"][case]["constant"][kernel]["rmse"]
                    / self.results["cases"][case]["lambert"]
                    for case in self.cases
                    for kernel in KERNELS
                ]
            )
        )
        lines = [
            f"RMSE as a part of Lambert's, one slider, mean over cases and both kernels: best of "
            f"all is *{ranked[0][0]}* with {ranked[0][1]} ({scores[ranked[0]]:.3f}); the choice, "
            f"*{chosen[0]}* with l = {chosen[1]}, has {scores[chosen]:.3f} and is number "
            f"{ranked.index(chosen) + 1} of {len(ranked)}. The best raw curvature has {raw:.3f}, "
            f"the best of one fixed length {fixed:.3f}, one constant curvature {constant:.3f}.",
            f"By kernel the best are {'; '.join(best)}.",
        ]
        plain = min((pair for pair in ranked if pair[0] == PLAIN), key=lambda pair: scores[pair])
        for noise in self.results["noise"]:
            lines.append(
                f"Vertices moved by {100 * float(noise):g} % of an edge, slider left where it was: "
                f"the choice has {self.both(*chosen, noise=noise):.3f}, *{plain[0]}* with "
                f"{plain[1]} {self.both(*plain, noise=noise):.3f} (clean {scores[plain]:.3f}), "
                f"raw *{PLAIN}* {self.both(PLAIN, 'raw', noise=noise):.3f}."
            )
        for quotient in QUOTIENTS if "interpolation" in self.results else ():
            lost, apart = self.interpolation_loss(quotient)
            lines.append(
                f"{STORED} stored lengths a factor {quotient} apart lose at most {lost:.5f} of "
                f"RMSE and change the image by {apart:.5f} RMS at the most."
            )
        return lines

    def interpolation_loss(self, quotient: int) -> tuple[float, float]:
        """Worst loss and worst RMS change over the head's cases, kernels and sliders."""
        entries = [
            entry[str(quotient)]
            for case in self.results["interpolation"].values()
            for kernel in case.values()
            for entry in kernel.values()
        ]
        return max(e["lost"] for e in entries), max(e["difference"] for e in entries)

    def page(self) -> str:
        """Everything, as Markdown."""
        results = self.results
        facts = ", ".join(f"{name} {value}" for name, value in results["machine"].items())
        lines = ["# Which curvature, and over which length", ""]
        lines += ["Generated by `tests/benchmarks/kappa_choice.py`; do not edit.", ""]
        lines += [f"Measured on: {facts}.", "", "## Conclusions", ""]
        lines += [f"- {sentence}" for sentence in self.conclusions()]
        lines += ["", "## Method", "", *self.method(), "", "## Cases", ""]
        head = ["case", "vertices", "edge", "Lambert RMSE"]
        head += [f"constant κ, {kernel}" for kernel in KERNELS]
        rows = [
            [case, f"{c['vertices']:,}", f"{c['edge']:.4f}", f"{c['lambert']:.4f}"]
            + [f"{c['constant'][kernel]['rmse']:.4f}" for kernel in KERNELS]
            for case, c in results["cases"].items()
        ]
        lines += to_table(head, rows)
        lines += [
            f"- {case}, light {light}: {text}."
            for case, c in results["cases"].items()
            for light, text in c["pixels"].items()
        ]
        for field, title in (("rmse", "one slider"), ("rmse_channels", "each channel fitted")):
            for kernel in KERNELS:
                lines += ["", f"## {kernel}, {title}: RMSE / Lambert's, mean over the cases", ""]
                lines += matrix(
                    lambda kind, rule, kernel=kernel, field=field: self.relative(  # type: ignore[misc]
                        results["fits"], kernel, kind, rule, field
                    ),
                    form=".3f",
                )
        for kernel, case in itertools.product(KERNELS, self.cases):
            fits = results["fits"][case][kernel]
            lines += [f"## {kernel}, {case}: RMSE, one slider", ""]
            lines += matrix(lambda kind, rule, fits=fits: fits[kind][rule]["rmse"])  # type: ignore[misc]
        for kernel in KERNELS:
            joint = results["joint"][kernel]
            lines += [f"## {kernel}: one σ0 / scale for all cases, RMSE / Lambert's", ""]
            lines += matrix(
                lambda kind, rule, joint=joint: joint[kind][rule]["relative_rmse"],  # type: ignore[misc]
                form=".3f",
            )
            lines += [f"## {kernel}: fitted σ0 / scale by case, for the chosen rule", ""]
            chosen = rule_name(("factor", RECOMMENDED[1]))
            rows = []
            for kind in KINDS:
                found = [
                    results["fits"][case][kernel][kind][chosen]["sigma0"] for case in self.cases
                ]
                scales = [float(case.rsplit(" ", 1)[1]) for case in self.cases]
                each = [f"{f / s:.2f}" for f, s in zip(found, scales, strict=True)]
                rows.append([kind, *each, f"{joint[kind][chosen]['sigma0_over_scale']:.2f}"])
            lines += to_table(["kappa", *self.cases, "all"], rows)
        for kernel, (noise, errors) in itertools.product(KERNELS, results["noise"].items()):
            title = f"vertices moved by {100 * float(noise):g} % of an edge, slider unchanged"
            lines += [f"## {kernel}, {title}: RMSE / Lambert's", ""]
            lines += matrix(
                lambda kind, rule, kernel=kernel, errors=errors: self.relative(  # type: ignore[misc]
                    errors, kernel, kind, rule
                ),
                form=".3f",
            )
        tables = {
            "resolution": self.resolution_tables,
            "interpolation": self.interpolation_tables,
            "bounces": self.bounce_tables,
        }
        for part, make in tables.items():
            lines += make() if part in results else []
        return "\n".join(lines).rstrip() + "\n"

    def method(self) -> list[str]:
        """How it was measured."""
        size, samples = self.results["size"], self.results["samples"]
        return [
            f"References: Cycles, Random Walk subsurface scattering (node defaults but for colour "
            f"{ALBEDO:g} and radius {RATIO} · scale), one sun without angle, {size}² pixels, "
            f"{samples} samples and Open Image Denoise, world black, Raw, no light from surface "
            f"to surface. Shapes are subdivided twice and {EXTENT:g} units tall; both lights "
            f"({LIGHTS}, directions towards the sun, the camera looking along +Y) share one "
            "slider.",
            "",
            f"A pixel is the point in its middle: ray cast, normals and curvature interpolated "
            f"from the vertices. Left out: pixels in a cast shadow (N·L > 0, N interpolated, while "
            f"a ray to the sun from {SHADOW_OFFSET:g} along N hits anything) and pixels within "
            f"{OPEN_MARGIN:g} of an open rim (the head's neck). Pixels with N·L ≤ 0 all stay.",
            "",
            "RMSE is the mean of those of R, G and B; 1 is a white surface facing the sun; the "
            "gain is the albedo. Curvature: libigl, two rings. Diffusion: (M + l²L/2) x = M b, "
            "once, cotangent L, barycentric M; `c σ0` takes l = c · σ0 of each channel. `tensor`: "
            "the curvature tensor diffused as six world components, the number taken afterwards. "
            "`tensor over √area/n, curvedness`: the tensor diffused over that fixed length, its "
            "curvedness taken at the vertices, and that diffused like the others.",
        ]

    def resolution_tables(self) -> list[str]:
        """Change with the mesh's resolution."""
        names = [rule_name(rule) for rule in RESOLUTION_RULES]
        lines = [
            "## Head, curvature from another subdivision level, slider unchanged",
            "",
            "RMSE / RMSE at its own level (RMS change of the image), mean of cases and kernels; "
            f"lengths above {RESOLUTION_MOST:g} count as that.",
            "",
        ]
        rows = []
        for kind in KINDS:
            row = [kind]
            for level, name in itertools.product(self.results["resolution"].values(), names):
                entries = [
                    case[kernel][kind][name] for case in level.values() for kernel in KERNELS
                ]
                part = np.mean([e["rmse"] / e["rmse_own"] for e in entries])
                row.append(f"{part:.3f} ({np.mean([e['drift'] for e in entries]):.4f})")
            rows.append(row)
        levels = self.results["resolution"]
        head = [f"level {level}, {name}" for level, name in itertools.product(levels, names)]
        return lines + to_table(["kappa", *head], rows)

    def interpolation_tables(self) -> list[str]:
        """Loss by storing four lengths."""
        kind, factor = RECOMMENDED
        lines = [
            f"## Head, *{kind}*, l = {factor:g} σ0, from {STORED} stored lengths √area / qⁱ",
            "",
            "RMSE lost against exact diffusion (RMS change of the image), at parts and multiples "
            "of the fitted slider.",
            "",
        ]
        rows = []
        for case, kernels in self.results["interpolation"].items():
            for kernel, steps in kernels.items():
                for step, entry in steps.items():
                    cells = [
                        f"{entry[str(q)]['lost']:+.5f} ({entry[str(q)]['difference']:.5f})"
                        for q in QUOTIENTS
                    ]
                    row = [case, kernel, f"{step} × {entry['sigma0'] / float(step):.3f}"]
                    rows.append([*row, f"{entry['exact']:.4f}", *cells])
        head = ["case", "kernel", "σ0", "RMSE exact", *(f"q = {q}" for q in QUOTIENTS)]
        return lines + to_table(head, rows)

    def bounce_tables(self) -> list[str]:
        """The same choice against renders with light between surfaces."""
        lines: list[str] = []
        for case, found in self.results["bounces"].items():
            for kernel in KERNELS:
                fits = found[kernel]
                lines += [
                    f"## {kernel}, {case}, with {MANY_BOUNCES} bounces between surfaces",
                    "",
                    f"RMSE, one slider; Lambert has {found['lambert']:.4f}.",
                    "",
                ]
                lines += matrix(lambda kind, rule, fits=fits: fits[kind][rule]["rmse"])  # type: ignore[misc]
        return lines


def main() -> None:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    data = ROOT / "tests" / "data"
    parser.add_argument("--bunny", type=Path, default=data / "stanford_bunny.obj")
    parser.add_argument("--cache", type=Path, default=Path(tempfile.gettempdir()) / "kappa_choice")
    parser.add_argument("--size", type=int, default=160, help="pixels along an edge")
    parser.add_argument("--samples", type=int, default=512)
    parser.add_argument("--only", nargs="*", choices=PARTS, default=list(PARTS))
    options = parser.parse_args()
    store = ROOT / "docs" / "results" / "data" / "kappa_choice.json"
    results = json.loads(store.read_text(encoding="utf-8")) if store.exists() else {}
    options.cache.mkdir(parents=True, exist_ok=True)
    shapes = {"head": data / "human_head.obj"}
    if options.bunny.exists():
        shapes["bunny"] = options.bunny
    else:
        print(f"{options.bunny} is not there; the head only.", flush=True)
    study = Study(shapes, options.cache, options.size, options.samples)
    for part in options.only:
        print(f"{part} ...", flush=True)
        results |= {"machine": machine(), "size": options.size, "samples": options.samples}
        PARTS[part](study, results)
        results = rounded(results)
        store.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    page = ROOT / "docs" / "results" / "kappa_choice.md"
    page.write_text(Report(results).page(), encoding="utf-8")


if __name__ == "__main__":
    main()
