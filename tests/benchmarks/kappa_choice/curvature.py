# SPDX-License-Identifier: GPL-3.0-or-later
"""The curvatures that are compared, and their diffusion over a length."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from ..common.arrays import Array
from ..common.shapes import Shape

RINGS = 2
"""Neighbours in libigl's fit, as the extension's default."""
PRESMOOTH = (256, 128)
"""Two-stage kinds: the tensor diffused over sqrt(area) / this, its curvedness diffused again."""


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
