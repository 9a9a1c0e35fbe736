# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's Fig. 2 again: what each model misses on a sphere, seen from five directions.

N runs along the circle through the view and the light. A walk knows only the angle between N and
the view, so one set of walks serves both sides and every light.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cdrf_addon.core.reflectance.ring_model import ring_reflectance
from cdrf_addon.core.reflectance.sphere_model import sphere_reflectance
from cdrf_addon.core.scattering.node_radius import sigma0_per_radius
from cdrf_addon.core.walk import view
from cdrf_addon.core.walk.medium import medium
from cdrf_addon.core.walk.sphere_walk import BALL, views, walk

from ..estimators.figures import COLOURS, STYLE, save_figure

BETWEEN = (0, 40, 80, 120, 160)
"""Degrees from the view to the light."""
COLOUR, CURVED, ENTRY = 0.62, 0.1, (1.0, 1.4)
MODELS = ("Lambert", "ring", "sphere", "view-dependent")
ANGLES = np.arange(-85, 86, 5)
Values = NDArray[np.float64]


def seen(walks: int, seed: int) -> tuple[Values, Values]:
    """Radiance over A along the circle (light, angle), and its squared noise (light,)."""
    omega = float(medium("RANDOM_WALK", COLOUR, 1.0).single_scattering)
    halves = np.zeros((2, len(BETWEEN), len(ANGLES)))
    for half in range(2):
        random = np.random.default_rng([seed, half])
        for degrees in range(0, 86, 5):
            entered = views(float(np.cos(np.radians(degrees))), walks, *ENTRY, random)
            out = walk(BALL, CURVED, entered, random)
            weights = out.weights(omega)
            for side in (-1, 1) if degrees else (1,):
                # In the walk's frame N is +z and the view on the side of +x.
                angle = np.radians(degrees - side * np.array(BETWEEN))
                lights = np.stack((np.sin(angle), 0.0 * angle, np.cos(angle)), axis=1)
                shown = out.radiance(weights, lights) / COLOUR
                halves[half, :, int(np.searchsorted(ANGLES, side * degrees))] = shown
    noise = ((halves[0] - halves[1]) ** 2).mean(axis=1) / 4.0
    return halves.mean(axis=0), np.asarray(noise)


def shown_by(model: str, sigma: float) -> Values:
    """Radiance over A of a model, (light, angle)."""
    n, to_light = np.radians(ANGLES), np.radians(BETWEEN)[:, None]
    theta = np.abs((n - to_light + np.pi) % (2.0 * np.pi) - np.pi)
    if model == "Lambert":
        return np.asarray(np.maximum(np.cos(theta), 0.0))
    if model != "view-dependent":
        reflectance = ring_reflectance if model == "ring" else sphere_reflectance
        return np.asarray(reflectance(theta, sigma))
    normal = np.stack((np.sin(n), 0.0 * n, np.cos(n)), axis=-1)
    light = np.stack((np.sin(to_light), 0.0 * to_light, np.cos(to_light)), axis=-1)
    size, colour = np.array([CURVED]), np.array([COLOUR])
    own = view.walk_model("RANDOM_WALK", *ENTRY)
    toward = np.array([0.0, 0.0, 1.0])
    return own.radiance(colour, normal, toward, light, size, size)[..., 0] / COLOUR


def measure(walks: int, seed: int) -> dict[str, Any]:
    """Residuals and their RMS, the noise taken off; ring and sphere also at their best width."""
    walked, noise = seen(walks, seed)
    sigma = CURVED * float(sigma0_per_radius(COLOUR))

    def missed(model: str, width: float) -> Values:
        square = ((shown_by(model, width) - walked) ** 2).mean(axis=1) - noise
        return np.asarray(np.sqrt(np.maximum(square, 0.0)))

    rows = {
        name: {
            "residual": (shown_by(name, sigma) - walked).tolist(),
            "rms": missed(name, sigma).tolist(),
        }
        for name in MODELS
    }
    for name in ("ring", "sphere"):
        widths = np.linspace(0.0, 1.0, 101)
        sums = [float((missed(name, width) ** 2).sum()) for width in widths]
        best = widths[int(np.argmin(sums))]
        rows[f"{name}, best width"] = {"rms": missed(name, best).tolist(), "sigma": float(best)}
    return {
        "colour": COLOUR,
        "curved": CURVED,
        "sigma": sigma,
        "walks": 2 * walks,
        "between": list(BETWEEN),
        "angles": ANGLES.tolist(),
        "noise": np.sqrt(noise).tolist(),
        "models": rows,
    }


def draw(found: dict[str, Any], path: Path) -> None:
    """A panel for each direction: residual against the angle from the view to N."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(11.0, 2.9), layout="constrained")
        axes = figure.subplots(1, len(found["between"]), sharey=True)
        for i, (axis, between) in enumerate(zip(axes, found["between"], strict=True)):
            for name, colour in zip(MODELS, (*COLOURS[4:6], *COLOURS[:2]), strict=True):
                axis.plot(
                    found["angles"],
                    found["models"][name]["residual"][i],
                    color=colour,
                    label=name,
                    linewidth=1.2,
                )
            axis.axhline(0.0, color="black", linewidth=0.5)
            axis.set_title(f"light {between}° from the view")
            axis.set_xlabel("view to N, degrees")
            axis.set_xticks([-80, -40, 0, 40, 80])
        axes[0].set_ylabel("(model − walk) / A")
        axes[0].legend(fontsize=7)
        save_figure(figure, path)
