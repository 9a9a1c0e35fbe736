# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes docs/results/report.md and stability.md, pictures in report/, raw results in data/.

    ./dev bench report                  everything, from nothing: many hours
    ./dev bench report --missing        what is not there yet
    ./dev bench report --sample --docs output/sample         a few minutes
    ./dev bench report --timing         the times, anew: on a quiet machine
    ./dev bench report --timing --missing       rounds that are not there yet
    ./dev bench report --only page      figures and pages from the raw results

Stages are paper, errors, timing, stability and page. References are kept by their parameters in the
folder given by --cache and used again. Every result is kept as soon as it is there, so the command
may be stopped at any time and called again with --missing.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path

from ..common.files import RESULTS, ROOT

STAGES = ("paper", "errors", "timing", "stability", "page")


def parse() -> argparse.Namespace:
    """Read the command line."""
    plain = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=plain)
    add = parser.add_argument
    add("--sample", action="store_true", help="a quick sample, into --docs")
    add("--missing", action="store_true", help="leave alone what is there")
    add("--only", nargs="+", choices=STAGES, default=[], help="these stages; pages are always made")
    add("--timing", action="store_true", help="the same as --only timing")
    add("--rounds", type=int, default=0, help="rounds of timing in all (default: 5)")
    add("--parts", nargs="+", default=[], help="parts of timing: draws, frames, preparation, ...")
    add("--cells", nargs="+", default=["*"], help="patterns of scenes, such as 'head, *'")
    add("--contenders", nargs="+", default=["*"], help="patterns of contenders' names")
    add("--minutes", type=float, default=float("inf"), help="begin nothing new after so long")
    add("--docs", type=Path, default=None, help="folder of the pages (default: docs/results)")
    add("--cache", type=Path, default=ROOT / "output" / "report", help="folder of references")
    return parser.parse_args()


def main() -> None:
    """Run the stages that are asked for."""
    chosen = parse()
    cache = chosen.cache.resolve()
    # Measured spheres go beside the references, not into the user's own files.
    os.environ["BLENDER_USER_DATAFILES"] = str(cache / "user")
    import bpy  # noqa: F401  (must come before anything that needs it, after the folder is set)

    from cdrf_addon import register, unregister

    from . import matrix, page, paper, settings, stability, timing
    from .figures.draw import draw_all

    make = settings.quick if chosen.sample else settings.full
    docs = chosen.docs or (ROOT / "output" / "sample" if chosen.sample else RESULTS)
    here = make(docs.resolve(), cache)
    stages = ["timing"] if chosen.timing else chosen.only or list(STAGES)
    deadline = time.monotonic() + 60.0 * chosen.minutes
    register()
    try:
        if "errors" in stages:
            matrix.measure(here, chosen.cells, chosen.contenders,
                           missing=chosen.missing, deadline=deadline)  # fmt: skip
            for name, extra in matrix.EXTRAS.items():
                known = here.read("errors").get(name)
                if not (chosen.missing and known) and time.monotonic() < deadline:
                    extra(here)
        if "paper" in stages and time.monotonic() < deadline:
            paper.run(here, missing=chosen.missing)
        if "timing" in stages:
            parts = chosen.parts or list(timing.PARTS)
            if not chosen.missing:
                timing.discard(here, parts)
            timing.run(here, chosen.rounds or here.rounds, parts, deadline)
        if "stability" in stages and time.monotonic() < deadline:
            stability.run(here)
        draw_all(here)
        stability.write(here)
        page.write(here)
    finally:
        unregister()


if __name__ == "__main__":
    main()
