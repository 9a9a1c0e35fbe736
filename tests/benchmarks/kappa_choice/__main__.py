# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line of the benchmark of the curvatures."""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from ..common.files import MESHES, read_results, rounded, write_page, write_results
from ..common.machine import machine
from . import __doc__ as description
from .measure import PARTS, Study
from .page import Report


def main() -> None:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--bunny", type=Path, default=MESHES / "stanford_bunny.obj")
    parser.add_argument("--cache", type=Path, default=Path(tempfile.gettempdir()) / "kappa_choice")
    parser.add_argument("--size", type=int, default=160, help="pixels along an edge")
    parser.add_argument("--samples", type=int, default=512)
    parser.add_argument("--only", nargs="*", choices=PARTS, default=list(PARTS))
    options = parser.parse_args()
    results = read_results("kappa_choice")
    options.cache.mkdir(parents=True, exist_ok=True)
    shapes = {"head": MESHES / "human_head.obj"}
    if options.bunny.exists():
        shapes["bunny"] = options.bunny
    else:
        print(f"{options.bunny} is not there; the head only.", flush=True)
    study = Study(shapes, options.cache, options.size, options.samples)
    for part in options.only:
        print(f"{part} ...", flush=True)
        results |= {"machine": machine(), "size": options.size, "samples": options.samples}
        PARTS[part](study, results)
        results = rounded(results, 5)
        write_results("kappa_choice", results)
    write_page("kappa_choice", Report(results).page())
