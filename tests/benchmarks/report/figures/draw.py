# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws all figures of the report."""

from __future__ import annotations

from ..settings import Settings
from .paper import lobes, paper_figures
from .plots import pareto, preparation_plot, scaling_plot
from .scenes import cell_pictures


def draw_all(settings: Settings) -> None:
    """Draw everything of which there are results."""
    paper_figures(settings)
    lobes(settings)
    cell_pictures(settings)
    pareto(settings)
    preparation_plot(settings)
    scaling_plot(settings)
