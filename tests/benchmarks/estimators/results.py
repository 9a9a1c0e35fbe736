# SPDX-License-Identifier: GPL-3.0-or-later
"""The rows of measurements, and the JSON file that keeps them."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from ..common.files import ROOT


@dataclass(frozen=True)
class Row:
    """One measurement; errors are parts of the surface's RMS curvedness."""

    surface: str
    size: int
    """Vertices wanted; a surface has about as many."""
    noise: float
    """Standard deviation of the positions along the normal, in mean edges."""
    method: str
    rings: int | None
    vertices: int = 0
    seconds: float = math.nan
    """CPU seconds, of all threads."""
    wall: float = math.nan
    megabytes: float = math.nan
    """Peak above what the process held with the mesh loaded."""
    filled: int = 0
    code: str = ""
    """Fingerprint of the sources measured."""
    failure: str = ""
    errors: dict[str, float] = field(default_factory=dict)
    """Keys such as "inner kappa rms" and "border k1 worst"."""

    @property
    def key(self) -> tuple[Any, ...]:
        return self.surface, self.size, self.noise, self.method, self.rings


@dataclass
class Results:
    """All there is in the JSON file."""

    machine: dict[str, str] = field(default_factory=dict)
    meshes: dict[str, dict[str, dict[str, int]]] = field(default_factory=dict)
    rows: dict[tuple[Any, ...], Row] = field(default_factory=dict)
    """By `Row.key`."""
    scaling: dict[tuple[Any, ...], Row] = field(default_factory=dict)
    """The whole pipeline, on one surface at more sizes; of the operator, `CLICK`, too."""

    @classmethod
    def load(cls, path: Path) -> Results:
        """Read a file, or start with nothing."""
        if not path.exists():
            return cls()
        stored = json.loads(path.read_text())
        tables = {}
        for name in ("rows", "scaling"):
            rows = [Row(**row) for row in stored[name]]
            tables[name] = {row.key: row for row in rows}
        return cls(stored["machine"], stored["meshes"], **tables)

    def save(self, path: Path) -> None:
        """Write a file, a measurement a line."""
        lines = [f'{{"machine": {json.dumps(self.machine)},', '"meshes": {']
        meshes = [f"{json.dumps(name)}: {json.dumps(facts)}" for name, facts in self.meshes.items()]
        lines += [",\n".join(meshes) + "},"]
        for name, table in (("rows", self.rows), ("scaling", self.scaling)):
            rows = ",\n".join(json.dumps(_brief(asdict(row))) for row in table.values())
            lines += [f'"{name}": [\n{rows}]' + ("," if name == "rows" else "}")]
        path.write_text("\n".join(lines) + "\n")


def _brief(value: Any) -> Any:
    """Four digits are enough, and what is empty need not be written."""
    if isinstance(value, dict):
        return {key: _brief(part) for key, part in value.items() if part not in ("", {})}
    return float(f"{value:.4g}") if isinstance(value, float) else value


def fingerprint() -> str:
    """Tell versions of the measured sources apart."""
    digest = hashlib.sha256()
    for path in (
        *sorted((ROOT / "cdrf_addon" / "core").rglob("*.py")),
        ROOT / "tests/support/surfaces.py",
    ):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:8]
