# SPDX-License-Identifier: GPL-3.0-or-later
"""Measurements kept on disk, a file for each request."""

from __future__ import annotations

import tempfile
from pathlib import Path

import bpy
import numpy as np

from ..core.errors import MeasurementError
from ..core.measured.measurement import SphereMeasurement, load, save
from .request import Request


def cache_folder() -> Path:
    """Where measurements are kept: the extension's own folder, else Blender's data files.

    Raises:
        MeasurementError: No folder can be made.
    """
    package = (__package__ or "cdrf_addon.measuring").removesuffix(".measuring")
    try:
        # Refuses packages that were not installed as extensions.
        return Path(bpy.utils.extension_path_user(package, path="measured", create=True))
    except (ValueError, OSError):
        pass
    try:
        found = bpy.utils.user_resource("DATAFILES", path="cdrf_measured", create=True)
        folder = Path(found) if found else Path(tempfile.gettempdir()) / "cdrf_measured"
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise MeasurementError(
            f"No folder for measurements can be made: {error.strerror}. "
            "Check Blender's user folder."
        ) from error
    return folder


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
