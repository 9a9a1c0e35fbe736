# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs a benchmark by its name: `./dev bench NAME [arguments]`."""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.util import find_spec

BENCHMARKS = {
    "setup_time": ("2 minutes", "run time and memory of Make Translucent"),
    "lut": ("5 minutes", "the look-up table in rendered EEVEE pixels"),
    "walk": ("5 minutes", "the view-dependent model against walks it was not fitted to"),
    "shadows": ("10 minutes", "cast shadows against path tracing"),
    "measured": ("15 minutes", "the measured model, and fits of sigma0 to spheres"),
    "resolution": ("15 minutes", "the same shape at several resolutions"),
    "node_groups": ("half an hour", "nodes and cost of a draw, by lights and shadows"),
    "view_dependence": ("an hour", "the path-traced look against two of Cycles' methods"),
    "model_choice": ("half an hour", "which model comes closest to path tracing"),
    "kappa_choice": ("an hour", "which curvature, diffused over which length"),
    "estimators": ("7 hours", "error against time of curvature estimators (--quick: minutes)"),
    "report": ("many hours", "error against time of everything (--sample: minutes)"),
}
"""Name: how long it takes on two cores, and what it measures."""


def usage() -> str:
    """Return the list of benchmarks."""
    lines = ["usage: ./dev bench NAME [arguments]    (NAME --help lists its arguments)", ""]
    lines += [f"  {name:13} {time:13} {what}" for name, (time, what) in BENCHMARKS.items()]
    return "\n".join(lines)


def main() -> None:
    """Run the benchmark that the first argument names, with the arguments after it."""
    name = sys.argv[1] if len(sys.argv) > 1 else "--help"
    if name in ("-h", "--help", "help"):
        print(usage())
        return
    if name not in BENCHMARKS:
        sys.exit(f"There is no benchmark {name}.\n\n{usage()}")
    sys.argv[:2] = [f"bench {name}"]
    module = f"{__package__}.{name}"
    spec = find_spec(module)
    if spec is not None and spec.submodule_search_locations:
        module += ".__main__"
    import_module(module).main()


if __name__ == "__main__":
    main()
