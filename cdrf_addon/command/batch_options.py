# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line of the batch renderer, read into a `BatchOptions`."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from ..blender.display.curvature import QUANTITIES
from ..core.curvature.estimators import DEFAULT_METHOD, DEFAULT_RADIUS, METHODS
from ..core.curvature.field import Options
from ..core.errors import ParameterError
from ..core.reflectance.model import MODEL_ITEMS
from ..core.scattering.presets import PRESETS
from . import stage

DEMO_MESH = Path(__file__).resolve().parents[2] / "tests" / "data" / "human_head.obj"
# The head's unit is the decimetre; colour and scatter distances are those of skin.
DEMO: Mapping[str, Any] = {
    "output": Path("demo"),
    "scale": 0.1,
    "subdivide": 2,
    "sigma0": [0.003],
    "ratio": [1.0, 0.35, 0.2],
    "albedo": [0.8, 0.56, 0.45],
    "resolution": (480, 640),
    "samples": 16,
    "lambert": True,
}
SCENE_KINDS = (".blend", *stage.MESH_IMPORTERS)


@dataclass(frozen=True)
class BatchOptions:
    """What to render, and how; None or empty leaves it to the file.

    Attributes:
        inputs: Scenes and mesh files.
        output: Folder for pictures and the summary.
        sigma0: Scatter distances in world units, a picture each.
        ratio: Scatter distance of red, green and blue as factors of sigma0.
        model: Kind of the reflectance model.
        preset: Name of a real material whose scatter distance to use.
        albedo: Base colour of mesh files, linear.
        frames: Frames to render; empty renders the file's current one.
        resolution: Width and height, pixels.
        samples: EEVEE's samples per pixel.
        format: PNG, or EXR with 32-bit floats.
        lambert: Whether to render sigma0 = 0 as well, and both side by side.
        scale: Factor on the size of mesh files.
        subdivide: Smooth subdivisions of mesh files.
        curvature: Which curvature to render in colours as well.
        method: How to estimate curvature anew.
        rings: Rings of neighbours in the estimate.
        save_blend: Whether to save each prepared scene.
        force: Whether to render again what an earlier run has made.
    """

    inputs: tuple[Path, ...] = ()
    output: Path = Path("render")
    sigma0: tuple[float, ...] = ()
    ratio: tuple[float, float, float] | None = None
    model: str | None = None
    preset: str | None = None
    albedo: tuple[float, float, float] | None = None
    frames: tuple[int, ...] | None = None
    resolution: tuple[int, int] | None = None
    samples: int | None = None
    format: str = "PNG"
    lambert: bool = False
    scale: float = 1.0
    subdivide: int = 0
    curvature: str | None = None
    method: str | None = None
    rings: int | None = None
    save_blend: bool = False
    force: bool = False

    @property
    def suffix(self) -> str:
        """Ending of the pictures' names."""
        return ".exr" if self.format == "EXR" else ".png"

    @property
    def estimation(self) -> Options | None:
        """How to measure curvature; None if that is left to the file."""
        if self.method is None and self.rings is None:
            return None
        return Options(self.method or DEFAULT_METHOD, self.rings or DEFAULT_RADIUS)

    def as_json(self) -> dict[str, Any]:
        """Return the options as JSON has them."""
        paths = {"inputs": [str(path) for path in self.inputs], "output": str(self.output)}
        return asdict(self) | paths

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> BatchOptions:
        """Read what `as_json` has written."""
        paths = {"inputs": map(Path, values["inputs"]), "output": Path(values["output"])}
        return cls._from({**values, **paths})

    @classmethod
    def _from(cls, values: Mapping[str, Any]) -> BatchOptions:
        """Take the fields from a parser's or JSON's values, whose sequences are lists."""
        known: dict[str, Any] = {field.name: values[field.name] for field in fields(cls)}
        for name, value in known.items():
            if isinstance(value, Iterable) and not isinstance(value, str):
                known[name] = tuple(value)
        return cls(**known)


def parse_frames(text: str) -> list[int]:
    """Read "7", "1-5", "1-9:2" or a comma-separated list of those.

    Raises:
        argparse.ArgumentTypeError: The text is none of them.
    """
    frames: list[int] = []
    try:
        for part in text.split(","):
            span, _, step = part.partition(":")
            # A leading minus is a negative frame, not a span.
            first, dash, last = span[1:].partition("-")
            start = int(span[:1] + first)
            frames += range(start, (int(last) if dash else start) + 1, int(step or 1))
    except ValueError as error:
        raise argparse.ArgumentTypeError(
            f"'{text}' is no list of frames; write 7, 1-5, 1-9:2 or 1,4,8"
        ) from error
    if not frames:
        raise argparse.ArgumentTypeError(f"'{text}' holds no frame; the first must be the smaller")
    return frames


