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
rings of x^p y^q, possibly times z. Arrays of pairs are (r, b): a column for each of b vertices, a
row for each of its r neighbours, so that a sum adds up whole rows. numpy releases the interpreter
lock in these sums, so blocks run on as many threads as there are cores.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...progress import portion
from ..topology import NORMAL_LIMIT, VertexNormals, adjacency, columns, dot, vertex_normals
from .estimate import Estimate, fittable_faces
from .least_squares import PIVOT_LIMIT, solve
from .tensor import tensor_steps

if TYPE_CHECKING:
    from ..clean import CleanMesh
    from ..tri_mesh import Indices, Mask, Points

Exponents = tuple[int, int]

QUADRIC: tuple[Exponents, ...] = ((2, 0), (1, 1), (0, 2), (1, 0), (0, 1))
CUBIC: tuple[Exponents, ...] = (*QUADRIC, (3, 0), (2, 1), (1, 2), (0, 3))
GOLDFEATHER: tuple[Exponents, ...] = ((2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3))

# Pairs of a vertex and a neighbour in a block: their arrays just fit into a core's cache.
BLOCK_PAIRS = 60_000
# Rings are made for so many blocks at once, as every product of sparse matrices takes a pass over
# all columns.
BLOCKS_AT_ONCE = 16
# A cubic that is hardly determined oscillates; the quadric replaces it there.
CUBIC_PIVOT_LIMIT = 1e-3
# Squared distance of the rings' centre from the vertex, in units of their squared extent, above
# which they are one-sided, as at a border (0.6 there, 0.17 a row further in): a quadric is fitted.
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
    triangles, faces = mesh.triangles, mesh.face_normals
    kept = fittable_faces(mesh)
    if not kept.all():
        triangles, faces = triangles[kept], faces[kept]
    normals = vertex_normals(faces, triangles, count)
    yield 0.03
    near = adjacency(triangles, count)
    yield 0.06
    fit = _Fit(mesh.vertices, normals, tuple(terms), use_normals)
    result = Estimate.empty(count)
    workers = max(1, os.cpu_count() or 1)
    long = np.zeros(count, dtype=bool)
    running: deque[Future[_Block]] = deque()
    fitted = 0

    def store(done: Future[_Block]) -> float:
        nonlocal fitted
        block = done.result()
        long[block.rows] = block.long
        result.put(block.rows, block.estimate)
        fitted += len(block.rows)
        return 0.06 + 0.84 * min(fitted / count, 1.0)

    with ThreadPoolExecutor(workers) as pool:
        for rows, rings in _ring_blocks(near, radius):
            running.append(pool.submit(fit.block, rows, rings))
            while len(running) > 2 * workers:
                yield store(running.popleft())
        while running:
            yield store(running.popleft())
    if long.any():
        # In rings much longer than wide, the fit takes a bend along them for one across.
        turned = yield from portion(tensor_steps(mesh), 0.9, 1.0)
        rows = np.flatnonzero(long & turned.good)
        result.put(rows, Estimate(turned.k1[rows], turned.k2[rows], turned.good[rows]))
    return result


