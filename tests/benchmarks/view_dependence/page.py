# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/view_dependence.md, and what the report says of the study, from its raw results."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from cdrf_addon.core.scattering.node_radius import BURLEY, RANDOM_WALK

from ..common.files import IMAGES
from ..common.markdown import facts, generated, table
from ..report.cells import Cell
from ..report.contenders import DEFAULT, LAMBERT, PRINCIPLED, SHADOWS
from .study import (
    CELLS,
    COMPARED,
    FILM,
    LIGHTS,
    MASKS,
    NAME,
    SAMPLES,
    SIZE,
    Row,
    error,
    measured,
    share,
    unscaled,
    where,
)

GOAL, SIMPLE_GOAL, SIMPLE = 0.72, 0.55, ("sphere", "torus")
"""Errors over Lambert's and over EEVEE's that were asked for; of SIMPLE shapes over Lambert's."""
PARTS = {
    "light": "where the surface faces the first light well",
    "terminator": "at the terminator and behind it",
    "shadow": "in cast shadows and at open rims",
}


def page(results: Row) -> str:
    """Return the whole page."""
    cells = measured(results, RANDOM_WALK)
    lines = ["# The path-traced look against path tracing", "", generated(NAME), ""]
    if not cells:
        return "\n".join([*lines, "Not measured yet.", ""])
    lines += [f"Measured: {facts(results['machine'])}.", "", *_method()]
    lines += ["## In short", "", *(f"- {line}" for line in _in_short(cells)), ""]
    lines += [*_goals(cells), *_means(cells)]
    for lights in LIGHTS:
        lines += _scenes(lights, {one: row for one, row in cells.items() if one.lights == lights})
    lines += burley_part(results, "## Against Christensen-Burley")
    if (IMAGES / f"{NAME}.png").exists():
        lines += [
            "## Pictures",
            "",
            f"![Reference, EEVEE Principled, sphere, path-traced look](images/{NAME}.png)",
            "",
            "Random Walk; under each row eight times the absolute difference. On the head what is "
            "left sits beside cast shadows and at thin edges: the far eye and cheek, lips and lids "
            "are too bright and too red. On the bust the walk goes through the face and levels it; "
            "the look, which knows the surface alone, keeps sockets and nose too sharp. On the "
            "torus the inner side that faces the light is too bright. No patches, bands or seams "
            "are seen; at the outline single pixels differ either way.",
            "",
        ]
    return "\n".join(lines).rstrip() + "\n"


def _method() -> list[str]:
    return [
        f"**Reference**: Cycles, Random Walk of the Subsurface Scattering node, two seeds of "
        f"{SAMPLES} samples each, both denoised, averaged; {SIZE} pixels each way, no light from "
        "surface to surface. Scenes, materials, lights and measures are those of "
        "[the report](report.md), which has more pixels and more contenders. *Floor* is half the "
        "RMSE between the two.",
        "",
        f"**Contenders**, all with cast shadows and {FILM} samples: *path-traced look* is what "
        "Make Translucent gives a scattering material, the sphere model with View Dependence; "
        "*sphere* is the same with View Dependence off, as it was before there was one. σ₀ follows "
        "from the node's radius, the look's coefficients from walks under planes and spheres. "
        "Over which length it takes mean curvature was chosen in six of the sun scenes.",
        "",
    ]


# --- means ---------------------------------------------------------------------------------------


