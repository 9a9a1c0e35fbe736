# SPDX-License-Identifier: GPL-3.0-or-later
"""How the report's figures look, and how a picture is drawn and written."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from ..metrics import displayed

STYLE: dict[Any, Any] = {
    "svg.hashsalt": "cdrf",
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e4e4e8",
    "figure.dpi": 100,
}
COLOURS = {
    "Lambert": "#8c8c94",
    "CDRF ring": "#d65f00",
    "CDRF sphere": "#008c5a",
    "CDRF path-traced look": "#00a8b8",
    "CDRF profile": "#c8408c",
    "CDRF measured": "#0061c7",
    "EEVEE scattering": "#7a4fbf",
    "Texture blurring": "#b08800",
    "Cycles": "#1a1a1e",
}
COLOURS_IN_FILE = 256


@contextmanager
def figure(path: Path, width: float, height: float) -> Iterator[Figure]:
    """Draw on a figure, which is written without a date; PNGs with a palette."""
    with mpl.rc_context(STYLE):
        sheet = Figure(figsize=(width, height), layout="constrained")
        yield sheet
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix == ".svg":
            sheet.savefig(path, format="svg", metadata={"Date": None})
            return
        buffer = io.BytesIO()
        sheet.savefig(buffer, format="png", metadata={"Software": None})
        small = Image.open(buffer).convert("RGB").quantize(COLOURS_IN_FILE)
        small.save(path, optimize=True)


def picture(axes: Axes, values: NDArray[Any], title: str = "") -> None:
    """Show linear radiance as a screen does."""
    axes.imshow(displayed(values.astype(np.float64)), origin="lower", interpolation="nearest")
    plain(axes, title)


def plain(axes: Axes, title: str = "") -> None:
    """Take everything but the title off."""
    axes.set_axis_off()
    if title:
        axes.set_title(title, fontsize=8)


def brighter(pictures: Mapping[str, NDArray[Any]], key: str) -> float:
    """Factor that brings the brightest thousandth of a picture near white."""
    bright = float(np.percentile(pictures[key][..., :3].astype(np.float64).max(axis=-1), 99.9))
    return 0.9 / max(bright, 1e-6)
