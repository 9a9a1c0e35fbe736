# SPDX-License-Identifier: GPL-3.0-or-later
"""Solve many small systems of normal equations at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..tri_mesh import Mask, Points

# Part of a diagonal entry that elimination must leave for the points to determine the fit.
PIVOT_LIMIT = 1e-8


def solve(
    matrix: list[list[Points]], right: list[Points], limit: float = PIVOT_LIMIT
) -> tuple[list[Points], Mask]:
    """Solve many small symmetric systems at once by Cholesky's method, L D L^T.

    Args:
        matrix: k x k arrays (n,); only the lower triangle is read.
        right: k arrays (n,).
        limit: See PIVOT_LIMIT.

    Returns:
        The solution, k arrays (n,), and where the system determines it, (n,).
    """
    size = len(right)
    lower: list[list[Points]] = [[] for _ in range(size)]
    pivots: list[Points] = []
    found = list(right)
    sound = np.ones(len(right[0]), dtype=bool)
    for i in range(size):
        scaled: list[Points] = []
        for j in range(i):
            entry = matrix[i][j]
            for k in range(j):
                entry = entry - scaled[k] * lower[j][k]
            scaled.append(entry)
        lower[i] = [entry / pivot for entry, pivot in zip(scaled, pivots, strict=True)]
        pivot = matrix[i][i]
        for entry, part in zip(scaled, lower[i], strict=True):
            pivot = pivot - entry * part
        enough = pivot > limit * matrix[i][i]
        sound &= enough
        pivots.append(np.where(enough, pivot, 1.0))
        for j in range(i):
            found[i] = found[i] - lower[i][j] * found[j]
    found = [value / pivot for value, pivot in zip(found, pivots, strict=True)]
    for i in reversed(range(size)):
        for j in range(i + 1, size):
            found[i] = found[i] - lower[j][i] * found[j]
    return found, sound