def _in_short(cells: Mapping[Cell, Row]) -> list[str]:
    rows = list(cells.values())
    found = [
        f"RMSE of the look over Lambert's, geometric mean of {_scenes_of(cells)}: "
        f"{_both(rows, DEFAULT, LAMBERT)}; of *sphere*: {_both(rows, SHADOWS, LAMBERT)}; of "
        f"EEVEE Principled: {_both(rows, PRINCIPLED, LAMBERT)}.",
        f"Over EEVEE Principled's: {_both(rows, DEFAULT, PRINCIPLED)}.",
        *_worse(cells),
    ]
    over = {one.name: share([row], DEFAULT, LAMBERT, "all") for one, row in cells.items()}
    least, most = (pick(over, key=lambda name: over[name]) for pick in (min, max))
    found.append(
        f"Best over Lambert: {least} ({over[least]:.2f}); worst: {most} ({over[most]:.2f})."
    )
    found.append(
        "One factor a colour, the best for each picture, would leave "
        f"{unscaled(rows, DEFAULT):.2f} of the look's error, {unscaled(rows, SHADOWS):.2f} of "
        f"*sphere*'s and {unscaled(rows, LAMBERT):.2f} of Lambert's: the rest is energy that is "
        "missing or too much everywhere."
    )
    phrases = [
        f"{100.0 * part:.0f} % {PARTS[name]} ({100.0 * pixels:.0f} % of the pixels)"
        for name, (part, pixels) in where(rows, DEFAULT).items()
    ]
    found.append(f"Of the look's squared error, mean of the scenes: {', '.join(phrases)}.")
    return found


def _both(rows: Sequence[Row], name: str, base: str) -> str:
    every, lit = (share(rows, name, base, mask) for mask in MASKS)
    return f"{every:.2f} of all pixels, {lit:.2f} of the lit"


def _scenes_of(cells: Mapping[Cell, Row]) -> str:
    missing = len(CELLS) - len(cells)
    return f"{len(cells)} scenes" + (f" ({missing} not measured yet)" if missing else "")


def _worse(cells: Mapping[Cell, Row]) -> list[str]:
    """In which scenes the look is not as close as another."""
    found = []
    for base in (LAMBERT, PRINCIPLED, SHADOWS):
        worse = {
            one.name: share([row], DEFAULT, base, "all")
            for one, row in cells.items()
            if error(row, DEFAULT, "all") > error(row, base, "all")
        }
        names = ", ".join(f"{name} ({over:.2f})" for name, over in worse.items())
        found.append(f"Scenes in which it is farther off than {COMPARED[base]}: {names or 'none'}.")
    return found


def _goals(cells: Mapping[Cell, Row]) -> list[str]:
    """What was asked for, and whether it holds."""
    every = list(cells.values())
    worse = sum(error(row, DEFAULT, "all") > error(row, LAMBERT, "all") for row in every)
    asked = [
        ("mean over Lambert's", GOAL, share(every, DEFAULT, LAMBERT, "all")),
        ("mean over EEVEE Principled's", GOAL, share(every, DEFAULT, PRINCIPLED, "all")),
    ]
    for shape in SIMPLE:
        some = [row for one, row in cells.items() if one.shape == shape]
        found = share(some, DEFAULT, LAMBERT, "all")
        asked.append((f"{shape}, over Lambert's", SIMPLE_GOAL, found))
    rows = []
    for words, goal, found in asked:
        rows.append([words, f"≤ {goal:g}", f"{found:.3f}", "yes" if found <= goal else "**no**"])
    rows.append(["scenes worse than Lambert", "0", str(worse), "**no**" if worse else "yes"])
    return table(["RMSE over all pixels", "goal", "found", "held"], rows)


def _means(cells: Mapping[Cell, Row]) -> list[str]:
    """Means over Lambert by lights, material and shape, and in all."""
    rows = []
    for part in ("lights", "material", "shape"):
        for name in dict.fromkeys(getattr(one, part) for one in cells):
            rows.append((name, [row for one, row in cells.items() if getattr(one, part) == name]))
    rows.append(("all", list(cells.values())))
    shown = []
    for name, some in rows:
        line = [name, str(len(some))]
        for one in (PRINCIPLED, SHADOWS, DEFAULT):
            line.append(_pair(share(some, one, LAMBERT, mask) for mask in MASKS))
        line.append(_pair(share(some, DEFAULT, PRINCIPLED, mask) for mask in MASKS))
        shown.append(line)
    return [
        "## Means",
        "",
        "Geometric means of the RMSE over Lambert's, *all* / *lit* pixels; last column: the look's "
        "over EEVEE Principled's.",
        "",
        *table(["", "scenes", "EEVEE Principled", "sphere", "path-traced look", "over EEVEE"],
               shown),
    ]  # fmt: skip