def parse_resolution(text: str) -> tuple[int, int]:
    """Read "512" or "640x480".

    Raises:
        argparse.ArgumentTypeError: Not one or two whole numbers from 4 to 65536.
    """
    parts = text.lower().split("x")
    try:
        width, height = (int(part) for part in (parts * 2 if len(parts) == 1 else parts))
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"'{text}' is no resolution; write 640x480") from error
    if not (4 <= width <= 65536 and 4 <= height <= 65536):
        raise argparse.ArgumentTypeError(f"'{text}' is out of range; 4 to 65536 pixels a side")
    return width, height


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(
            f"'{text}' is no number (name the input files first, options after them)"
        ) from error


def _between(low: float, high: float, wanted: str) -> Callable[[str], float]:
    def read(text: str) -> float:
        value = _number(text)
        if not (math.isfinite(value) and low <= value <= high):
            raise argparse.ArgumentTypeError(f"{text}: {wanted} is wanted")
        return value

    return read


def _count(low: int, high: int) -> Callable[[str], int]:
    def read(text: str) -> int:
        value = _number(text)
        if value != int(value) or not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text}: a number from {low} to {high} is wanted")
        return int(value)

    return read


_distance = _between(0.0, 1e6, "a distance from 0 to 1e6")
_factor = _between(0.0, 1e3, "a factor from 0 to 1000")
_size = _between(1e-9, 1e9, "a scale from 1e-9 to 1e9")


def make_parser() -> argparse.ArgumentParser:
    """Describe the command line."""
    parser = argparse.ArgumentParser(
        prog="batch_render",
        description="Render scenes and mesh files with curvature-dependent translucency in EEVEE.",
    )
    add = parser.add_argument
    add("inputs", nargs="*", type=Path, help=f"files: {', '.join(SCENE_KINDS)}")
    add("--output", type=Path, help="folder for pictures and summary.json")
    add("--sigma0", type=_distance, nargs="+", metavar="S",
        help="scatter distances in world units, a picture each (default: the file's)")  # fmt: skip
    add("--ratio", type=_factor, nargs=3, metavar=("R", "G", "B"),
        help="scatter distance of red, green, blue as factors of sigma0")  # fmt: skip
    add("--model", choices=[key for key, *_ in MODEL_ITEMS],
        help="SPHERE is the panel's Path-Traced Look, with View Dependence as the file has it or "
        "where --preset is given; RING is the paper's (default: the file's; SPHERE for mesh "
        "files)")  # fmt: skip
    add("--preset", choices=list(PRESETS), metavar="NAME",
        help=f"scatter distance of a real material: {', '.join(PRESETS)}")  # fmt: skip
    add("--albedo", type=_factor, nargs=3, metavar=("R", "G", "B"),
        help="base colour of mesh files, linear")  # fmt: skip
    add("--frames", type=parse_frames, help="7, 1-5, 1-9:2 or 1,4,8 (default: the current one)")
    add("--resolution", type=parse_resolution, help="640x480 or 512 (default: as in the file)")
    add("--samples", type=_count(1, 65536), help="EEVEE samples (default: as in the file)")
    add("--format", choices=["PNG", "EXR"], help="EXR is 32-bit float, linear")
    add("--lambert", action="store_true", help="also render sigma0 = 0, and both side by side")
    add("--scale", type=_size, help="size of mesh files: 0.1 for decimetres")
    add("--subdivide", type=_count(0, 6), help="smooth subdivisions of mesh files")
    add("--curvature", nargs="?", const="KAPPA", choices=list(QUANTITIES), metavar="WHAT",
        help="also render the curvature in colours, with a legend: KAPPA (as measured, the "
        "default), DIFFUSED (as rendered) or MEAN (signed)")  # fmt: skip
    add("--method", choices=list(METHODS), help="estimate curvature anew, this way")
    add(
        "--rings", type=_count(2, 10), help="rings of neighbours in the estimate (3-5: noisy scans)"
    )
    add("--save-blend", action="store_true", help="also save each prepared scene")
    add("--force", action="store_true", help="render again what is there already")
    add("--demo", action="store_true", help="the human head, Lambert beside CDRF")
    parser.set_defaults(**vars(BatchOptions()))
    return parser


def parse_options(arguments: Sequence[str]) -> BatchOptions:
    """Read the command line.

    Raises:
        ParameterError: No input is given, or one that cannot be rendered.
        SystemExit: The parser has printed help, or what is wrong.
    """
    parser = make_parser()
    parsed = parser.parse_args(arguments)
    if parsed.demo:
        if not DEMO_MESH.exists():
            parser.error(
                "the demo needs the project's folder; tests/data/human_head.obj is missing"
            )
        parsed.inputs = [DEMO_MESH]
        for name, value in DEMO.items():
            if getattr(parsed, name) == parser.get_default(name):
                setattr(parsed, name, value)
    options = BatchOptions._from(vars(parsed))
    if not options.inputs:
        raise ParameterError("no input given; name .blend or mesh files, or use --demo.")
    unknown = [str(path) for path in options.inputs if path.suffix.lower() not in SCENE_KINDS]
    if unknown:
        raise ParameterError(
            f"{', '.join(unknown)}: only {', '.join(SCENE_KINDS)} can be rendered."
        )
    return options
