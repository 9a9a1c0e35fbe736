# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's figures 1 to 4, and the lobes of its table."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdrf_addon.core.reflectance.model import ring, sphere

from ..paper import stored
from ..settings import Settings
from .drawing import COLOURS, brighter, figure, picture

NOSE, CHEEK = (0.42, 0.58, 0.38, 0.54), (0.54, 0.70, 0.36, 0.52)
"""Left, right, bottom and top of the close-ups, parts of the picture."""


def paper_figures(settings: Settings) -> list[str]:
    """Fig. 1 to 4; names of the files."""
    drawn = []
    heads = stored(settings, "figure3")
    if heads:
        _workflow(settings, heads)
        _heads(settings, heads)
        drawn += ["figure1.png", "figure3.png"]
    spheres = stored(settings, "figure2")
    if spheres:
        _spheres(settings, spheres)
        drawn.append("figure2.png")
    statue = stored(settings, "figure4")
    if statue:
        factor = brighter(statue, "Path tracing")
        with figure(settings.pictures / "figure4.png", 2.6 * len(statue), 2.8) as sheet:
            for axes, (name, values) in zip(
                sheet.subplots(1, len(statue)), statue.items(), strict=True
            ):
                picture(axes, values[..., :3] * factor, name)
        drawn.append("figure4.png")
    return drawn


def _workflow(settings: Settings, heads: Mapping[str, NDArray[Any]]) -> None:
    with figure(settings.pictures / "figure1.png", 11.0, 2.9) as sheet:
        mesh, curvature, table, render = sheet.subplots(1, 4)
        picture(mesh, heads["mesh"][..., :3], "1. mesh")
        picture(curvature, heads["curvature"][..., :3], "2. curvature κ, once")
        theta, sigma = np.linspace(0.0, math.pi, 200), np.linspace(0.0, 1.5, 120)
        values = sphere().evaluate(theta[None, :], sigma[:, None])
        table.imshow(
            values,
            origin="lower",
            aspect="auto",
            cmap="gray",
            vmin=0.0,
            vmax=1.0,
            extent=(0.0, 180.0, 0.0, 1.5),
        )
        table.set_title("3. look-up table f(θ, σ)", fontsize=8)
        table.set_xlabel("θ, degrees")
        table.set_ylabel("σ = σ₀ κ")
        table.grid(visible=False)
        picture(
            render, heads["CDRF, shadows"][..., :3] * brighter(heads, "Path tracing"), "4. render"
        )


def _heads(settings: Settings, heads: Mapping[str, NDArray[Any]]) -> None:
    names = ("curvature", "Lambert", "Texture blurring", "CDRF, shadows", "Path tracing")
    factor = brighter(heads, "Path tracing")
    size = len(heads["Lambert"])
    with figure(settings.pictures / "figure3.png", 11.5, 6.9) as sheet:
        rows = sheet.subplots(3, len(names))
        for column, name in enumerate(names):
            scale = 1.0 if name == "curvature" else factor
            whole = heads[name][..., :3] * scale
            picture(rows[0][column], whole, name)
            for row, (left, right, low, high) in enumerate((NOSE, CHEEK), start=1):
                x, y = (
                    slice(int(left * size), int(right * size)),
                    slice(int(low * size), int(high * size)),
                )
                title = ("nose", "cheek")[row - 1] if column == 0 else ""
                picture(rows[row][column], whole[y, x], title)


def _spheres(settings: Settings, spheres: Mapping[str, NDArray[Any]]) -> None:
    with figure(settings.pictures / "figure2.png", 2.2 * len(spheres), 2.5) as sheet:
        for axes, (name, values) in zip(
            sheet.subplots(1, len(spheres)), spheres.items(), strict=True
        ):
            picture(axes, values[..., :3], f"ratio {name}")


def lobes(settings: Settings) -> None:
    """The two closed forms beside Lambert, for Fig. 1's table to be read."""
    theta = np.linspace(0.0, math.pi, 240)
    with figure(settings.pictures / "lobes.svg", 4.6, 3.0) as sheet:
        axes = sheet.subplots()
        axes.plot(
            np.degrees(theta),
            np.maximum(np.cos(theta), 0.0),
            color=COLOURS["Lambert"],
            label="Lambert",
        )
        for sigma, style in ((0.2, "-"), (0.6, "--")):
            for name, model in (("CDRF ring", ring()), ("CDRF sphere", sphere())):
                axes.plot(
                    np.degrees(theta),
                    model.evaluate(theta, np.full_like(theta, sigma)),
                    style,
                    color=COLOURS[name],
                    label=f"{name}, σ = {sigma:g}",
                )
        axes.set_xlabel("θ, degrees")
        axes.set_ylabel("f(θ, σ)")
        axes.legend(fontsize=7)
