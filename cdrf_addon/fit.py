# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure a material on path-traced spheres and fit CDRF to it, without a window.

    python -m cdrf_addon.fit --help
    blender --background --python cdrf_addon/fit.py -- --help

The work is done in `command/fit_run.py`; this file is the name that scripts and farms know it by.
"""

from __future__ import annotations

import sys
from pathlib import Path

if not __package__:  # run as a file
    folder = Path(__file__).resolve().parent
    # An installed extension has another name; by this one Blender would have the code twice.
    loaded = (
        name
        for name, module in sys.modules.items()
        if name.endswith(f".{folder.name}")
        and Path(getattr(module, "__file__", None) or "").resolve().parent == folder
    )
    __package__ = next(loaded, folder.name)
    if __package__ == folder.name:
        sys.path.insert(0, str(folder.parent))

from .command.console import leave
from .command.fit_run import main

if __name__ == "__main__":
    leave(main())
