# SPDX-License-Identifier: GPL-3.0-or-later
"""Curvature from a polynomial height field fitted over the rings around each vertex.

    quadric     z = a x^2 + b xy + c y^2 + d x + e y, the fit of libigl (Panozzo et al. 2010)
    cubic       the same with the four cubic terms
    goldfeather the cubic without d, e, fitted to positions and normals alike (Goldfeather and
                Interrante 2004, "adjacent-normal cubic order algorithm")

x, y, z are coordinates in a frame whose z axis is the mean normal of the rings. libigl's own
curvatures depend on the order of the vertices, as it symmetrises the Weingarten map wrongly; here
it is taken from both fundamental forms, so that the frame, and with it the order, cancels out.

All vertices of a block are fitted at once: every entry of their normal equations is a sum over the
rings of x^p y^q, possibly times z. numpy lets go of the interpreter lock in these sums, so blocks
run on as many threads as there are cores.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import numpy as np

from ..progress import portion
from ..topology import NORMAL_LIMIT, adjacency, vertex_normals
from .estimate import Estimate, fittable_faces
from .least_squares import PIVOT_LIMIT, solve
from .tensor import tensor_steps

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ..mesh import CleanMesh, Indices, Points

Exponents = tuple[int, int]
_Block = tuple[int, int, Estimate, "NDArray[np.bool_]"]
"""First vertex, end, result, and which vertices' rings are much longer than wide."""

QUADRIC: tuple[Exponents, ...] = ((2, 0), (1, 1), (0, 2), (1, 0), (0, 1))
CUBIC: tuple[Exponents, ...] = (*QUADRIC, (3, 0), (2, 1), (1, 2), (0, 3))
GOLDFEATHER: tuple[Exponents, ...] = ((2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3))

# Pairs of a vertex and a neighbour in a block: their arrays just fit into a core's cache.
BLOCK_PAIRS = 60_000
BLOCKS_AT_ONCE = 16
# A cubic that is hardly determined swings wildly; there the quadric takes over.
CUBIC_PIVOT_LIMIT = 1e-3
# Squared distance of the rings' centre from the vertex, in units of their squared extent, above
# which they are one-sided, as at a border (0.6 there, 0.17 a row further in), and take the quadric.
ONE_SIDED = 0.1
# Variance across over variance along, below which rings count as long: 4.5 times as long as wide.
ELONGATED = 0.05


def polynomial_steps(
    mesh: CleanMesh, radius: int, terms: Sequence[Exponents], *, use_normals: bool = False
) -> Generator[float, None, Estimate]:
    """Fit the polynomial of these terms around every vertex, yielding the part done.

    Args:
        mesh: A clean mesh, in units of its median edge.
        radius: Rings of neighbours in the fit.
        terms: Exponents (p, q) of x^p y^q, among them all three of second order.
        use_normals: Fit the slopes at the neighbours as well as their heights.

    Returns:
        Principal curvatures per unit of the clean mesh.
    """
    count = len(mesh.vertices)
    triangles, (normal, area) = mesh.triangles, mesh.face_normals
    kept = fittable_faces(mesh)
    if not kept.all():
        triangles, normal, area = triangles[kept], normal[:, kept], area[kept]
    normals, used, sound = vertex_normals((normal, area), triangles, count)
    yield 0.03
    near = adjacency(triangles, count)
    yield 0.06
    fit = _Fit(mesh.vertices, normals, used & sound, tuple(terms), use_normals)
    result = Estimate.empty(count)
    workers = max(1, os.cpu_count() or 1)
    long = np.zeros(count, dtype=bool)
    running: deque[Future[_Block]] = deque()

    def store(done: Future[_Block]) -> float:
        start, end, part, part_long = done.result()
        result.put(slice(start, end), part)
        long[start:end] = part_long
        return 0.06 + 0.84 * end / count

    with ThreadPoolExecutor(workers) as pool:
        for start, rings in _ring_blocks(near, radius):
            running.append(pool.submit(fit.block, start, rings))
            while len(running) > 2 * workers:
                yield store(running.popleft())
        while running:
            yield store(running.popleft())
    if long.any():
        # Over rings much longer than wide, a bend along them passes for one across.
        turned = yield from portion(tensor_steps(mesh), 0.9, 1.0)
        rows = np.flatnonzero(long & turned.good)
        result.put(rows, Estimate(turned.k1[rows], turned.k2[rows], turned.good[rows]))
    return result


