# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures: the extension enabled from the checkout, and a clean, pinned scene per test."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from pathlib import Path

import pytest
from checkout import CheckoutIsNoPackage
from stability import Collector

STABILITY = pytest.StashKey[Collector]()


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


# --- what the page on stability reports (tests/support/stability.py) ------------------------------


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--stability", type=Path, help="write the outcome of extreme cases, as JSON")


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(CheckoutIsNoPackage())
    config.stash[STABILITY] = Collector(Path(__file__).parent)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    for item in items:
        if config.stash[STABILITY].entry(item.nodeid, item.path) is not None:
            item.add_marker("stability")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    collector = item.config.stash[STABILITY]
    extreme = collector.entry(item.nodeid, item.path)
    if extreme is not None and (report.when == "call" or report.failed):
        values = "; ".join(str(value) for _, value in report.user_properties)
        collector.add(extreme, item.nodeid, report.outcome, report.duration, values)
    return report


def pytest_sessionfinish(session: pytest.Session) -> None:
    path = session.config.getoption("--stability")
    if path is not None:
        from tests.benchmarks.common.machine import machine

        session.config.stash[STABILITY].write(path, machine())
