# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line of the fit, read into a `FitOptions`."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..core.errors import ParameterError
from ..core.measured.material_fit import EQUATOR, WEIGHTINGS
from ..measuring.request import DEFAULT_QUALITY, QUALITIES, RANDOM_WALK, Request

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


@dataclass(frozen=True)
class FitOptions:
    """What to measure and fit.

    Attributes:
        color: Base colour, linear.
        radius: Subsurface radius of each channel.
        scale: Factor on the radii.
        unit: Of radius times scale; one of UNITS.
        blend: File from whose material to read all of these.
        material: Its name; empty takes the only one that scatters.
        method: Subsurface method, as Blender's node names it.
        quality: One of QUALITIES.
        seed: Of the path tracing.
        weighting: What the fits weigh; one of WEIGHTINGS.
        output: Folder for the results.
        no_cache: Whether to measure anew and keep nothing but the results.
    """

    color: tuple[float, float, float] = (0.8, 0.8, 0.8)
    radius: tuple[float, float, float] = (1.0, 0.2, 0.1)
    scale: float = 0.05
    unit: str = "m"
    blend: Path | None = None
    material: str | None = None
    method: str = RANDOM_WALK
    quality: str = DEFAULT_QUALITY
    seed: int = 0
    weighting: str = EQUATOR
    output: Path = Path("fit")
    no_cache: bool = False

    @property
    def radius_metres(self) -> NDArray[np.float64]:
        """Scatter radius of each channel, (3,), metres."""
        return np.array(self.radius) * self.scale * UNITS[self.unit]

    @property
    def request(self) -> Request:
        """The spheres to measure."""
        return Request(self.color, self.quality, self.seed, method=self.method)


def _not_negative(text: str) -> float:
    try:
        value = float(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"'{text}' is no number") from error
    if not (math.isfinite(value) and 0.0 <= value <= 1e6):
        raise argparse.ArgumentTypeError(f"{text}: a number from 0 to 1e6 is wanted")
    return value


def _colour(text: str) -> float:
    value = _not_negative(text)
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
    add("--color", type=_colour, nargs=3, metavar=rgb,
        help="base colour, linear (default: 0.8 0.8 0.8)")  # fmt: skip
    add("--radius", type=_not_negative, nargs=3, metavar=rgb,
        help="subsurface radius of each channel (default: 1 0.2 0.1)")  # fmt: skip
    add("--blend", type=Path, help="read colour, radius and scale from a material in this file")
    add("--material", help="its name (default: the only material there that scatters)")
    add("--scale", type=_not_negative, help="factor on the radii (default: 0.05)")
    add("--unit", choices=list(UNITS), help="of radius times scale (default: m)")
    add("--method", choices=METHODS, help="subsurface method (default: RANDOM_WALK)")
    add("--quality", choices=list(QUALITIES),
        help="paths through each pixel (default: default, half a minute on two cores)")  # fmt: skip
    add("--seed", type=_seed, help="another seed is an independent measurement")
    add("--weighting", choices=list(WEIGHTINGS),
        help="what the fits weigh: angles along the equator as the paper, or area")  # fmt: skip
    add("--output", type=Path, help="folder for the results (default: fit)")
    add("--no-cache", action="store_true", help="measure anew, and keep nothing but the results")
    parser.set_defaults(**vars(FitOptions()))
    return parser


def parse_options(arguments: Sequence[str]) -> FitOptions:
    """Read the command line.

    Raises:
        ParameterError: The options do not go together.
        SystemExit: The parser has printed help, or what is wrong.
    """
    parsed = vars(make_parser().parse_args(arguments))
    known = {field.name: parsed[field.name] for field in fields(FitOptions)}
    options = FitOptions(
        **known | {"color": tuple(parsed["color"]), "radius": tuple(parsed["radius"])}
    )
    if options.material and options.blend is None:
        raise ParameterError("--material names a material of the file given by --blend.")
    if options.blend is None and max(options.radius) * options.scale <= 0.0:
        raise ParameterError("radius times scale is 0: nothing scatters, nothing to measure.")
    return options
