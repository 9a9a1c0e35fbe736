# SPDX-License-Identifier: GPL-3.0-or-later
"""Ways to make and to read the table: size, storage, mapping of the axes, filter, projection."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from cdrf_addon.blender.nodes.tree import TreeBuilder
from cdrf_addon.core.reflectance.lut import (
    DEFAULT_LAYOUT,
    SIGMA_MAX,
    LutLayout,
)
from cdrf_addon.core.reflectance.model import RING, SPHERE, Model, ring, sphere

Values = NDArray[np.float64]
MODELS = {SPHERE: sphere(), RING: ring()}
SIZES = (
    *((64, 32), (128, 64), (192, 128), (160, 160), (192, 160), (160, 192), (192, 192)),
    *((256, 128), (256, 160), (256, 192), (256, 256), (512, 256)),
)
MAPPING_SIZES = ((128, 64), (192, 192), (512, 256))
FILTER_SIZES = ((192, 192), (512, 256))
LOG_KNEE = 0.05


@dataclass(frozen=True)
class Mapping:
    """One axis of the table: the shader's nodes, and the values at the texels."""

    name: str
    nodes: Callable[[TreeBuilder, Any], Any]
    inverse: Callable[[Values], Values]


def _angle(b: TreeBuilder, cosine: Any) -> Any:
    """1 - 2 theta / pi, from -1 to 1."""
    return b.math("MULTIPLY_ADD", b.math("ARCCOSINE", cosine), -2.0 / math.pi, 1.0)


def _signed_root(b: TreeBuilder, cosine: Any) -> Any:
    root = b.math("SQRT", b.math("ABSOLUTE", cosine))
    return b.math("MULTIPLY", root, b.math("SIGN", cosine))


def _log(b: TreeBuilder, sigma: Any) -> Any:
    grown = b.math("MULTIPLY_ADD", sigma, 1.0 / LOG_KNEE, 1.0)
    scale = 1.0 / math.log1p(SIGMA_MAX / LOG_KNEE)
    return b.math("MULTIPLY", b.math("LOGARITHM", grown, math.e), scale)


def _root(b: TreeBuilder, sigma: Any) -> Any:
    return b.math("SQRT", b.math("MULTIPLY", sigma, 1.0 / SIGMA_MAX))


ROOT_COSINE, ROOT_SIGMA = "sign(c) √\\|c\\|", "√σ"
COLUMNS = {
    mapping.name: mapping
    for mapping in (
        Mapping(ROOT_COSINE, _signed_root, lambda q: np.sign(q) * q**2),
        Mapping("c", lambda _, cosine: cosine, lambda q: q),
        Mapping("θ", _angle, lambda q: np.cos((1.0 - q) * math.pi / 2.0)),
    )
}
ROWS = {
    mapping.name: mapping
    for mapping in (
        Mapping(ROOT_SIGMA, _root, lambda w: SIGMA_MAX * w**2),
        Mapping("σ", lambda b, s: b.math("MULTIPLY", s, 1.0 / SIGMA_MAX), lambda w: SIGMA_MAX * w),
        Mapping(
            "log(1 + 20 σ)",
            _log,
            lambda w: LOG_KNEE * np.expm1(w * math.log1p(SIGMA_MAX / LOG_KNEE)),
        ),
    )
}


@dataclass(frozen=True)
class Variant:
    """One way to make and to read a table."""

    width: int = DEFAULT_LAYOUT.width
    height: int = DEFAULT_LAYOUT.height
    storage: str = "float"
    columns: str = ROOT_COSINE
    rows: str = ROOT_SIGMA
    filter: str = "Linear"
    projection: str = "TUBE"

    @property
    def layout(self) -> LutLayout:
        """Texels, and how the axes lie on them."""
        return LutLayout(self.width, self.height)

    @property
    def kib(self) -> float:
        """Four channels in the .blend and on the graphics card."""
        return self.width * self.height * 4 * (4 if self.storage == "float" else 2) / 1024

    def table(self, model: Model) -> NDArray[np.float32]:
        """Tabulate a model."""
        layout = self.layout
        u = (np.arange(layout.width) + 0.5) / layout.width
        q = np.clip((1.0 - 2.0 * u) / layout.seam_factor, -1.0, 1.0)
        w = np.arange(layout.height) / (layout.height - 1.0)
        theta = np.arccos(np.clip(COLUMNS[self.columns].inverse(q), -1.0, 1.0))
        sigma = ROWS[self.rows].inverse(w)
        return model.evaluate(theta[None, :], sigma[:, None]).astype(np.float32)

    def nodes(self, b: TreeBuilder, image: bpy.types.Image, cosine: Any, sigma: Any) -> Any:
        """Wire the look-up; the socket of its red channel."""
        layout = self.layout
        q = COLUMNS[self.columns].nodes(b, cosine)
        w = ROWS[self.rows].nodes(b, sigma)
        v = b.math("MULTIPLY_ADD", w, layout.row_scale, layout.row_offset)
        if self.projection == "TUBE":
            p = b.math("MULTIPLY", q, math.pi * layout.seam_factor)
            across = b.math("MULTIPLY_ADD", b.math("SINE", p), 0.5, 0.5)
            along = b.math("MULTIPLY_ADD", b.math("COSINE", p), 0.5, 0.5)
            place = b.combine(across, along, v)
        else:
            u = b.math("MULTIPLY_ADD", q, -0.5 * layout.seam_factor, 0.5)
            place = b.combine(u, v, 0.0)
        texture = b.node(
            "ShaderNodeTexImage",
            image=image,
            projection=self.projection,
            interpolation=self.filter,
            extension="EXTEND",
        )
        b.feed(texture.inputs["Vector"], place)
        value = b.node("ShaderNodeSeparateColor")
        b.feed(value.inputs["Color"], texture.outputs["Color"])
        return value.outputs["Red"]


def variants() -> list[Variant]:
    """Every size with either storage; the mappings and the filters at some sizes."""
    found = [Variant(w, h, storage) for (w, h), storage in product(SIZES, ("float", "half"))]
    found += [
        Variant(w, h, columns=columns, rows=rows)
        for (w, h), columns, rows in product(MAPPING_SIZES, COLUMNS, ROWS)
    ]
    filters, projections = ("Linear", "Cubic", "Closest"), ("TUBE", "FLAT")
    found += [
        Variant(w, h, filter=name, projection=projection)
        for (w, h), name, projection in product(FILTER_SIZES, filters, projections)
    ]
    return list(dict.fromkeys(found))
