# SPDX-License-Identifier: GPL-3.0-or-later
"""The site builds without a warning, and what its pages name is there."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from rooms import markdown

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(page for page in DOCS.rglob("*.md") if "generated" not in page.parts)
# Generated pages name what was there when they were measured.
BY_HAND = ("accuracy", "index")
WRITTEN = [page for page in PAGES if page.parent != DOCS / "results" or page.stem in BY_HAND]
OUTSIDE = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"]
LINK = re.compile(r"\]\(([^()\s]+)\)")
CODE = re.compile(r"`([^`\n]+)`")
# Where a path in a page may start.
BASES = (ROOT, ROOT / "cdrf_addon", ROOT / "tests", DOCS / "results")


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    """The site, built from a copy of what it is made of."""
    source = tmp_path_factory.mktemp("checkout")
    for folder in ("docs", "cdrf_addon"):
        without = shutil.ignore_patterns("__pycache__", "generated")
        shutil.copytree(ROOT / folder, source / folder, ignore=without)
    shutil.copy(ROOT / "pyproject.toml", source)
    output = tmp_path_factory.mktemp("site")
    options = ("-q", "-n", "-W", "--keep-going", "-b", "html")
    command = [sys.executable, "-m", "sphinx", *options, source / "docs", output]
    done = subprocess.run(
        [str(part) for part in command], capture_output=True, text=True, check=False, timeout=600
    )
    if done.returncode:
        pytest.fail(done.stderr.strip() or done.stdout.strip(), pytrace=False)
    return output


def test_it_builds_with_every_page_and_module(site):
    pages = {path.relative_to(site).with_suffix(".md") for path in site.rglob("*.html")}
    assert {page.relative_to(DOCS) for page in PAGES} <= pages
    modules = (ROOT / "cdrf_addon" / "core").rglob("*.py")
    documented = "".join(p.read_text("utf-8") for p in (site / "develop" / "api").rglob("*.html"))
    for module in modules:
        name = ".".join(module.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        assert f'id="module-{name}"' in documented, name


def test_formulas_are_mathml_and_nothing_is_loaded_from_elsewhere(site):
    assert "<math" in (site / "theory" / "model.html").read_text("utf-8")
    loads = re.compile(r"""<(?:script|img|link|iframe)\b[^>]*?(?:src|href)=["'](https?:)?//""")
    for page in site.rglob("*.html"):
        assert not loads.search(page.read_text("utf-8")), page
    for style in site.rglob("*.css"):
        assert not re.search(r"url\(\s*['\"]?(https?:)?//|@import", style.read_text("utf-8")), style


@pytest.mark.parametrize("page", OUTSIDE, ids=lambda page: page.name)
def test_links_of_pages_outside_the_site_exist(page):
    for link in LINK.findall(page.read_text("utf-8")):
        assert (page.parent / link.partition("#")[0]).exists(), link


def paths_named_in(page: Path) -> Iterator[str]:
    """What a page names in backticks and looks like a file or folder of this project."""
    for code in CODE.findall(page.read_text("utf-8")):
        name = code.partition("::")[0]
        if re.fullmatch(r"[\w.-]+(/[\w.-]+)*/?", name) and (
            name.endswith((".py", ".md", ".toml", ".txt")) or (name.count("/") and name[-1] == "/")
        ):
            yield name


@pytest.mark.parametrize("page", WRITTEN, ids=lambda page: page.stem)
def test_files_named_in_pages_exist(page):
    written = {"site/", "dist/", "demo/", ".venv/", "output/report/"}  # by commands, not in git
    for name in paths_named_in(page):
        assert name in written or any((base / name).exists() for base in BASES), name


def test_every_test_named_for_a_light_exists():
    page = (DOCS / "theory" / "lights.md").read_text("utf-8")
    file = ""
    for code in CODE.findall(page[page.index("## What lights may do") :]):
        before, mark, test = code.partition("::")
        file = before or file
        if mark and test:
            assert f"def {test}(" in (ROOT / "tests" / file).read_text("utf-8"), code


def test_every_room_has_its_row():
    rows = (DOCS / "develop" / "architecture.md").read_text("utf-8")
    for init in (ROOT / "cdrf_addon").rglob("__init__.py"):
        room = init.parent.relative_to(ROOT / "cdrf_addon").as_posix()
        assert room == "." or f"`{room}/`" in rows, room


def test_the_table_of_imports_is_the_one_that_the_code_is_held_to():
    page = (DOCS / "develop" / "architecture.md").read_text("utf-8")
    assert markdown() in page, "put rooms.markdown() into docs/develop/architecture.md"


def test_names_for_scripts_exist():
    page = (DOCS / "pipeline" / "scripts.md").read_text("utf-8")
    sources = "".join(p.read_text("utf-8") for p in (ROOT / "cdrf_addon" / "ui").rglob("*.py"))
    ids = (ROOT / "cdrf_addon" / "ids.py").read_text("utf-8")
    operators = set(re.findall(r"bpy\.ops\.(cdrf\.\w+)\(", page))
    properties = set(re.findall(r"material\.cdrf\.(\w+)", page))
    attributes = set(re.findall(r"`(cdrf_\w+)`", page)) - {"cdrf_addon"}
    assert len(operators) >= 5 and len(properties) >= 5 and len(attributes) == 6
    assert all(f'bl_idname = "{name}"' in sources for name in operators)
    assert all(re.search(rf"\b{name}: \w+Property\(", sources) for name in properties)
    assert all(f'"{name}"' in ids for name in attributes)
