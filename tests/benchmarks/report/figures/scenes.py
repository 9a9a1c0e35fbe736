# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows of pictures: contenders, the reference and the difference in a scene."""

from __future__ import annotations

import numpy as np

from ..cells import FIRST, Cell
from ..contenders import (
    DEFAULT,
    LAMBERT,
    NODE,
    PATHS,
    PRINCIPLED,
    SHADOWS,
    SPHERE,
    TEXTURE,
)
from ..matrix import load_pictures, pictures_path, wanted_cells
from ..settings import Settings
from .drawing import brighter, figure, picture, plain

DIFFERENCE = 8.0
SHOWN = (
    LAMBERT,
    SPHERE,
    SHADOWS,
    DEFAULT,
    "CDRF measured",
    f"{NODE}, 16",
    PRINCIPLED,
    TEXTURE,
    f"{PATHS}, 16",
)
"""In the rows of pictures; those that were not measured are left out."""


def file_of(cell: Cell) -> str:
    """Return the name of the file with a scene's pictures."""
    return f"cell_{cell.name.replace(', ', '_').replace(' ', '')}.png"


def cell_pictures(settings: Settings) -> None:
    """Draw contenders, the reference, and eight times the difference, where pictures are kept."""
    for cell in wanted_cells(settings):
        shown = settings.sample or cell in FIRST
        if not (shown and pictures_path(settings, cell).exists()):
            continue
        pictures = load_pictures(pictures_path(settings, cell))
        names = [name for name in SHOWN if name in pictures]
        truth = pictures["reference"][..., :3].astype(np.float64)
        factor = brighter(pictures, "reference")
        width = 1.35 * (len(names) + 1)
        with figure(settings.pictures / file_of(cell), width, 3.1) as sheet:
            rows = sheet.subplots(2, len(names) + 1)
            picture(rows[0][0], truth * factor, "reference")
            plain(rows[1][0])
            for column, name in enumerate(names, start=1):
                values = pictures[name][..., :3].astype(np.float64)
                title = name.replace("Subsurface Scattering", "scattering node")
                title = title.replace("EEVEE ", "EEVEE\n").replace("CDRF ", "CDRF\n")
                title = title.replace(" (Diffuse BSDF)", "")
                picture(rows[0][column], values * factor, title.replace("Random Walk, ", "\n"))
                off = np.abs(values - truth) * factor * DIFFERENCE
                picture(rows[1][column], off, f"× {DIFFERENCE:g} difference")
