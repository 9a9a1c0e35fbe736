# SPDX-License-Identifier: GPL-3.0-or-later
"""Measurements kept on disk, a file for each request."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..core.errors import MeasurementError
from ..core.measured.measurement import SphereMeasurement, load, save
from ..paths import user_folder
from .request import Request


def cache_folder() -> Path:
    """Return the folder where measurements are kept, and make it.

    Raises:
        MeasurementError: No folder can be made.
    """
    try:
        return user_folder("measured")
    except OSError as error:
        raise MeasurementError(
            f"No folder for measurements can be made: {error.strerror}. "
            "Check Blender's user folder."
        ) from error


def cached(request: Request, folder: Path) -> SphereMeasurement | None:
    """Return an earlier measurement of the same request; a damaged file counts as none."""
    try:
        found = load(_file(request, folder))
    except MeasurementError:
        return None
    same = np.allclose(found.albedo, request.albedo, atol=1e-5) and np.array_equal(
        found.scales, request.complete().scales
    )
    return found if same else None


def keep(request: Request, measurement: SphereMeasurement, folder: Path) -> None:
    """Save a measurement for the next time the same is asked.

    Raises:
        MeasurementError: The file cannot be written.
    """
    save(_file(request, folder), measurement)


def _file(request: Request, folder: Path) -> Path:
    return folder / f"{request.key()}.npz"
