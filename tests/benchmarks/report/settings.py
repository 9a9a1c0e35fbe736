# SPDX-License-Identifier: GPL-3.0-or-later
"""How large and how fine everything is, and where it goes."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..common.files import rounded

SEED = 20111106
"""Of everything random; the second picture of a reference takes the next number."""


@dataclass(frozen=True)
class Settings:
    """One way of running the report.

    Attributes:
        docs: Folder of the pages; pictures go to `report` in it, raw results to `data`.
        cache: References and path-traced spheres, by their parameters.
        size: Pixels of the matrix, each way.
        large: Pixels of the pictures of the paper's figures.
        samples: Paths through a pixel in each of the two pictures of a reference.
        film: EEVEE samples by default.
        level: Subdivisions of the shapes.
        atlas: Texels of texture blurring, each way.
        quality: Of measured spheres (cdrf_addon/measuring).
        timed: EEVEE samples that are timed, then Cycles'.
        rounds: Times that each timing is repeated.
        sample: Whether this is the quick sample.
    """

    docs: Path
    cache: Path
    size: int = 128
    large: int = 512
    samples: int = 512
    film: int = 16
    level: int = 2
    atlas: int = 512
    quality: str = "default"
    timed: tuple[tuple[int, ...], tuple[int, ...]] = ((1, 9, 25), (1, 5, 13))
    rounds: int = 5
    sample: bool = False

    @property
    def data(self) -> Path:
        """Folder of raw results."""
        return self.docs / "data"

    @property
    def pictures(self) -> Path:
        """Folder of pictures and plots."""
        return self.docs / "report"

    def file_of(self, name: str) -> Path:
        """Return the file of a stage's raw results."""
        return self.data / f"report_{name}.json"

    def read(self, name: str) -> dict[str, Any]:
        """Raw results of a stage; empty if it has not run."""
        path = self.file_of(name)
        found: dict[str, Any] = (
            json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
        )
        return found

    def write(self, name: str, results: dict[str, Any]) -> None:
        """Keep the raw results of a stage, dated."""
        self.data.mkdir(parents=True, exist_ok=True)
        results["date"] = time.strftime("%Y-%m-%d")
        text = json.dumps(rounded(results, 6), indent=1, sort_keys=True, ensure_ascii=False)
        path = self.file_of(name)
        # In one step: a run that is stopped must leave what it had.
        part = path.with_suffix(".part")
        part.write_text(text + "\n", encoding="utf-8")
        part.replace(path)


def full(docs: Path, cache: Path) -> Settings:
    """Everything that the page needs."""
    return Settings(docs, cache)


def quick(docs: Path, cache: Path) -> Settings:
    """A sample of everything, for the tests."""
    return Settings(
        docs,
        cache,
        size=48,
        large=64,
        samples=32,
        film=4,
        level=1,
        atlas=96,
        quality="preview",
        timed=((1, 5), (1, 3)),
        rounds=1,
        sample=True,
    )
