# SPDX-License-Identifier: GPL-3.0-or-later
"""The site made of these pages: `./dev docs` builds it into site/, without network.

Pages are Markdown that reads well in the repository too. Formulas become MathML and drawings are
SVG files, so the site loads nothing from elsewhere.
"""

import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "docs" / "_extensions")]

project = "CDRF for Blender"
author = "CDRF for Blender"
copyright = "2026 CDRF for Blender. GPL-3.0-or-later"
with (ROOT / "pyproject.toml").open("rb") as file:
    release = version = tomllib.load(file)["project"]["version"]
language = "en_GB"

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "mathml", "api_pages"]
source_suffix = {".md": "markdown"}
exclude_patterns = ["_extensions"]

# Every reference that leads nowhere is a warning, and `./dev docs` takes warnings as errors.
nitpicky = True
# Types of numpy and Python have no pages here.
nitpick_ignore_regex = [(r"py:.*", r".*")]

# The generated report_scenes.md starts with scenes, a level below what it continues.
suppress_warnings = ["myst.header"]

myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 4

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_default_options = {"members": True, "exclude-members": "__init__, __new__, __post_init__"}
napoleon_numpy_docstring = False

# Blocks are commands, formulas and drawings of nodes unless they name a language.
highlight_language = "none"

html_theme = "furo"
html_title = "CDRF for Blender"
html_copy_source = False
html_show_sourcelink = False
html_static_path = []
