# SPDX-License-Identifier: GPL-3.0-or-later
"""Who is closest to path tracing, where and how often: sentences from the matrix."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from .cells import MATERIALS
from .contenders import (
    DEFAULT,
    EEVEE,
    LAMBERT,
    LOOK,
    PAPER,
    PATHS,
    PRINCIPLED,
    SHADOWS,
    SPHERE,
    TEXTURE,
    Contender,
    contender_of,
)
from .lights import RIGS
from .matrix import wanted_cells
from .results import Results
from .shapes import SHAPES

Row = Mapping[str, Any]

MEASURED, MEASURED_SHADOWS = "CDRF measured", "CDRF measured, shadows"
DENOISED = f"{PATHS}, denoised, 16"
MAIN = (PAPER, "CDRF ring", SPHERE, SHADOWS, LOOK, DEFAULT, MEASURED, MEASURED_SHADOWS, PRINCIPLED,
        TEXTURE, DENOISED)  # fmt: skip
"""A scene is summarised in one line by these, beside Lambert."""
SAME_AS = {SHADOWS: SPHERE, DEFAULT: LOOK, MEASURED_SHADOWS: MEASURED, PAPER: "CDRF ring"}
"""Where nothing casts a shadow, or curvature is the same everywhere, these are one picture."""
SHORT = {
    LAMBERT: "Lambert",
    PAPER: "ring, raw (the paper)",
    "CDRF ring": "ring",
    SPHERE: "sphere",
    SHADOWS: "sphere, shadows",
    LOOK: "path-traced look",
    DEFAULT: "path-traced look, shadows",
    MEASURED: "measured",
    MEASURED_SHADOWS: "measured, shadows",
    PRINCIPLED: "EEVEE Principled",
    TEXTURE: "texture blurring",
    DENOISED: "Cycles 16, denoised",
}


def main_of(results: Results) -> tuple[str, ...]:
    """Those of MAIN that were measured in any scene."""
    return tuple(name for name in MAIN
                 if any(row_of(cell, name) for cell in results.cells.values()))  # fmt: skip


# --- who is closest ------------------------------------------------------------------------------


def row_of(cell: Row, name: str) -> Row | None:
    """Result of a contender in a cell, or of the one that is the same picture there."""
    rows: Mapping[str, Row] = cell["contenders"]
    if "missing" in rows.get(name, {}):
        name = SAME_AS.get(name, name)
    row = rows.get(name, {})
    return row if "rmse" in row else None


def _eevee_rows(cell: Row) -> Iterator[tuple[str, Contender]]:
    """Rows of a cell that EEVEE has drawn, with their contenders."""
    for name, row in cell["contenders"].items():
        one = contender_of(name)
        if "rmse" in row and one and one.engine == EEVEE:
            yield name, one


def best_of(cell: Row, mask: str = "all", measure: str = "rmse") -> str:
    """EEVEE's frame with the least error, or the highest similarity, of a cell; "" if none."""
    rows = cell["contenders"]
    names = [name for name, _ in _eevee_rows(cell)]
    if not names:
        return ""
    if measure == "ssim":
        return max(names, key=lambda name: rows[name]["ssim"][mask])
    return min(names, key=lambda name: rows[name]["rmse"][mask])


def share(cells: Iterable[Row], name: str, mask: str) -> tuple[float, int]:
    """Geometric mean of an error over Lambert's, and the number of cells that have both."""
    pairs = [(row_of(cell, name), row_of(cell, LAMBERT)) for cell in cells]
    logs = [math.log(one["rmse"][mask] / base["rmse"][mask]) for one, base in pairs if one and base]
    return (math.exp(float(np.mean(logs))), len(logs)) if logs else (math.inf, 0)


def against(cells: Iterable[Row], name: str, other: str) -> tuple[int, int, int]:
    """In how many cells one is closer than another, in how many more alike, of how many."""
    pairs = [(row_of(cell, name), row_of(cell, other)) for cell in cells]
    both = [(one, base) for one, base in pairs if one and base]
    closer = sum(one["rmse"]["all"] < base["rmse"]["all"] for one, base in both)
    alike = sum(one["ssim"]["all"] > base["ssim"]["all"] for one, base in both)
    return closer, alike, len(both)


def of_eevee(name: str) -> bool:
    """Whether one of MAIN is drawn by EEVEE."""
    return name not in (TEXTURE, DENOISED)


# --- sentences -----------------------------------------------------------------------------------


def matrix_sentences(results: Results) -> list[str]:
    """Who wins how often, and by how much."""
    cells = [cell for cell in results.cells.values() if best_of(cell)]
    if not cells:
        return []
    found = _pairs(cells)
    for measure, words in (
        ("rmse", "least RMSE over all pixels"),
        ("ssim", "highest SSIM"),
    ):
        best = (contender_of(best_of(cell, measure=measure)) for cell in cells)
        wins = Counter(one.family for one in best if one)
        phrases = ", ".join(f"{name} in {count}" for name, count in wins.most_common())
        found.append(f"Of EEVEE's techniques in {len(cells)} scenes, {words}: {phrases}.")
    found[-2] += (
        f" In {sum(_close_call(cell) for cell in cells)} of them the next technique is behind by "
        "less than the reference's noise."
    )
    return [*found, *_group_sentences(results), *_against_texture(results), *_equal_noise(results)]


