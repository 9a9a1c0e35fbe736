# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows of pictures: the reference, three contenders, and the difference below."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..common.files import IMAGES
from ..report.cells import Cell
from ..report.contenders import DEFAULT, PRINCIPLED, SHADOWS
from ..report.figures.drawing import brighter, figure, picture, plain
from ..report.matrix import load_pictures
from ..report.settings import Settings
from .study import COMPARED, NAME, SHOWN

DIFFERENCE = 8.0


def pictures_file(settings: Settings, cell: Cell) -> Path:
    """Return where a scene's pictures are kept until they are drawn."""
    return settings.cache / "pictures" / f"{cell.name.replace(', ', '_')}.npz"


def draw(settings: Settings) -> None:
    """Draw the scenes whose pictures are all kept."""
    kept = {cell: load_pictures(pictures_file(settings, cell)) for cell in SHOWN}
    kept = {cell: pictures for cell, pictures in kept.items() if pictures}
    if not kept:
        return
    names = (PRINCIPLED, SHADOWS, DEFAULT)
    columns, rows = len(names) + 1, 2 * len(kept)
    with figure(IMAGES / f"{NAME}.png", 2.0 * columns, 2.1 * rows) as sheet:
        grid = sheet.subplots(rows, columns)
        for above, below, (cell, pictures) in zip(grid[::2], grid[1::2], kept.items(), strict=True):
            truth = pictures["reference"][..., :3].astype(np.float64)
            factor = brighter(pictures, "reference")
            picture(above[0], truth * factor, f"{cell.name}\nRandom Walk")
            plain(below[0])
            for number, name in enumerate(names, start=1):
                values = pictures[name][..., :3].astype(np.float64)
                picture(above[number], values * factor, COMPARED[name])
                off = np.abs(values - truth) * factor * DIFFERENCE
                picture(below[number], off, f"× {DIFFERENCE:g} difference")
