# SPDX-License-Identifier: GPL-3.0-or-later
"""The rooms of `cdrf_addon` and what each may import: the one table of the architecture.

tests/test_architecture.py holds the code to it, and docs/develop/architecture.md shows it. A room
is a folder or a module, or with `{a,b}` several of one folder; the most specific room counts.
Modules of one room may import each other, as long as that makes no circle.
"""

from __future__ import annotations

from typing import NamedTuple


class Room(NamedTuple):
    """What a room holds, and the other rooms that it may import."""

    holds: str
    may_import: tuple[str, ...] = ()


def members(name: str) -> tuple[str, ...]:
    """Write a room's name without braces: "core/{errors,progress}" names two modules."""
    before, brace, rest = name.partition("{")
    inside, _, after = rest.partition("}")
    return tuple(before + part + after for part in inside.split(",")) if brace else (name,)


BASE = "{ids,compat,paths}"
GENERAL = "core/{arguments,colour_scale,errors,progress}"
CORE = (
    GENERAL,
    "core/curvature",
    "core/reflectance",
    "core/scattering",
    "core/walk",
    "core/measured",
)
LEAVES = "blender/{units,pictures,instances}"
BELOW = (BASE, *CORE, LEAVES)
SCENE = ("blender/mesh", "blender/nodes", "blender/lights", "blender/world")
JOB = "blender/{selection,mesh_work,report,setup,removal,state}"
BLENDER = (*SCENE, "blender/shader", "blender/material", "blender/display", JOB)

ROOMS: dict[str, Room] = {
    GENERAL: Room("errors with a sentence for the artist, progress, arguments, colour scales"),
    "core/curvature": Room("meshes cleaned, principal curvatures, and at a length", (GENERAL,)),
    "core/reflectance": Room(
        "models f(θ, σ), look-up table, energy, finite lights, detail, specular, environment",
        (GENERAL,),
    ),
    "core/scattering": Room(
        "from coefficients, presets or Blender's radius to σ₀", (GENERAL, "core/reflectance")
    ),
    "core/walk": Room(
        "the path tracer's random walk: medium, flat limit, gain, tilt, width, own walks",
        (GENERAL, "core/reflectance", "core/scattering"),
    ),
    "core/measured": Room(
        "path-traced spheres: file, fits, smoothing, the measured model",
        (GENERAL, "core/reflectance"),
    ),
    BASE: Room("names written into .blend files, differences between Blenders, our own folder"),
    LEAVES: Room("units, pixels read back, instances", (BASE, *CORE)),
    "blender/mesh": Room("meshes read, curvature attributes written", BELOW),
    "blender/nodes": Room("node groups; touches only a tree", BELOW),
    "blender/lights": Room("the scene's lights; only reads the scene", BELOW),
    "blender/world": Room("the world's light, captured and summed up", BELOW),
    "blender/shader": Room("the group of a material, wired for its lights", (*BELOW, *SCENE)),
    "blender/material": Room(
        "materials written: model, σ₀, specular, links", (*BELOW, *SCENE, "blender/shader")
    ),
    "blender/display": Room(
        "curvature shown in the viewport and in renders",
        (*BELOW, *SCENE, "blender/shader", "blender/material"),
    ),
    JOB: Room(
        "Make Translucent: selection, mesh by mesh, report, state; setup orders them. Removal",
        (*BELOW, *BLENDER[:-1]),
    ),
    "measuring": Room(
        "Cycles measured in a Blender of its own: request, cache, process, figure", BELOW
    ),
    "measuring/worker": Room("the script of that Blender; runs by itself"),
    "ui": Room("operators, panels, properties, handlers", (*BELOW, *BLENDER, "measuring")),
    # Not `ui`: the package itself registers that.
    "command": Room("command lines: batch and fit", (*BELOW, *BLENDER, "measuring", "__init__")),
    "{batch_render,fit}": Room("names by which scripts know the command lines", ("command",)),
    "__init__": Room("register() and unregister()", ("ui",)),
}


def markdown() -> str:
    """Write the table for docs/develop/architecture.md."""
    lines = ["| room | holds | may import |", "|---|---|---|"]
    for name, room in ROOMS.items():
        others = ", ".join(f"`{other}`" for other in room.may_import) or "nothing"
        lines.append(f"| `{name}` | {room.holds} | {others} |")
    return "\n".join(lines) + "\n"
