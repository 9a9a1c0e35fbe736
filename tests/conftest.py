# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures: the extension enabled from the checkout, and a clean, pinned scene per test."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from checkout import CheckoutIsNoPackage


@pytest.fixture(scope="session")
def _enabled() -> Iterator[None]:
    import bpy

    assert bpy.ops.preferences.addon_enable(module="cdrf_addon") == {"FINISHED"}
    yield
    bpy.ops.preferences.addon_disable(module="cdrf_addon")


@pytest.fixture
def rig(_enabled: None):
    from rig import Rig

    return Rig()


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(CheckoutIsNoPackage())
