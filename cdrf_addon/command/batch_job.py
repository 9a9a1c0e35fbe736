# SPDX-License-Identifier: GPL-3.0-or-later
"""One input of the batch: the names of its pictures, and which of them are there already."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .batch_options import BatchOptions


@dataclass(frozen=True)
class Shot:
    """One picture that is to be rendered.

    Attributes:
        frame: The scene's frame.
        sigma0: Scatter distance in world units; None for the file's own.
        target: The picture's file.
        lambert: File of the same without scattering.
    """

    frame: int
    sigma0: float | None
    target: Path
    lambert: Path

    @property
    def side_by_side(self) -> Path:
        """File of both in one."""
        return self.target.with_name(f"{self.target.stem}_beside_lambert{self.target.suffix}")


@dataclass(frozen=True)
class SceneJob:
    """One input and what is to be rendered of it.

    Attributes:
        path: The file.
        stem: Start of the pictures' names, unique in the run.
        options: The command line.
        done: Settings' key of each picture that an earlier run has made.
    """

    path: Path
    stem: str
    options: BatchOptions
    done: Mapping[str, str]

    @property
    def from_mesh_file(self) -> bool:
        """Whether the input is a bare mesh in place of a scene."""
        return self.path.suffix.lower() != ".blend"

    @property
    def sigma0s(self) -> list[float | None]:
        """Scatter distances, a picture each; None for the file's own."""
        return list(dict.fromkeys(self.options.sigma0)) or [None]

    @property
    def curvature_picture(self) -> Path:
        """File of the curvature in colours."""
        return self.options.output / f"{self.stem}_curvature.png"

    @property
    def saved_blend(self) -> Path:
        """File of the prepared scene."""
        return self.options.output / f"{self.stem}.blend"

    def shots(self, frame: int) -> list[Shot]:
        """List the pictures of one frame."""
        start, end = self.options.output / self.stem, f"{frame:04d}{self.options.suffix}"
        lambert = start.with_name(f"{self.stem}_lambert_{end}")
        return [
            Shot(frame, value, start.with_name(f"{self.stem}_{sigma0_label(value)}_{end}"), lambert)
            for value in self.sigma0s
        ]

    def planned(self) -> list[Path]:
        """List the pictures that the command line names; empty if that takes opening the file."""
        if not self.options.frames:
            return []
        targets = [shot.target for frame in self.options.frames for shot in self.shots(frame)]
        return targets + [self.curvature_picture] * bool(self.options.curvature)

    def is_made(self, target: Path, key: str) -> bool:
        """Whether an earlier run has made the picture with the key's settings, and it may stay."""
        if self.options.force or self.done.get(str(target)) != key:
            return False
        return target.exists() and target.stat().st_size > 0

    def as_json(self) -> dict[str, Any]:
        """Return the job as the JSON order of its process."""
        return {
            "path": str(self.path),
            "stem": self.stem,
            "options": self.options.as_json(),
            "done": dict(self.done),
        }

    @classmethod
    def from_json(cls, text: str) -> SceneJob:
        """Read the JSON order of a process."""
        order = json.loads(text)
        options = BatchOptions.from_json(order["options"])
        return cls(Path(order["path"]), order["stem"], options, order["done"])


def sigma0_label(value: float | None) -> str:
    """Name a scatter distance in a file's name."""
    # repr differs for any two numbers, so no picture overwrites another.
    return "cdrf" if value is None else f"s{value!r}".removesuffix(".0")


def unique_stems(paths: Sequence[Path]) -> list[str]:
    """Name the pictures of each input: its stem, numbered where two inputs share one."""
    stems: list[str] = []
    for path in paths:
        stem, number = path.stem, 2
        while stem in stems:
            stem, number = f"{path.stem}-{number}", number + 1
        stems.append(stem)
    return stems
