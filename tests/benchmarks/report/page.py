# SPDX-License-Identifier: GPL-3.0-or-later
"""results/report.md, from the raw results alone: every number in it is looked up, none is typed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..common.markdown import facts, generated
from ..view_dependence.page import default_sentences
from ..view_dependence.study import read as read_study
from .contenders import DEFAULT
from .page_errors import error_part, scenes_page
from .page_paper import claim_sentences, paper_part
from .page_times import timing_part
from .results import Results
from .settings import Settings
from .standings import matrix_sentences, row_of


def head(results: Results) -> list[str]:
    """Title, what it was measured on, and the conclusions in one place."""
    lines = ["# Error against run time, beside what an artist would pick instead", ""]
    lines += [generated("report"), ""]
    for name, stage in (
        ("Pictures and errors", results.errors),
        ("Times", results.timing),
        ("The paper's part", results.paper),
    ):
        if stage:
            lines.append(f"{name}: {facts(stage['machine'])}.  ")
    lines += [
        "EEVEE runs on a software rasteriser here: conclusions compare times as ratios of "
        "interleaved runs, and even these may be others on a graphics card. Spreads are 10 % to "
        "90 %, of fewer than five runs least to most.",
        "",
    ]
    return [*lines, "## In short", "", *(f"- {line}" for line in conclusions(results)), ""]


def conclusions(results: Results) -> list[str]:
    """A plain sentence for each section."""
    looks = any(row_of(cell, DEFAULT) for cell in results.cells.values())
    found = [
        *claim_sentences(results),
        *default_sentences(read_study(results.settings.data), alone=not looks),
        *matrix_sentences(results),
    ]
    if results.stability:
        cases = [case for test in results.stability["tests"] for case in test["cases"]]
        good = sum(case["outcome"] == "passed" for case in cases)
        found.append(
            f"Of {len(cases)} extreme cases {good} came out as they should "
            "([stability.md](stability.md))."
        )
    return found


def write(settings: Settings) -> None:
    """Write results/report.md, and results/report_scenes.md if there is more than fits on it."""
    results = Results(settings)
    _write(
        settings.docs / "report.md",
        [
            *head(results),
            *paper_part(results),
            *error_part(results),
            *timing_part(results),
            "## Numerical stability",
            "",
            "A page of its own: [stability.md](stability.md)."
            if results.stability
            else "Not run yet.",
        ],
    )
    others = scenes_page(results)
    if others:
        _write(settings.docs / "report_scenes.md", others)


def _write(path: Path, lines: Sequence[str]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")
