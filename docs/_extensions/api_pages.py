# SPDX-License-Identifier: GPL-3.0-or-later
"""A page of the API for each package of `cdrf_addon.core`, from the docstrings of its modules.

The pages are written anew at each build, so that no renamed module is left behind. Sphinx reads
docstrings as reStructuredText; ours are plain text with Google's sections: `code` in single
backticks, and formulas and small tables as indented blocks. Such a block is shown as it is typed.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.config import Config

PACKAGE = "cdrf_addon.core"

# Headings of sections, whose indented lines are fields and not a block.
SECTION = re.compile(r"(Args|Attributes|Raises|Returns|Yields):")
CODE = re.compile(r"(?<!`)`([^`]+)`(?!`)")


def write_pages(app: Sphinx, _config: Config) -> None:
    """Write develop/api/generated/, a page for each package."""
    source = Path(app.srcdir)
    folder = source / "develop" / "api" / "generated"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    root = source.parent / PACKAGE.replace(".", "/")
    for init in sorted(root.rglob("__init__.py")):
        parts = init.parent.relative_to(root).parts
        name = ".".join((PACKAGE, *parts))
        modules = sorted(path.stem for path in init.parent.glob("*.py") if path != init)
        (folder / f"{name}.md").write_text(page(name, modules), encoding="utf-8")


def page(package: str, modules: list[str]) -> str:
    """Write a package's page: its own docstring, then a section for each module."""
    lines = [f"# {package}", ""]
    for title, name in [("", package)] + [(module, f"{package}.{module}") for module in modules]:
        lines += [f"## {title}", ""] if title else []
        lines += ["```{eval-rst}", f".. automodule:: {name}", "```", ""]
    return "\n".join(lines)


def prepare(
    _app: Sphinx, _kind: str, _name: str, _obj: object, _options: object, lines: list[str]
) -> None:
    """Mark code and indented blocks; runs before napoleon takes the sections apart."""
    done: list[str] = []
    in_section = in_block = False
    for number, line in enumerate(lines):
        indented = line.startswith("    ")
        if line.strip() and not indented:
            in_section, in_block = SECTION.fullmatch(line) is not None, False
        starts = indented and not in_section and not in_block
        if starts and number and not lines[number - 1].strip():
            done += ["::", ""]
            in_block = True
        done.append(line if in_block else escape(line))
    lines[:] = done


def escape(line: str) -> str:
    """Turn `code` into ``code``, and take the meaning that reST has for them from |, * and _."""
    parts = CODE.split(line)
    for number in range(0, len(parts), 2):
        parts[number] = re.sub(r"([|*]|_\b)", r"\\\1", parts[number])
    for number in range(1, len(parts), 2):
        parts[number] = f"``{parts[number]}``"
    return "".join(parts)


def setup(app: Sphinx) -> dict[str, bool]:
    """Write the pages before they are read, and prepare docstrings before napoleon."""
    app.connect("config-inited", write_pages)
    app.connect("autodoc-process-docstring", prepare, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
