# SPDX-License-Identifier: GPL-3.0-or-later
"""The code keeps to its architecture: rooms import only downwards, nothing in circles, files short.

The table is tests/support/rooms.py. Imports are read from the source, those inside functions and
those for type checkers, too.
"""

from __future__ import annotations

import ast
import functools
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from rooms import ROOMS, members

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = "cdrf_addon"
MOST_LINES = 400
REASON = "Long because"
MOST_COMPLEX = 15
# What the numerics need besides Python itself.
LIBRARIES = {"numpy", "scipy", "igl"}
CORE = [room for room in ROOMS if room.startswith("core/")]


@functools.cache
def files() -> dict[str, Path]:
    """Dotted name and file of every module of the package."""
    found = {}
    for path in sorted((ROOT / PACKAGE).rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


@functools.cache
def tree(module: str) -> ast.Module:
    return ast.parse(files()[module].read_text(encoding="utf-8"))


def absolute(module: str, node: ast.ImportFrom) -> str:
    """Name of what `from ... import` imports from."""
    if not node.level:
        return node.module or ""
    package = module.split(".")
    up = node.level - (files()[module].name == "__init__.py")
    return ".".join([*package[: len(package) - up], *filter(None, [node.module])])


def imported(module: str) -> Iterator[str]:
    """Names of all modules that a module imports, of other packages, too."""
    for node in ast.walk(tree(module)):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            source = absolute(module, node)
            for name in node.names:
                inner = f"{source}.{name.name}"
                yield inner if inner in files() else source


@functools.cache
def own_imports() -> dict[str, set[str]]:
    """Modules of the package that each imports."""
    return {
        module: {name for name in imported(module) if name.split(".")[0] == PACKAGE}
        for module in files()
    }


def test_imports_in_functions_and_for_types_are_read() -> None:
    assert f"{PACKAGE}.ui.panels" in own_imports()[PACKAGE]
    assert f"{PACKAGE}.core.curvature.tri_mesh" in own_imports()[f"{PACKAGE}.core.curvature.clean"]


def room_of(module: str) -> str | None:
    """Find the most specific room that a module stands in."""
    inner = module.removeprefix(PACKAGE).lstrip(".").replace(".", "/") or "__init__"
    found = [
        (len(member), room)
        for room in ROOMS
        for member in members(room)
        if f"{inner}/".startswith(f"{member}/")
    ]
    return max(found)[1] if found else None


def inside(room: str) -> list[str]:
    return [module for module in files() if room_of(module) == room]


def is_bare(module: str) -> bool:
    """Whether there is only a docstring."""
    return len(tree(module).body) == 1 and ast.get_docstring(tree(module)) is not None


def test_every_module_has_a_room() -> None:
    homeless = [name for name in files() if room_of(name) is None and not is_bare(name)]
    assert not homeless, f"give these a room in tests/support/rooms.py: {homeless}"


@pytest.mark.parametrize("room", ROOMS)
def test_every_room_is_there_and_known(room: str) -> None:
    for member in members(room):
        path = ROOT / PACKAGE / member
        assert path.is_dir() or path.with_suffix(".py").is_file(), f"{member} does not exist"
    assert set(ROOMS[room].may_import) <= set(ROOMS) - {room}


def test_no_room_may_import_itself_by_way_of_others() -> None:
    assert circle({room: set(ROOMS[room].may_import) for room in ROOMS}) == []


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_imports_only_what_it_may(room: str) -> None:
    allowed = {room, *ROOMS[room].may_import}
    wrong = [
        f"{module} imports {name}"
        for module in inside(room)
        for name in sorted(own_imports()[module])
        if room_of(name) not in allowed
    ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("room", CORE)
def test_the_numerics_import_nothing_of_blender(room: str) -> None:
    allowed = {*sys.stdlib_module_names, *LIBRARIES, PACKAGE}
    wrong = [
        f"{module} imports {name}"
        for module in inside(room)
        for name in imported(module)
        if name.split(".")[0] not in allowed
    ]
    assert not wrong, "\n".join(wrong)


def circle(graph: dict[str, set[str]]) -> list[str]:
    """Return the nodes of a circle in a graph, or none."""
    done: set[str] = set()

    def visit(node: str, way: list[str]) -> list[str]:
        if node in way:
            return [*way[way.index(node) :], node]
        if node not in done:
            for following in sorted(graph.get(node, ())):
                if found := visit(following, [*way, node]):
                    return found
            done.add(node)
        return []

    return next((found for node in graph if (found := visit(node, []))), [])


def test_a_circle_is_found() -> None:
    assert circle({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == ["b", "c", "b"]
    assert circle({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []


def test_no_module_imports_itself_by_way_of_others() -> None:
    assert circle(own_imports()) == []


@pytest.mark.parametrize("room", ROOMS)
def test_files_are_short_or_give_a_reason(room: str) -> None:
    wrong = []
    for module in inside(room):
        lines = len(files()[module].read_text(encoding="utf-8").splitlines())
        reasons = (ast.get_docstring(tree(module)) or "").splitlines()
        if lines > MOST_LINES and not any(line.startswith(REASON) for line in reasons):
            wrong.append(f"{module}: {lines} lines, and no line '{REASON} ...' in its docstring")
    assert not wrong, "\n".join(wrong)


def test_the_linter_refuses_complex_functions() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["ruff"]
    assert "C901" in settings["lint"]["select"]
    assert settings["lint"]["mccabe"]["max-complexity"] == MOST_COMPLEX
    excused = [name for name in files() if "C901" in files()[name].read_text(encoding="utf-8")]
    assert excused == []
