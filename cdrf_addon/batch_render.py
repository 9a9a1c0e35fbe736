# SPDX-License-Identifier: GPL-3.0-or-later
"""Render scenes and mesh files with CDRF, without a window.

    python -m cdrf_addon.batch_render --help
    blender --background --python cdrf_addon/batch_render.py -- --help

The work is done in `command/batch.py`; this file is the name that scripts and farms know it by.
"""

from __future__ import annotations

import sys
from pathlib import Path

if not __package__:  # run as a file: make the package importable, then go on inside it
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
    __package__ = "cdrf_addon"

from cdrf_addon.command.batch import main
from cdrf_addon.command.console import leave

if __name__ == "__main__":
    leave(main())
