# SPDX-License-Identifier: GPL-3.0-or-later
"""Lets the tests run in a checkout of any name, "cdrf-blender" for one."""

from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


class CheckoutIsNoPackage:
    """Plugin: the root's __init__.py, meant for Blender, would make pytest import the folder."""

    @pytest.hookimpl(tryfirst=True)
    def pytest_collect_directory(
        self, path: Path, parent: pytest.Collector
    ) -> pytest.Collector | None:
        """Take the checkout for a plain folder."""
        return pytest.Dir.from_parent(parent, path=path) if path == ROOT else None
