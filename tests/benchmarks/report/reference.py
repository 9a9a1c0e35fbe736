# SPDX-License-Identifier: GPL-3.0-or-later
"""Path-traced references: two denoised pictures of different seeds, kept on disk."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import bpy
import numpy as np

from cdrf_addon.core.scattering.node_radius import RANDOM_WALK

from ..common.arrays import Array, Mask
from .cells import FIRST, Cell
from .metrics import rmse
from .settings import SEED, Settings
from .stage import Stage

VERSION = 1
"""Raise it when a scene, a shape or a light of scenes.py changes."""


@dataclass(frozen=True)
class Reference:
    """The mean of two pictures, and the two."""

    pictures: tuple[Array, Array]
    seconds: float

    @property
    def picture(self) -> Array:
        """What contenders are compared with."""
        return np.asarray((self.pictures[0] + self.pictures[1]) / 2.0)

    def floor(self, mask: Mask) -> float:
        """Monte-Carlo error of the mean, RMSE: half of what the two are apart."""
        return rmse(*self.pictures, mask) / 2.0


def kept(folder: Path, key: object, make: Callable[[], Array]) -> tuple[Array, float]:
    """Take a picture from the cache, or make it; also the seconds it took."""
    text = json.dumps([VERSION, bpy.app.version_string, key], sort_keys=True)
    path = folder / f"{hashlib.blake2b(text.encode(), digest_size=12).hexdigest()}.npz"
    if not path.exists():
        folder.mkdir(parents=True, exist_ok=True)
        start = time.perf_counter()
        picture = make()
        part = path.with_suffix(".part.npz")
        np.savez_compressed(
            part, picture=picture.astype(np.float32), seconds=time.perf_counter() - start
        )
        part.replace(path)
    with np.load(path) as file:
        return file["picture"].astype(np.float64), float(file["seconds"])


def paths(settings: Settings, cell: Cell) -> int:
    """Paths through a pixel of each picture: half as many where a scene is only surveyed."""
    return settings.samples if settings.sample or cell in FIRST else settings.samples // 2


def reference(
    stage: Stage, bounces: int = 0, *, samples: int = 0, method: str = RANDOM_WALK
) -> Reference:
    """Path-trace a stage in its scattering material, or take it from the cache.

    Args:
        stage: Its scattering material is not translucent, and of this method.
        bounces: Of light from surface to surface.
        samples: Paths through a pixel of each picture; 0: as the report has them.
        method: The subsurface method, for the name it is kept by.
    """
    settings = stage.settings
    samples = samples or paths(settings, stage.cell)
    stage.assign(stage.scattering)
    pictures, seconds = [], 0.0
    for seed in (SEED, SEED + 1):
        key = [asdict(stage.cell), stage.size, samples, settings.level, seed, bounces]
        if method != RANDOM_WALK:
            key.append(method)

        def render(seed: int = seed) -> Array:
            return stage.cycles(samples, seed, denoise=True, bounces=bounces)

        picture, took = kept(settings.cache / "references", key, render)
        pictures.append(picture)
        seconds += took
    return Reference((pictures[0], pictures[1]), seconds)
