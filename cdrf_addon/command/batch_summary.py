# SPDX-License-Identifier: GPL-3.0-or-later
"""What became of each input and picture, and the JSON summary that holds it."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import bpy

FORMAT = 1


@dataclass(frozen=True)
class PictureRecord:
    """One picture; an entry of its input's record.

    Attributes:
        path: The file.
        key: Hash of the settings it was made with; see `batch_journal.settings_key`.
        seconds: Time it took; 0 if an earlier run has made it.
        resumed: Whether an earlier run has made it.
        frame: Its frame; None for the curvature, or if an earlier run has made it.
        sigma0: Its scatter distance in world units; None for the file's own.
        lambert: The same without scattering, if that was asked for.
        side_by_side: Both in one, if that was asked for.
    """

    path: str
    key: str
    seconds: float = 0.0
    resumed: bool = False
    frame: int | None = None
    sigma0: float | None = None
    lambert: str | None = None
    side_by_side: str | None = None

    def as_json(self) -> dict[str, Any]:
        """Return the record without the names that do not apply to it."""
        values = asdict(self)
        absent = {name for name in ("lambert", "side_by_side") if values[name] is None}
        if self.frame is None:
            absent |= {"frame", "sigma0"}
        return {name: value for name, value in values.items() if name not in absent}


@dataclass
class SceneRecord:
    """What became of one input; an entry of the JSON summary.

    Attributes:
        input: The file.
        state: "started", "done", "failed" or "stopped".
        error: Why it failed.
        warnings: A sentence each.
        seconds: Time of each stage.
        vertices: Number of vertices with a curvature.
        images: Its pictures.
    """

    input: str
    state: str = "started"
    error: str = ""
    warnings: list[str] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)
    vertices: int = 0
    images: list[PictureRecord] = field(default_factory=list)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Add the time spent inside the block to a stage of this scene."""
        start = time.perf_counter()
        try:
            yield
        finally:
            spent = time.perf_counter() - start
            self.seconds[name] = round(self.seconds.get(name, 0.0) + spent, 4)

    def as_json(self) -> dict[str, Any]:
        """Return the record as JSON has it."""
        return asdict(self) | {"images": [image.as_json() for image in self.images]}

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> SceneRecord:
        """Read what `as_json` has written.

        Raises:
            TypeError: It is something else.
        """
        record = cls(**values)
        record.images = [PictureRecord(**image) for image in values["images"]]
        return record


def write_summary(path: Path, scenes: Sequence[SceneRecord], seconds: float) -> None:
    """Write the JSON summary; it appears whole or not at all.

    Args:
        path: The file.
        scenes: The records of all inputs so far.
        seconds: Time of the whole run.
    """
    content = {
        "format": FORMAT,
        "blender": bpy.app.version_string,
        "python": sys.version.split()[0],
        "arguments": sys.argv[1:],
        "seconds": round(seconds, 3),
        "failed": sum(scene.state == "failed" for scene in scenes),
        "scenes": [scene.as_json() for scene in scenes],
    }
    part = path.with_suffix(".part")
    part.write_text(json.dumps(content, indent=2) + "\n")
    part.replace(path)
