# SPDX-License-Identifier: GPL-3.0-or-later
"""Where pages, pictures and raw results are, and how raw results are read and written."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[3]
MESHES = ROOT / "tests" / "data"
RESULTS = ROOT / "docs" / "results"
"""Folder of the pages; their pictures are in `images`, raw results in `data`."""
IMAGES = RESULTS / "images"
DATA = RESULTS / "data"


def read_results(name: str) -> dict[str, Any]:
    """Return the raw results of a benchmark; empty if it has not run."""
    path = DATA / f"{name}.json"
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    return found


def write_results(name: str, results: Any) -> None:
    """Write the raw results of a benchmark."""
    path = DATA / f"{name}.json"
    path.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")


def write_page(name: str, text: str) -> None:
    """Write the page of a benchmark."""
    (RESULTS / f"{name}.md").write_text(text, encoding="utf-8")


def rounded(value: Any, digits: int) -> Any:
    """Keep so many digits of every number, as the rest is noise; keys become text."""
    if isinstance(value, dict):
        return {str(key): rounded(part, digits) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(part, digits) for part in value]
    return float(f"{value:.{digits}g}") if isinstance(value, float) else value
