# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line of the benchmark of the look-up table."""

from __future__ import annotations

import argparse

from ..common.files import read_results, write_page, write_results
from ..common.machine import machine
from . import __doc__ as description
from .measure import generation, ideal, measure
from .page import page
from .render import check_arguments
from .variants import MODELS


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--write-only", action="store_true", help="from the JSON of the last run")
    if parser.parse_args().write_only:
        results = read_results("lut")
    else:
        results = {"machine": machine(), "arguments": check_arguments(), "generation": generation()}
        results["ideal"] = {kind: ideal(model) for kind, model in MODELS.items()}
        results |= {kind: measure(model) for kind, model in MODELS.items()}
        write_results("lut", results)
    write_page("lut", page(results))
