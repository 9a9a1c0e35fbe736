# SPDX-License-Identifier: GPL-3.0-or-later
"""The report's part on times: draws, frames, scaling, preparation."""

from __future__ import annotations

from ..common.markdown import table
from ..common.timing import spread
from .contenders import SPHERE
from .results import DASH, Results, with_spread
from .timing import PARTS, base_of, power, split


def timing_part(results: Results) -> list[str]:
    """Draws, frames, scaling."""
    lines = ["## Times", ""]
    absent = [name for name in PARTS if not results.timing.get(name, {}).get("rounds")]
    if len(absent) == len(PARTS):
        return [*lines, "Not timed yet.", ""]
    lines += [*_draws(results), *_frames(results), *_scaling(results), *_preparation(results)]
    if absent:
        lines += ["Not timed yet: " + ", ".join(absent) + ".", ""]
    return lines


def _draws(results: Results) -> list[str]:
    part = results.timing.get("draws", {})
    if not part.get("rounds"):
        return []
    rows = []
    for name, points in part["rows"].items():
        clock = with_spread(results.ratio("draws", name, "draw"))
        cpu = with_spread(results.ratio("draws", name, "draw", "cpu"))
        middle = 1e3 * spread(one["wall"] for one in points["draw"])[0]
        first = spread(one["wall"] for one in points["first draw"])[0]
        rows.append([name, base_of(name), clock, cpu, f"{middle:.0f}", f"{first:.1f}"])
    return [
        f"**Viewport draws** of one sample, {part['cell']}, {part['size']} pixels each way, "
        f"{part['rounds']} interleaved rounds; median and spread.",
        "",
        *table(["contender", "against", "ratio, clock", "ratio, CPU", "ms", "first draw, s"], rows),
    ]


def _frames(results: Results) -> list[str]:
    part = results.timing.get("frames", {})
    if not part.get("rounds"):
        return []
    rows = []
    for name, points in part["rows"].items():
        fixed, slope = zip(*split(points), strict=True)
        many = max((count for count in points if count.isdigit()), key=int)
        own = base_of(name)
        # Of a technique without samples there is one time, which is nobody else's.
        over = results.ratio("frames", name, many) if int(many) > 1 else []
        first = list(points["first"])
        later = [one["megabytes"] for key in points if key != "first" for one in points[key]]
        memory = max(spread(later)[0], 0.0)
        rows.append(
            [
                name,
                with_spread(fixed),
                with_spread(slope, 3),
                f"{with_spread(over)}" if over else DASH,
                own,
                f"{spread(one['wall'] for one in first)[0]:.1f}",
                f"{memory:.0f}",
            ]
        )
    few, many_cycles = results.settings.timed
    return [
        f"**Frames**: final renders at {', '.join(map(str, few))} samples (Cycles "
        f"{', '.join(map(str, many_cycles))}) in one process, {part['rounds']} interleaved "
        f"rounds, {part['cell']}, {part['size']} pixels each way. Without a window each "
        "render compiles its shaders anew: that is in the fixed cost of all alike. MB: peak "
        "memory above what the process held before the frame, median; what it could use "
        "again is not counted.",
        "",
        *table(
            [
                "contender",
                "fixed, s",
                "a sample, s",
                "ratio at most samples",
                "against",
                "first, s",
                "MB",
            ],
            rows,
        ),
    ]


def _scaling(results: Results) -> list[str]:
    lines = results.image("scaling.svg", "Time of a draw against pixels, lights and vertices")
    if not lines:
        return []
    # Pixels are counted, not the pictures' sides.
    for part, words, power_of in (
        ("pixels", "pixels", 2),
        ("lights", "suns", 1),
        ("vertices", "vertices", 1),
    ):
        rows = results.timing.get(part, {}).get("rows", {})
        phrases = []
        for name, points in rows.items():
            sizes = sorted(int(size) for size in points if size.isdigit())
            if len(sizes) < 2:
                continue
            ends = [
                (float(size**power_of), spread(one["wall"] for one in points[str(size)])[0])
                for size in sizes
            ]
            phrases.append(
                f"{name} {ends[-1][1] / ends[0][1]:.2f} times from {sizes[0]:,} to "
                f"{sizes[-1]:,} (exponent {power(ends):.2f} at the end)"
            )
        if phrases:
            lines += [f"Cost over {words}, without shadows: " + "; ".join(phrases) + ".", ""]
    return lines


def _preparation(results: Results) -> list[str]:
    part = results.timing.get("preparation", {})
    if not part.get("rounds"):
        return []
    rows = part["rows"]
    phrases = [
        f"*Make Translucent* {with_spread([one['wall'] for one in rows[SPHERE]['setup']])} s"
    ]
    if "CDRF measured" in rows:
        measured = [one["wall"] for one in rows["CDRF measured"]["measure"]]
        phrases.append(f"*Measure* {with_spread(measured, 0)} s more")
    return [
        f"**Preparation** of {part['cell']}, {part['vertices']:,} vertices: "
        + ", ".join(phrases)
        + ". Lambert, EEVEE's scattering and Cycles need none; texture "
        "blurring needs UVs, which somebody has to unwrap.",
        "",
    ]