def _ring_blocks(near: Any, radius: int) -> Generator[tuple[int, Any], None, None]:
    """Cut the mesh into blocks: the first vertex of each, and a row of neighbours for each vertex.

    Rings are made for many blocks at once, as every product of sparse matrices costs a pass over
    all columns.
    """
    count = near.shape[0]
    # Rings grow with the square of the radius: 7, 19, 37, 61 points on a regular mesh.
    per_vertex = max(1, round(near.nnz / count * (1 + radius) * radius / 2))
    size = max(64, BLOCK_PAIRS // per_vertex)
    for first in range(0, count, BLOCKS_AT_ONCE * size):
        rings = near[first : first + BLOCKS_AT_ONCE * size]
        for _ in range(radius - 1):
            rings = rings @ near
        for start in range(0, rings.shape[0], size):
            yield first + start, rings[start : start + size]


class _Fit:
    def __init__(
        self,
        vertices: Points,
        normals: Points,
        sound: NDArray[np.bool_],
        terms: tuple[Exponents, ...],
        use_normals: bool,
    ) -> None:
        self.vertices, self.normals, self.sound = vertices, normals, sound
        self.terms, self.use_normals = terms, use_normals
        self.columns = [np.ascontiguousarray(part) for part in (*vertices.T, *normals.T)]

    # Rings too small for their powers to be held come out as NaN, which `solve` takes for unsolved.
    @np.errstate(divide="ignore", invalid="ignore", over="ignore", under="ignore")
    def block(self, start: int, rings: Any) -> _Block:
        """Fit around the vertices from start on, a row of neighbours each."""
        end = start + rings.shape[0]
        pairs = _Pairs(rings, self.vertices, self.normals, self.columns, start)
        k1, k2, solved = self._curvatures(pairs, self.terms)
        if len(self.terms) > len(QUADRIC) and not solved.all():
            # Too few neighbours for a cubic, or on one side only, may be enough for a quadric.
            other1, other2, other = self._curvatures(pairs, QUADRIC)
            k1, k2 = np.where(solved, k1, other1), np.where(solved, k2, other2)
            solved |= other
        good = self.sound[start:end] & pairs.has_normal & solved & (pairs.count >= 5.0)
        return start, end, Estimate(k1, k2, good), pairs.long

    def _curvatures(
        self, pairs: _Pairs, terms: Sequence[Exponents]
    ) -> tuple[Points, Points, NDArray[np.bool_]]:
        limit = CUBIC_PIVOT_LIMIT if len(terms) > len(QUADRIC) else PIVOT_LIMIT
        solution, solved = solve(*self._equations(pairs, terms), limit)
        of = {
            (p, q): value / (pairs.wide**p * pairs.high**q)
            for (p, q), value in zip(terms, solution, strict=True)
        }
        flat = np.zeros(len(solved))
        slope = of.get((1, 0), flat), of.get((0, 1), flat)
        if len(terms) > len(QUADRIC):
            solved &= ~pairs.one_sided
        return *_principal(*slope, *(of[term] for term in ((2, 0), (1, 1), (0, 2)))), solved

    def _equations(
        self, pairs: _Pairs, terms: Sequence[Exponents]
    ) -> tuple[list[list[Points]], list[Points]]:
        """Normal equations, with x and y in units of the rings' RMS extents."""
        matrix = [[pairs.moment(p + r, q + s) for r, s in terms] for p, q in terms]
        right = [pairs.moment(p, q, "z") for p, q in terms]
        if not self.use_normals:
            return matrix, right
        # d/dx x^p y^q = p x^(p-1) y^q is fitted to the slope along x, likewise along y.
        for i, (p, q) in enumerate(terms):
            for j, (r, s) in enumerate(terms):
                if p * r:
                    matrix[i][j] = matrix[i][j] + p * r * pairs.moment(p + r - 2, q + s)
                if q * s:
                    matrix[i][j] = matrix[i][j] + q * s * pairs.moment(p + r, q + s - 2)
            if p:
                right[i] = right[i] + p * pairs.wide * pairs.moment(p - 1, q, "along x")
            if q:
                right[i] = right[i] + q * pairs.high * pairs.moment(p, q - 1, "along y")
        return matrix, right


class _Pairs:
    """Neighbours of a block's vertices in each vertex's own frame, and sums over them."""

    def __init__(
        self, rings: Any, vertices: Points, normals: Points, columns: list[Points], start: int
    ) -> None:
        neighbour = rings.indices
        self.starts: Indices = rings.indptr[:-1]
        self._sizes = np.diff(rings.indptr)
        mean = rings.astype(np.float64) @ normals
        length = np.sqrt((mean**2).sum(axis=1))
        self.has_normal = length > NORMAL_LIMIT * self._sizes
        mean /= np.where(self.has_normal, length, 1.0)[:, None]
        self._frame = np.concatenate((*_tangents(mean.T), mean.T))
        itself = vertices[start : start + len(self._sizes)].T
        around = np.repeat(np.concatenate((self._frame, itself)), self._sizes, axis=1)
        ux, uy, uz, vx, vy, vz, nx, ny, nz, x, y, z = around
        # mode="clip" skips the check of every index: three times as fast.
        dx, dy, dz = (
            np.take(part, neighbour, mode="clip") - own
            for part, own in zip(columns[:3], (x, y, z), strict=True)
        )
        a, b, c = self._turned = [np.take(part, neighbour, mode="clip") for part in columns[3:]]
        # A neighbour that looks the other way lies on another sheet.
        self._up = nx * a + ny * b + nz * c
        self._same = same = (self._up > 0.0).astype(np.float64)
        self._x = (dx * ux + dy * uy + dz * uz) * same
        self._y = (dx * vx + dy * vy + dz * vz) * same
        height = (dx * nx + dy * ny + dz * nz) * same
        self.count = np.add.reduceat(same, self.starts) - 1.0
        self._targets = {"": None, "z": height}
        self._powers: dict[Exponents, Points] = {}
        self._moments: dict[tuple[int, int, str], Points] = {}
        self.wide = self.high = np.ones(len(self.count))
        self._align()

    def _align(self) -> None:
        """Set the units of x and y; turn the axes where the rings are much longer than wide."""
        number = np.maximum(self.count, 1.0)
        xx, xy, yy = (self.moment(p, q) / number for p, q in ((2, 0), (1, 1), (0, 2)))
        middle, half = (xx + yy) / 2.0, np.hypot((xx - yy) / 2.0, xy)
        off_centre = (self.moment(1, 0) / number) ** 2 + (self.moment(0, 1) / number) ** 2
        self.one_sided = off_centre > ONE_SIDED * 2.0 * middle
        self.long = long = middle - half < ELONGATED * (middle + half)
        if not long.any():
            self.wide = self.high = np.where(middle > 0.0, np.sqrt(middle), 1.0)
        else:
            angle = np.where(long, 0.5 * np.arctan2(2.0 * xy, xx - yy), 0.0)
            turn = np.stack((np.cos(angle), np.sin(angle)))
            cosine, sine = np.repeat(turn, self._sizes, axis=1)
            self._x, self._y = cosine * self._x + sine * self._y, cosine * self._y - sine * self._x
            u, v = self._frame[:3].copy(), self._frame[3:6].copy()
            self._frame[:3] = turn[0] * u + turn[1] * v
            self._frame[3:6] = turn[0] * v - turn[1] * u
            self._powers.clear()
            self._moments.clear()
            xx, yy = (self.moment(*of) / number for of in ((2, 0), (0, 2)))
            xx, yy = np.where(long, xx, middle), np.where(long, yy, middle)
            self.wide = np.where(xx > 0.0, np.sqrt(xx), 1.0)
            self.high = np.where(yy > 0.0, np.sqrt(yy), 1.0)
        self._moments.clear()

    def moment(self, p: int, q: int, target: str = "") -> Points:
        """Sum of x^p y^q over the rings, times the target; x and y in their units."""
        known = self._moments.get((p, q, target))
        if known is None:
            values = self._power(p, q)
            if target:
                values = values * self._target(target)
            known = np.add.reduceat(values, self.starts) / (self.wide**p * self.high**q)
            self._moments[p, q, target] = known
        return known

    def _power(self, p: int, q: int) -> Points:
        known = self._powers.get((p, q))
        if known is None:
            if p + q == 0:
                known = self._same
            elif p:
                known = self._power(p - 1, q) * self._x if (p, q) != (1, 0) else self._x
            else:
                known = self._power(0, q - 1) * self._y if q != 1 else self._y
            self._powers[p, q] = known
        return known

    def _target(self, name: str) -> Points:
        known = self._targets.get(name)
        if known is None:
            ux, uy, uz, vx, vy, vz = np.repeat(self._frame[:6], self._sizes, axis=1)
            a, b, c = self._turned
            up = np.maximum(self._up, 0.1)  # slopes of up to 84 degrees
            self._targets["along x"] = -(ux * a + uy * b + uz * c) / up * self._same
            self._targets["along y"] = -(vx * a + vy * b + vz * c) / up * self._same
            known = self._targets[name]
        assert known is not None
        return known


def _tangents(normal: Points) -> tuple[Points, Points]:
    """Two unit vectors that make a frame with each unit normal, (3, n) (Duff et al. 2017)."""
    x, y, z = normal
    sign = np.where(z < 0.0, -1.0, 1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    return np.stack((1.0 + sign * x * x * a, sign * b, -sign * x)), np.stack(
        (b, sign + y * y * a, -y)
    )


def _principal(d: Points, e: Points, a: Points, b: Points, c: Points) -> tuple[Points, Points]:
    """Principal curvatures at the origin of z = a x^2 + b xy + c y^2 + d x + e y."""
    first_e, first_f, first_g = 1.0 + d * d, d * e, 1.0 + e * e
    determinant = first_e * first_g - first_f**2
    # Height falls away from a surface that bulges outwards, which counts as positive.
    down = -1.0 / np.sqrt(determinant)
    second_l, second_m, second_n = 2.0 * a * down, b * down, 2.0 * c * down
    # The Weingarten map (a b; c d). Its discriminant as a sum: mean^2 - Gaussian would leave the
    # square root of the rounding where k1 and k2 are equal.
    map_a = (first_g * second_l - first_f * second_m) / determinant
    map_b = (first_g * second_m - first_f * second_n) / determinant
    map_c = (first_e * second_m - first_f * second_l) / determinant
    map_d = (first_e * second_n - first_f * second_m) / determinant
    mean = (map_a + map_d) / 2.0
    split = np.sqrt(np.maximum(((map_a - map_d) / 2.0) ** 2 + map_b * map_c, 0.0))
    return mean + split, mean - split
