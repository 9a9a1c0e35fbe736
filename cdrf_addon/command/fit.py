# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure a material on path-traced spheres and fit CDRF to it, without a window.

    python -m cdrf_addon.fit --color 0.8 0.5 0.4 --radius 1 0.35 0.2 --scale 0.003 --output skin
    blender --background --python cdrf_addon/fit.py -- --color 0.8 0.5 0.4 --radius 1 0.35 0.2

Cycles renders spheres of many sizes under one sun. The folder then holds fit.json with sigma0 per
channel and the errors of every model, fit.png with the curves, and measured.npz with the table.
The exit code is 0 if all went well, 1 if not, 2 for a wrong command line.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from cdrf_addon.blender.material.model import metres_of
from cdrf_addon.blender.material.scattering import read_scattering
from cdrf_addon.command.console import own_arguments, say
from cdrf_addon.core.errors import CdrfError, MeasurementError
from cdrf_addon.core.measured.fitting import MODELS
from cdrf_addon.core.measured.material_fit import (
    CHANNELS,
    EQUATOR,
    WEIGHTINGS,
    MaterialFit,
    fit_material,
)
from cdrf_addon.core.measured.measurement import SphereMeasurement, save
from cdrf_addon.core.measured.model import MeasuredModel
from cdrf_addon.core.progress import in_words
from cdrf_addon.measuring.cache import cache_folder
from cdrf_addon.measuring.figure import draw_fit
from cdrf_addon.measuring.process import measure_steps
from cdrf_addon.measuring.request import DEFAULT_QUALITY, QUALITIES, RANDOM_WALK, Request

FORMAT = 1
PROGRESS_SECONDS = 2.0
LEAST_ALBEDO = 1e-3
METHODS = ("RANDOM_WALK", "RANDOM_WALK_LEGACY", "RANDOM_WALK_SKIN")
UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6}
EXAMPLES = """\
examples:
  skin of a Principled BSDF with Subsurface Radius 1, 0.35, 0.2 and Scale 0.003 (metres):
    fit --color 0.8 0.5 0.4 --radius 1 0.35 0.2 --scale 0.003 --output skin
  the same in millimetres, quickly:
    fit --color 0.8 0.5 0.4 --radius 1 0.35 0.2 --scale 3 --unit mm --quality preview

what the numbers are:
  --color is the base colour, linear, 0 to 1: how much light comes back in each channel.
  --radius is the subsurface radius of each channel, --scale the factor on all three.
  sigma0 in fit.json is what the extension's slider wants: a distance in metres, per channel.
  --blend and --material read all of them from a Principled or Subsurface Scattering node.
  Measurements are kept and used again; --no-cache measures anew.
"""


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"'{text}' is no number") from error
    if not (math.isfinite(value) and 0.0 <= value <= 1e6):
        raise argparse.ArgumentTypeError(f"{text}: a number from 0 to 1e6 is wanted")
    return value


def _colour(text: str) -> float:
    value = _positive(text)
    if not 0.0 < value <= 1.0:
        raise argparse.ArgumentTypeError(f"{text}: a colour above 0 and at most 1 is wanted")
    return value


def _seed(text: str) -> int:
    if not text.isdecimal() or int(text) >= 2**31:
        raise argparse.ArgumentTypeError(f"'{text}': a whole number from 0 to 2147483647 is wanted")
    return int(text)