def _ring_blocks(near: Any, radius: int) -> Generator[tuple[Indices, Indices], None, None]:
    """Cut the mesh into blocks: some vertices, (b,), and the neighbours of each, (r, b).

    Vertices with the most neighbours come first; the columns of the others end in -1.
    """
    count = near.shape[0]
    # Rings grow with the square of the radius: 7, 19, 37, 61 points on a regular mesh.
    per_vertex = max(1, round(near.nnz / count * (1 + radius) * radius / 2))
    size = BLOCKS_AT_ONCE * max(64, BLOCK_PAIRS // per_vertex)
    for first in range(0, count, size):
        rings = near[first : first + size]
        for _ in range(radius - 1):
            rings = rings @ near
        sizes, indices = np.diff(rings.indptr), rings.indices.astype(np.int64)
        order = np.argsort(-sizes, kind="stable")
        start = 0
        while start < len(order):
            most = int(sizes[order[start]])
            chosen = order[start : start + max(64, BLOCK_PAIRS // most)]
            start += len(chosen)
            if len(chosen) == 1:
                # Twice, as numpy adds up a single column in another order.
                chosen = np.repeat(chosen, 2)
            row = np.arange(most)[:, None]
            # Padding may reach beyond the last neighbour.
            neighbours = np.take(indices, rings.indptr[chosen] + row, mode="clip")
            if sizes[chosen[-1]] < most:
                neighbours[row >= sizes[chosen]] = -1
            yield first + chosen, neighbours


@dataclass(frozen=True)
class _Block:
    """The fit around some vertices."""

    rows: Indices
    """(b,) the vertices."""
    estimate: Estimate
    long: Mask
    """(b,) True where the rings are much longer than wide."""


class _Fit:
    """Fits one polynomial, block by block."""

    def __init__(
        self,
        vertices: Points,
        normals: VertexNormals,
        terms: tuple[Exponents, ...],
        use_normals: bool,
    ) -> None:
        self.sound, self.terms, self.use_normals = normals.used & normals.sound, terms, use_normals
        self.places, self.normals = columns(vertices), columns(normals.unit)

    # Powers of very small rings underflow to NaN, which `solve` reports as unsolved.
    @np.errstate(divide="ignore", invalid="ignore", over="ignore", under="ignore")
    def block(self, rows: Indices, rings: Indices) -> _Block:
        """Fit around some vertices, (b,), with the neighbours of each, (r, b)."""
        pairs = _Pairs(rows, rings, self.places, self.normals)
        k1, k2, solved = self._curvatures(pairs, self.terms)
        if len(self.terms) > len(QUADRIC) and not solved.all():
            # Neighbours too few for a cubic, or on one side only, may determine a quadric.
            other1, other2, other = self._curvatures(pairs, QUADRIC)
            k1, k2 = np.where(solved, k1, other1), np.where(solved, k2, other2)
            solved |= other
        good = self.sound[rows] & pairs.has_normal & solved & (pairs.count >= 5.0)
        return _Block(rows, Estimate(k1, k2, good), pairs.long)

    def _curvatures(self, pairs: _Pairs, terms: Sequence[Exponents]) -> tuple[Points, Points, Mask]:
        """Return k1, k2 and where the fit of these terms is determined, (b,) each."""
        limit = CUBIC_PIVOT_LIMIT if len(terms) > len(QUADRIC) else PIVOT_LIMIT
        solution, solved = solve(*self._equations(pairs, terms), limit)
        of = dict(zip(terms, solution, strict=True))
        wide, high = pairs.wide, pairs.high
        flat = np.zeros(len(solved))
        slope = of.get((1, 0), flat) / wide, of.get((0, 1), flat) / high
        bend = of[2, 0] / wide**2, of[1, 1] / (wide * high), of[0, 2] / high**2
        if len(terms) > len(QUADRIC):
            solved &= ~pairs.one_sided
        return *_principal(*slope, *bend), solved

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

    def __init__(self, rows: Indices, rings: Indices, places: Points, normals: Points) -> None:
        # mode="clip" skips the check of every index: three times as fast.
        self._turned = [np.take(axis, rings, mode="clip") for axis in normals]
        inside = rings >= 0
        size = inside.sum(axis=0)
        if not inside.all():
            self._turned = [axis * inside for axis in self._turned]
        mean = np.stack([axis.sum(axis=0) for axis in self._turned])
        length = np.sqrt(dot(mean, mean))
        self.has_normal = length > NORMAL_LIMIT * size
        mean /= np.where(self.has_normal, length, 1.0)
        self._frame = [*_tangents(mean), mean]
        # A neighbour whose normal points away lies on another sheet; that of padding is 0.
        self._up = dot(mean, self._turned)
        self._same = same = (self._up > 0.0).astype(np.float64)
        away = [np.take(axis, rings, mode="clip") - axis[rows] for axis in places]
        self._x, self._y, height = (dot(axis, away) * same for axis in self._frame)
        self.count = same.sum(axis=0) - 1.0
        self._targets = {"z": height}
        self._align()
        self._x /= self.wide
        self._y /= self.high
        self._powers = {(0, 0): same, (1, 0): self._x, (0, 1): self._y}
        self._moments: dict[tuple[int, int, str], Points] = {}

    def _align(self) -> None:
        """Choose the units of x and y; turn the axes where the rings are much longer than wide."""
        number = np.maximum(self.count, 1.0)
        x, y = self._x, self._y
        xx, xy, yy = (_sum(*both) / number for both in ((x, x), (x, y), (y, y)))
        middle, half = (xx + yy) / 2.0, np.hypot((xx - yy) / 2.0, xy)
        off_centre = (_sum(x) / number) ** 2 + (_sum(y) / number) ** 2
        self.one_sided = off_centre > ONE_SIDED * 2.0 * middle
        self.long = long = middle - half < ELONGATED * (middle + half)
        if not long.any():
            self.wide = self.high = np.where(middle > 0.0, np.sqrt(middle), 1.0)
            return
        angle = np.where(long, 0.5 * np.arctan2(2.0 * xy, xx - yy), 0.0)
        cosine, sine = np.cos(angle), np.sin(angle)
        self._x, self._y = x, y = cosine * x + sine * y, cosine * y - sine * x
        u, v = self._frame[:2]
        self._frame[:2] = cosine * u + sine * v, cosine * v - sine * u
        xx = np.where(long, _sum(x, x) / number, middle)
        yy = np.where(long, _sum(y, y) / number, middle)
        self.wide = np.where(xx > 0.0, np.sqrt(xx), 1.0)
        self.high = np.where(yy > 0.0, np.sqrt(yy), 1.0)

    def moment(self, p: int, q: int, target: str = "") -> Points:
        """Sum of x^p y^q over the rings, times the target; x and y in their units."""
        known = self._moments.get((p, q, target))
        if known is None:
            if target:
                known = _sum(self._power(p, q), self._target(target))
            elif p + q <= 3:
                known = _sum(self._power(p, q))
            else:
                # Powers above the third order are made while they are added up.
                r = min(p, 3)
                s = 3 - r
                known = _sum(self._power(r, s), self._power(p - r, q - s))
            self._moments[p, q, target] = known
        return known

    def _power(self, p: int, q: int) -> Points:
        known = self._powers.get((p, q))
        if known is None:
            known = self._power(p - 1, q) * self._x if p else self._power(0, q - 1) * self._y
            self._powers[p, q] = known
        return known

    def _target(self, name: str) -> Points:
        if name not in self._targets:
            up = np.maximum(self._up, 0.1)  # slopes of up to 84 degrees
            for direction, axis in zip(("along x", "along y"), self._frame, strict=False):
                self._targets[direction] = -dot(axis, self._turned) / up * self._same
        return self._targets[name]


def _sum(values: Points, times: Points | None = None) -> Points:
    """Sum an array of pairs, or the product of two, over the neighbours, (b,)."""
    return values.sum(axis=0) if times is None else np.einsum("rb,rb->b", values, times)


def _tangents(normal: Points) -> tuple[Points, Points]:
    """Return two unit tangents to each unit normal, (3, n), a frame with it (Duff et al. 2017)."""
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
