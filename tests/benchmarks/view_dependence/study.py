# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of the study, its raw results, and means of them."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np

from cdrf_addon.core.scattering.node_radius import BURLEY, RANDOM_WALK

from ..common.files import DATA
from ..report.cells import MATERIALS, Cell
from ..report.contenders import DEFAULT, LAMBERT, PRINCIPLED, SHADOWS

NAME = "view_dependence"
SIZE, SAMPLES, FILM = 96, 256, 16
LIGHTS = ("sun", "key + fill + rim")
SHAPES = ("head", "sphere", "torus", "bust", "bunny", "Suzanne")
CELLS = [
    Cell(shape, material, lights) for lights in LIGHTS for material in MATERIALS for shape in SHAPES
]
BURLEY_CELLS = [
    Cell("head", "skin", "sun"),
    Cell("torus", "skin", "sun"),
    Cell("bust", "marble", "sun"),
    Cell("sphere", "skin", "sun"),
]
"""In which Christensen-Burley is a reference too."""
SHOWN = (Cell("head", "skin", "sun"), Cell("bust", "marble", "sun"), Cell("torus", "skin", "sun"))
METHODS = {RANDOM_WALK: "Random Walk", BURLEY: "Christensen-Burley"}
COMPARED = {
    LAMBERT: "Lambert",
    PRINCIPLED: "EEVEE Principled",
    SHADOWS: "sphere",
    DEFAULT: "path-traced look",
}
MASKS = ("all", "lit")

Row = Mapping[str, Any]


def jobs(patterns: Sequence[str] = ("*",)) -> list[tuple[Cell, str]]:
    """Scenes with the reference's method, in the order in which they are measured."""
    suns = [cell for cell in CELLS if cell.lights == "sun"]
    rest = [cell for cell in CELLS if cell.lights != "sun"]
    found = [
        *((cell, RANDOM_WALK) for cell in suns),
        *((cell, BURLEY) for cell in BURLEY_CELLS),
        *((cell, RANDOM_WALK) for cell in rest),
    ]
    return [one for one in found if any(fnmatch(one[0].name, pattern) for pattern in patterns)]


def read(folder: Path = DATA) -> dict[str, Any]:
    """Raw results of the study; empty if it has not run."""
    path = folder / f"{NAME}.json"
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    return found


def measured(results: Row, method: str) -> dict[Cell, Row]:
    """Scenes that were measured against a method, in their order."""
    known = results.get("references", {}).get(method, {})
    return {cell: known[cell.name] for cell, one in jobs() if one == method and cell.name in known}


def error(row: Row, name: str, mask: str) -> float:
    """RMSE of a contender in a scene."""
    return float(row["contenders"][name]["rmse"][mask])


def share(rows: Iterable[Row], name: str, base: str, mask: str) -> float:
    """Geometric mean of a contender's error over another's; nan of nothing."""
    logs = [math.log(error(row, name, mask) / error(row, base, mask)) for row in rows]
    return math.exp(float(np.mean(logs))) if logs else math.nan


def unscaled(rows: Iterable[Row], name: str) -> float:
    """Geometric mean of the part of the error that one factor a colour would leave."""
    logs = [
        math.log(row["contenders"][name]["gain"]["rmse"] / error(row, name, "all")) for row in rows
    ]
    return math.exp(float(np.mean(logs))) if logs else math.nan


def where(rows: Sequence[Row], name: str) -> dict[str, tuple[float, float]]:
    """Mean share of the squared error, and of the pixels, of each part of a surface."""
    parts = rows[0]["contenders"][name]["shares"]
    found = {}
    for part in parts:
        both = np.mean([row["contenders"][name]["shares"][part] for row in rows], axis=0)
        found[part] = (float(both[0]), float(both[1]))
    return found