def _pair(values: Iterable[float], digits: int = 2) -> str:
    return " / ".join(f"{value:.{digits}f}" for value in values)


def _scenes(lights: str, cells: Mapping[Cell, Row]) -> list[str]:
    """Every scene under some lights in a line."""
    if not cells:
        return []
    rows = []
    for one, row in cells.items():
        errors = {name: _pair((error(row, name, mask) for mask in MASKS), 4) for name in COMPARED}
        least = min(COMPARED, key=lambda name: error(row, name, "all"))
        errors[least] = f"**{errors[least]}**"
        over = _pair(share([row], DEFAULT, LAMBERT, mask) for mask in MASKS)
        rows.append([f"{one.shape}, {one.material}", *errors.values(), over,
                     f"{row['floor']['all']:.4f}"])  # fmt: skip
    return [
        f"## Scenes: {lights}",
        "",
        "RMSE over *all* / *lit* pixels; bold: the least over all.",
        "",
        *table(["scene", *COMPARED.values(), "look over Lambert", "floor"], rows),
    ]


# --- the other reference, and what the report says -----------------------------------------------


def burley_part(results: Row, title: str) -> list[str]:
    """The second reference: a table, and what it means."""
    cells = measured(results, BURLEY)
    if not cells:
        return []
    rows = []
    for one, row in cells.items():
        errors = [_pair((error(row, name, mask) for mask in MASKS), 4) for name in COMPARED]
        rows.append([one.name, *errors, f"{row['apart']['all']:.4f}", f"{row['floor']['all']:.4f}"])
    some = list(cells.values())
    over = {name: share(some, name, LAMBERT, "all") for name in COMPARED}
    best = min(over, key=lambda name: over[name])
    return [
        title,
        "",
        "Cycles' Christensen-Burley, of the radius that *From Shader Nodes* reads the same σ₀ "
        "from; EEVEE Principled has the same method and radius. RMSE over *all* / *lit* pixels; "
        "*apart*: RMSE between the two references.",
        "",
        *table(["scene", *COMPARED.values(), "apart", "floor"], rows),
        "This reference does not depend on the view: over Lambert's, the error of the look is "
        f"{over[DEFAULT]:.2f}, that of *sphere*, which is the same with View Dependence off, "
        f"{over[SHADOWS]:.2f}, EEVEE Principled's {over[PRINCIPLED]:.2f}; closest on average: "
        f"{COMPARED[best]}. "
        + (
            "So the look is that of Random Walk: to match Christensen-Burley, switch View "
            "Dependence off."
            if over[DEFAULT] > over[SHADOWS]
            else "So the look is as good for Christensen-Burley as without View Dependence."
        ),
        "",
    ]


def default_sentences(results: Row, *, alone: bool) -> list[str]:
    """What the report says of the look that a scattering material gets.

    Args:
        results: Of this study.
        alone: Whether the report itself has no row of the look.
    """
    cells = measured(results, RANDOM_WALK)
    if not cells:
        return []
    rows = list(cells.values())
    closer = [
        sum(error(row, DEFAULT, "all") < error(row, base, "all") for row in rows)
        for base in (LAMBERT, PRINCIPLED)
    ]
    means = [share(rows, DEFAULT, base, "all") for base in (LAMBERT, PRINCIPLED)]
    sentence = (
        f"{DEFAULT}, which Make Translucent gives a scattering material, is closer to Random Walk "
        f"than Lambert in {closer[0]} of {len(rows)} scenes with lamps and than EEVEE's own "
        f"scattering in {closer[1]}; its RMSE is {means[0]:.2f} of Lambert's and {means[1]:.2f} of "
        f"EEVEE's (geometric means; {SIZE} pixels each way, measured "
        f"{results['machine']['date']}: [{NAME}.md]({NAME}.md))."
    )
    if alone:
        sentence += " All that follows was measured before, without View Dependence."
    return [sentence]