def _pairs(cells: Sequence[Row]) -> list[str]:
    """How often a setting, chosen beforehand, is closer than Lambert and than EEVEE's own."""
    found = []
    for name in (DEFAULT, SPHERE, SHADOWS, PAPER, TEXTURE):
        phrases = []
        for other, words in ((LAMBERT, "Lambert"), (PRINCIPLED, "EEVEE's own scattering")):
            closer, alike, both = against(cells, name, other)
            if both:
                phrases.append(f"{words} in {closer} of {both} scenes (higher SSIM in {alike})")
        if phrases:
            found.append(f"{name} is closer than {' and than '.join(phrases)}.")
    return found


def _close_call(cell: Row) -> bool:
    """Whether EEVEE's second-best technique equals the best within the reference's noise."""
    least: dict[str, float] = {}
    for name, one in _eevee_rows(cell):
        error = cell["contenders"][name]["rmse"]["all"]
        least[one.family] = min(least.get(one.family, math.inf), error)
    ranked = sorted(least.values())
    return len(ranked) > 1 and ranked[1] - ranked[0] < float(cell["floor"]["all"])


def groups(results: Results) -> dict[str, dict[str, list[Row]]]:
    """Cells by lights, by material and by shape; only groups that have any."""
    parts = {"lights": RIGS, "material": MATERIALS, "shape": SHAPES}
    cells = {cell: results.cells[cell.name] for cell in wanted_cells(results.settings)
             if cell.name in results.cells}  # fmt: skip
    found = {}
    for part, names in parts.items():
        by_name = {name: [row for cell, row in cells.items() if getattr(cell, part) == name]
                   for name in names}  # fmt: skip
        found[part] = {name: rows for name, rows in by_name.items() if rows}
    return found


def _group_sentences(results: Results) -> list[str]:
    """Which of EEVEE's contenders is closest on average under each kind of light, and so on."""
    found = []
    for part, by_name in groups(results).items():
        phrases = []
        for name, cells in by_name.items():
            # On equal terms the plainer one is named: Lambert first, raw curvature last.
            usual = (one for one in main_of(results) if of_eevee(one) and one != PAPER)
            names = (LAMBERT, *usual, PAPER)
            means = {one: share(cells, one, "all")[0] for one in names}
            best = min(means, key=lambda one: means[one])
            if math.isfinite(means[best]):
                phrases.append(f"{name}: {best}, {means[best]:.2f}")
        if phrases:
            found.append(
                f"By {part}, EEVEE's contender with the least mean error, and that error as a part "
                "of Lambert's: " + "; ".join(phrases) + "."
            )
    return found


def _against_texture(results: Results) -> list[str]:
    """How often texture blurring is closer than the best of CDRF, whichever that is."""
    pairs = []
    for cell in results.cells.values():
        rows = {name: row for name, row in cell["contenders"].items() if "rmse" in row}
        ours = [row["rmse"]["all"] for name, row in rows.items() if name.startswith("CDRF")]
        if TEXTURE in rows and ours:
            pairs.append((rows[TEXTURE]["rmse"]["all"], min(ours)))
    if not pairs:
        return []
    closer = sum(blurred < ours for blurred, ours in pairs)
    return [
        f"Texture blurring, where there are UVs, is closer in {closer} of {len(pairs)} scenes than "
        "whichever CDRF is closest there."
    ]


def _equal_noise(results: Results) -> list[str]:
    """How many samples Cycles needs to be as close as the best frame of EEVEE."""
    enough: Counter[str] = Counter()
    whole = [cell for cell in results.cells.values() if best_of(cell)]
    for cell in whole:
        best = cell["contenders"][best_of(cell)]["rmse"]["all"]
        counts = sorted(
            (row["samples"], row["rmse"]["all"])
            for key, row in cell["contenders"].items()
            if key.startswith(f"{PATHS}, ") and "denoised" not in key and "rmse" in row
        )
        if counts:
            found = next((samples for samples, error in counts if error <= best), None)
            enough[str(found) if found else f"more than {counts[-1][0]}"] += 1
    if not enough:
        return []
    order = sorted(enough.items(), key=lambda one: int(one[0].rpartition(" ")[2]))
    sentences = [
        "Samples at which Cycles, not denoised, has the RMSE of the best EEVEE frame: "
        + ", ".join(f"{samples} in {count}" for samples, count in order)
        + f" of {enough.total()} scenes. (The reference is Cycles' too, so noise is all it has.)"
    ]
    pairs = [
        (cell["contenders"][DENOISED], cell["contenders"][best_of(cell)])
        for cell in whole
        if "rmse" in cell["contenders"].get(DENOISED, {})
    ]
    if pairs:
        closer = sum(one["rmse"]["all"] < best["rmse"]["all"] for one, best in pairs)
        sentences.append(
            "Cycles with 16 samples and a denoiser is closer than every EEVEE frame in "
            f"{closer} of {len(pairs)} scenes."
        )
    return sentences
