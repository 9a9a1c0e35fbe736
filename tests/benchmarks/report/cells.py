# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes of the matrix: shapes, materials and lights."""

from __future__ import annotations

from dataclasses import dataclass

from .lights import RIGS


@dataclass(frozen=True)
class Cell:
    """One scene of the matrix."""

    shape: str
    material: str
    lights: str

    @property
    def name(self) -> str:
        """Name for tables and files."""
        return f"{self.shape}, {self.material}, {self.lights}"


MATERIALS = ("skin", "marble", "milk")
MATRIX = [
    Cell(shape, material, lights)
    for lights in RIGS
    for material in MATERIALS
    for shape in ("head", "sphere", "bust", "bunny", "Suzanne", "torus")
]
FIRST = [
    Cell("head", "skin", "sun"),
    Cell("sphere", "skin", "sun"),
    Cell("bust", "marble", "key + fill + rim"),
    Cell("bunny", "milk", "sun"),
    Cell("Suzanne", "marble", "sun"),
    Cell("torus", "milk", "sun"),
    Cell("head", "skin", "HDRI"),
    Cell("head", "skin", "key + fill + rim"),
    Cell("bust", "marble", "sun"),
    Cell("sphere", "milk", "HDRI"),
    Cell("Suzanne", "skin", "key + fill + rim"),
]
"""What is measured first, with all contenders, and shown: every shape, material and light."""
CELLS = [*FIRST, *(cell for cell in MATRIX if cell not in FIRST)]
