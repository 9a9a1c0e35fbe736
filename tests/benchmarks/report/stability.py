# SPDX-License-Identifier: GPL-3.0-or-later
"""What is stiff or extreme: runs the tests that try it, and writes the page of what came out."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

from ..common.files import ROOT
from ..common.markdown import escape, facts, generated, table
from .settings import Settings

SAMPLE = ("tests/core/test_ring_model.py",)
"""What of it is run for the sample, which itself runs in a test."""


def run(settings: Settings) -> None:
    """Run the tests, and keep what came out of them as JSON.

    Raises:
        RuntimeError: pytest could not run them.
    """
    path = settings.file_of("stability").resolve()
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "-m",
        "stability",
        "--stability",
        str(path),
        *(SAMPLE if settings.sample else ()),
    ]
    done = subprocess.run(command, cwd=ROOT, check=False, capture_output=True, text=True)
    print("\n".join(done.stdout.strip().splitlines()[-3:]), flush=True)
    # 1 is a test that failed, which the page has to report.
    if done.returncode not in (0, 1):
        raise RuntimeError(f"pytest ended with {done.returncode}: {done.stdout}{done.stderr}")


def page(results: dict[str, Any]) -> str:
    """The page, as Markdown; it names what failed and what was not run."""
    tests = results["tests"]
    cases = [case for test in tests for case in test["cases"]]
    failed = [case for case in cases if case["outcome"] != "passed"]
    lines = [
        "# Numerical stability: what was tried, what came out, what holds it",
        "",
        f"{generated('report')} It reports a run of the tests that "
        "`tests/support/stability.py` names.",
        "",
        f"Measured on: {facts(results['machine'])}.",
        "",
        f"{len(tests)} tests, {len(cases)} cases: {len(cases) - len(failed)} came out as they "
        f"should, {len(failed)} did not.",
        "",
    ]
    for area in dict.fromkeys(test["area"] for test in tests):
        rows = [_row(test) for test in tests if test["area"] == area]
        lines += [f"## {area}", "", *table(["tried", "came out", "in", "guard", "test"], rows)]
    detailed = [test for test in tests if any(case["said"] for case in test["cases"])]
    if detailed:
        lines += ["## Case by case", ""]
    for test in detailed:
        lines += [f"**{test['tried'].capitalize()}** (`{test['test']}`):", ""]
        lines += table(["case", "came out"], [_case_row(case) for case in test["cases"]])
    if results["not run"]:
        lines += ["Not run: " + ", ".join(f"`{name}`" for name in results["not run"]) + ".", ""]
    return "\n".join(lines)


def _row(test: dict[str, Any]) -> list[str]:
    cases = test["cases"]
    good = sum(case["outcome"] == "passed" for case in cases)
    held = test["held"] if good == len(cases) else f"**NOT: {test['held']}**"
    return [test["tried"], held, f"{good} of {len(cases)}", test["guard"], f"`{test['test']}`"]


def _case_row(case: dict[str, Any]) -> list[str]:
    mark = "" if case["outcome"] == "passed" else " **FAILED**"
    return [case["case"].replace("_", " ") or "all", escape(case["said"]) + mark]


def write(settings: Settings) -> bool:
    """Write docs/results/stability.md if there are results; whether there were."""
    results = settings.read("stability")
    if not results:
        return False
    (settings.docs / "stability.md").write_text(page(results), encoding="utf-8")
    return True
