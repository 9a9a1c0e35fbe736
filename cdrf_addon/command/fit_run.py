# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure a material on path-traced spheres, fit CDRF to it, and write the results.

Cycles renders spheres of many sizes under one sun. The folder then holds fit.json with sigma0 per
channel and the errors of every model, fit.png with the curves, and measured.npz with the table.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import bpy

from ..blender.material.scattering import read_scattering
from ..blender.units import metres_per_unit
from ..core.errors import CdrfError, MeasurementError, ParameterError
from ..core.measured.material_fit import fit_material
from ..core.measured.measurement import SphereMeasurement, save
from ..core.measured.model import MeasuredModel
from ..measuring.cache import cache_folder
from ..measuring.figure import draw_fit
from ..measuring.process import measure_steps
from .console import own_arguments, print_line, run_with_progress
from .fit_options import METHODS, FitOptions, parse_options
from .fit_results import as_json, error_table, sigma0_lines

PROGRESS_SECONDS = 2.0
LEAST_ALBEDO = 1e-3


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return the exit code: 0, 1 if it failed, 2 for a wrong command line."""
    try:
        options = parse_options(own_arguments(sys.argv) if argv is None else argv)
    except ParameterError as error:
        print_line(f"fit: {error}")
        return 2
    except SystemExit as stop:  # argparse has printed why
        return int(stop.code or 0)
    try:
        run(options)
    except KeyboardInterrupt:
        print_line("Stopped; nothing was kept.")
        return 130
    except (CdrfError, OSError) as error:
        print_line(f"fit: {error}")
        return 1
    return 0


def run(options: FitOptions) -> None:
    """Measure, fit, and write the three files.

    Raises:
        CdrfError: What went wrong, in a sentence.
        OSError: A file cannot be written.
    """
    start = time.perf_counter()
    if options.blend is not None:
        options = read_material(options, options.blend)
    out = options.output
    out.mkdir(parents=True, exist_ok=True)
    measurement = _measure(options)
    model = MeasuredModel(measurement, options.radius)
    fit = fit_material(measurement, options.weighting)
    found = as_json(options, model, fit, time.perf_counter() - start)
    save(out / "measured.npz", measurement)
    draw_fit(model, fit, out / "fit.png")
    part = out / "fit.json.part"
    part.write_text(json.dumps(found, indent=1) + "\n", "utf-8")
    part.replace(out / "fit.json")
    for line in (*fit.sentences(), *error_table(model, fit), *sigma0_lines(options, fit)):
        print_line(line)
    seconds = time.perf_counter() - start
    print_line(f"{seconds:.1f} s; see {out / 'fit.json'} and {out / 'fit.png'}")


def _measure(options: FitOptions) -> SphereMeasurement:
    """Measure the spheres, or take them from the cache, and print the progress."""
    if not options.no_cache:
        steps = measure_steps(options.request, cache_folder())
        return run_with_progress(steps, PROGRESS_SECONDS)
    with tempfile.TemporaryDirectory(prefix="cdrf-fit-") as folder:
        steps = measure_steps(options.request, Path(folder))
        return run_with_progress(steps, PROGRESS_SECONDS)


def read_material(options: FitOptions, blend: Path) -> FitOptions:
    """Take colour, radius, scale and method from a material of a .blend.

    Args:
        options: Name the material.
        blend: The file.

    Returns:
        The options with what was read.

    Raises:
        MeasurementError: The file cannot be opened, or no such material scatters.
    """
    try:
        bpy.ops.wm.open_mainfile(filepath=str(blend.resolve()), load_ui=False)
    except RuntimeError as error:
        raise MeasurementError(f"{blend} cannot be opened: {str(error).strip()}") from error
    found = {material.name: read_scattering(material) for material in bpy.data.materials}
    scatters = {name: own for name, own in found.items() if own is not None}
    name = options.material or (next(iter(scatters)) if len(scatters) == 1 else "")
    if name not in scatters:
        there = ", ".join(scatters) or "none"
        raise MeasurementError(
            f"{'No material is chosen' if not name else f'{name!r} does not scatter'}; materials "
            f"with subsurface scattering in {blend.name}: {there}. Choose by --material."
        )
    own = scatters[name]
    for note in own.notes:
        print_line(f"{name}: {note}")
    if own.method in METHODS:
        options = replace(options, method=own.method)
    else:
        print_line(f"{name}: {own.method} is measured as {options.method}, which CDRF is made for.")
    metres = metres_per_unit(bpy.context.scene)
    red, green, blue = (min(max(part, LEAST_ALBEDO), 1.0) for part in own.albedo)
    x, y, z = (part * metres for part in own.radius)
    return replace(options, color=(red, green, blue), radius=(x, y, z), scale=1.0, unit="m")