def make_parser() -> argparse.ArgumentParser:
    """Describe the command line."""
    parser = argparse.ArgumentParser(
        prog="fit",
        description="Render spheres of a material in Cycles and fit CDRF's sigma0 to them.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    rgb = ("R", "G", "B")
    add("--color", type=_colour, nargs=3, metavar=rgb, default=[0.8, 0.8, 0.8],
        help="base colour, linear (default: 0.8 0.8 0.8)")  # fmt: skip
    add("--radius", type=_positive, nargs=3, metavar=rgb, default=[1.0, 0.2, 0.1],
        help="subsurface radius of each channel (default: 1 0.2 0.1)")  # fmt: skip
    add("--blend", type=Path, help="read colour, radius and scale from a material in this file")
    add("--material", help="its name (default: the only material there that scatters)")
    add("--scale", type=_positive, default=0.05, help="factor on the radii (default: 0.05)")
    add("--unit", choices=list(UNITS), default="m", help="of radius times scale (default: m)")
    add("--method", choices=METHODS, default=RANDOM_WALK,
        help="subsurface method (default: RANDOM_WALK)")  # fmt: skip
    add("--quality", choices=list(QUALITIES), default=DEFAULT_QUALITY,
        help="paths through each pixel (default: default, half a minute on two cores)")  # fmt: skip
    add("--seed", type=_seed, default=0, help="another seed is an independent measurement")
    add("--weighting", choices=list(WEIGHTINGS), default=EQUATOR,
        help="what the fits weigh: angles along the equator as the paper, or area")  # fmt: skip
    add("--output", type=Path, default=Path("fit"), help="folder for the results (default: fit)")
    add("--no-cache", action="store_true", help="measure anew, and keep nothing but the results")
    return parser


def run_measurement(request: Request, folder: Path) -> SphereMeasurement:
    """Measure, and say how far it is.

    Raises:
        MeasurementError: It failed.
    """
    steps = measure_steps(request, folder)
    start = told = time.perf_counter()
    try:
        while True:
            try:
                part, what = next(steps)
            except StopIteration as done:
                measurement: SphereMeasurement = done.value
                return measurement
            now = time.perf_counter()
            if now - told >= PROGRESS_SECONDS:
                told = now
                say(f"  {what}: {in_words(part, now - start)}")
    finally:
        steps.close()  # ends the child on Ctrl-C too


def results(
    options: argparse.Namespace, model: MeasuredModel, fit: MaterialFit, seconds: float
) -> dict[str, Any]:
    """Everything that was found, as JSON has it: numbers that are not finite become null."""
    measurement = model.measurement
    radii = np.array(options.radius) * options.scale * UNITS[options.unit]
    channels = {}
    for number, (name, channel) in enumerate(zip(CHANNELS, fit.channels, strict=True)):
        spheres = [
            {
                "scale": float(scale),
                "lambert_rms": channel.lambert[row],
                "noise_rms": channel.noise[row],
                "measured_chi_squared": model.curves[row][number].chi_squared,
                **{
                    model_name: {
                        "gain_fixed": vars(channel.fixed[model_name][row]),
                        "gain_free": vars(channel.free[model_name][row]),
                    }
                    for model_name in MODELS
                },
            }
            for row, scale in enumerate(fit.scales)
        ]
        ends = {key: end if math.isfinite(end) else None for key, end in
                channel.proportional_to.items()}  # fmt: skip
        channels[name] = {
            "albedo": channel.albedo,
            "radius_metres": float(radii[number]),
            "sigma0_per_radius": channel.sigma0,
            "sigma0_metres": {
                key: value * float(radii[number]) for key, value in channel.sigma0.items()
            },
            "proportional_to_scale": ends,
            "spheres": spheres,
        }
    return {
        "format": FORMAT,
        "blender": measurement.blender,
        "method": measurement.method,
        "samples": measurement.samples,
        "seed": measurement.seed,
        "weighting": fit.weighting,
        "seconds": round(seconds, 2),
        "sigma_per_scale": model.sigma_per_scale,
        "sentences": fit.sentences(),
        "channels": channels,
    }


def error_table(model: MeasuredModel, fit: MaterialFit) -> list[str]:
    """RMS of Lambert and every model side by side, gain 1, on spheres of some sizes."""
    theta = model.measurement.theta
    weights = WEIGHTINGS[fit.weighting](theta)
    lines = [f"{'RMS, gain 1':>24}" + "".join(f"{n:>10}" for n in ("Lambert", *MODELS, "measured"))]
    for number, (name, channel) in enumerate(zip(CHANNELS, fit.channels, strict=True)):
        for row in range(2, len(fit.scales), 4):
            off = model.curves[row][number](theta) - model.measurement.values[row, number]
            errors = [channel.lambert[row], *(channel.fixed[m][row].rms for m in MODELS)]
            errors.append(math.sqrt(float((off**2) @ weights)))
            size = f"{name}, r = {1.0 / fit.scales[row]:.3g} radii"
            lines.append(f"{size:>24}" + "".join(f"{error:10.4f}" for error in errors))
    return lines


def read_file(options: argparse.Namespace) -> None:
    """Fill colour, radius, scale and method in from a material of a .blend.

    Raises:
        MeasurementError: The file cannot be opened, or no such material scatters.
    """
    try:
        bpy.ops.wm.open_mainfile(filepath=str(options.blend.resolve()), load_ui=False)
    except RuntimeError as error:
        raise MeasurementError(f"{options.blend} cannot be opened: {str(error).strip()}") from error
    found = {item.name: read_scattering(item) for item in bpy.data.materials}
    scatters = {name: item for name, item in found.items() if item is not None}
    name = options.material or (next(iter(scatters)) if len(scatters) == 1 else "")
    if name not in scatters:
        there = ", ".join(scatters) or "none"
        raise MeasurementError(
            f"{'No material is chosen' if not name else f'{name!r} does not scatter'}; materials "
            f"with subsurface scattering in {options.blend.name}: {there}. Choose by --material."
        )
    material = scatters[name]
    for note in material.notes:
        say(f"{name}: {note}")
    options.color = [min(max(part, LEAST_ALBEDO), 1.0) for part in material.albedo]
    metres = metres_of(bpy.context.scene)
    options.radius, options.scale, options.unit = [r * metres for r in material.radius], 1.0, "m"
    if material.method in METHODS:
        options.method = material.method
    else:
        say(f"{name}: {material.method} is measured as {options.method}, which CDRF is made for.")


def run(options: argparse.Namespace) -> None:
    """Measure, fit, and write the three files.

    Raises:
        CdrfError: What went wrong, in a sentence.
        OSError: A file cannot be written.
    """
    start = time.perf_counter()
    if options.blend is not None:
        read_file(options)
    out: Path = options.output
    out.mkdir(parents=True, exist_ok=True)
    colour = (options.color[0], options.color[1], options.color[2])
    request = Request(colour, options.quality, options.seed, method=options.method)
    if options.no_cache:
        with tempfile.TemporaryDirectory(prefix="cdrf-fit-") as place:
            measurement = run_measurement(request, Path(place))
    else:
        measurement = run_measurement(request, cache_folder())
    model = MeasuredModel(measurement, options.radius)
    fit = fit_material(measurement, options.weighting)
    seconds = time.perf_counter() - start
    save(out / "measured.npz", measurement)
    draw_fit(model, fit, out / "fit.png")
    part = out / "fit.json.part"
    part.write_text(json.dumps(results(options, model, fit, seconds), indent=1) + "\n", "utf-8")
    part.replace(out / "fit.json")
    for line in (*fit.sentences(), *error_table(model, fit)):
        say(line)
    radii = np.array(options.radius) * options.scale * UNITS[options.unit] * 1e3
    for name in MODELS:
        millimetres = [channel.sigma0[name] * radius
                       for channel, radius in zip(fit.channels, radii, strict=True)]  # fmt: skip
        say(f"σ0 for {name}: " + ", ".join(f"{value:.4g}" for value in millimetres) + " mm")
    say(f"{time.perf_counter() - start:.1f} s; see {out / 'fit.json'} and {out / 'fit.png'}")


def main(argv: list[str] | None = None) -> int:
    """Run the command; return the exit code: 0, 1 if it failed, 2 for a wrong command line."""
    parser = make_parser()
    try:
        options = parser.parse_args(own_arguments(sys.argv) if argv is None else argv)
        if options.material and options.blend is None:
            raise MeasurementError("--material names a material of the file given by --blend.")
        if options.blend is None and max(options.radius) * options.scale <= 0.0:
            raise MeasurementError("radius times scale is 0: nothing scatters, nothing to measure.")
    except MeasurementError as error:
        say(f"fit: {error}")
        return 2
    except SystemExit as stop:  # argparse has printed why
        return int(stop.code or 0)
    try:
        run(options)
    except KeyboardInterrupt:
        say("Stopped; nothing was kept.")
        return 130
    except (CdrfError, OSError) as error:
        say(f"fit: {error}")
        return 1
    return 0
