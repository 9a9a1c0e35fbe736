# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure path-traced spheres in a Blender of their own, so that the artist's stays alive.

`measure_steps` is a generator: it starts the child, yields progress while the child renders, and
returns the measurement. To close it is to cancel: the child ends and its files are removed.
"""

from __future__ import annotations

import hashlib
import json
import math
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ..compat import walk_method
from ..core.errors import MeasurementError
from ..core.measured.measurement import SphereMeasurement, bin_pixels, load, pool, save
from ..core.progress import run_steps

VERSION = 4
"""Part of the cache's key: raise it when the worker measures something else."""
WORKER = Path(__file__).resolve().with_name("worker.py")
PROGRESS = "CDRF-PROGRESS"
POLL_SECONDS = 0.05
KILL_SECONDS = 10.0
STALE_SECONDS = 24.0 * 3600.0
RANDOM_WALK = "RANDOM_WALK"
# Scales from which nothing is left but Lambert's shape, to which nothing more changes. Until 4.5,
# and in what 5.x calls legacy, the same radius scatters about a tenth as far.
FIRST_SCALE, ROWS, ROWS_PER_OCTAVE = 2.0**-8, 22, 2
OLD_REACH = 8.0


@dataclass(frozen=True)
class Quality:
    """Pixels across and down each sphere, paths through each, in so many passes."""

    pixels: tuple[int, int]
    samples: int
    passes: int


QUALITIES = {
    "preview": Quality((64, 12), 8, 4),
    "default": Quality((80, 20), 30, 8),
    "fine": Quality((96, 24), 64, 8),
}
DEFAULT_QUALITY = "default"


@dataclass(frozen=True)
class Request:
    """What to measure.

    Attributes:
        albedo: Colour of the red, green and blue channel, each in (0, 1].
        quality: One of QUALITIES.
        seed: Any whole number from 0.
        scales: radius * scale * kappa of the spheres, ascending; empty takes the rows of a table.
        radius: Factors on the scale per channel; equal ones make a table, others a check.
        elevation: Angle of the light from the picture's plane towards the camera, radians.
        all_views: Look from all sides in place of one, and put the pixels of equal N.L together:
            Cycles' random walk does not look the same from everywhere.
        method: The subsurface method, as Blender's node names it.
    """

    albedo: tuple[float, float, float]
    quality: str = DEFAULT_QUALITY
    seed: int = 0
    scales: tuple[float, ...] = ()
    radius: tuple[float, float, float] = (1.0, 1.0, 1.0)
    elevation: float = 0.0
    all_views: bool = False
    method: str = RANDOM_WALK

    def __post_init__(self) -> None:
        if not all(0.0 < value <= 1.0 for value in self.albedo):
            raise MeasurementError("Each channel of the colour must be above 0 and at most 1.")
        if not all(0.0 < value < 1e6 for value in self.radius):
            raise MeasurementError("Each channel of the radius must be a positive number.")
        if self.quality not in QUALITIES:
            raise MeasurementError(f"The quality must be one of {', '.join(QUALITIES)}.")
        if not 0 <= self.seed < 2**31:
            raise MeasurementError("The seed must be a whole number from 0 to 2147483647.")
        rising = all(b > a for a, b in zip(self.scales, self.scales[1:], strict=False))
        if self.scales and not (rising and self.scales[0] > 0.0 and self.scales[-1] < 1e6):
            raise MeasurementError("The scales must be positive and rise.")

    def complete(self) -> Request:
        """Fill in the rows of a table where no scales are given."""
        if self.scales:
            return self
        old = walk_method(self.method) == "RANDOM_WALK_LEGACY"
        first = FIRST_SCALE * (OLD_REACH if old else 1.0)
        rows = tuple(first * 2.0 ** (row / ROWS_PER_OCTAVE) for row in range(ROWS))
        return replace(self, scales=rows)

    def samples(self) -> int:
        """Paths through a pixel in a pass: more where the albedo is low and paths are short."""
        return round(QUALITIES[self.quality].samples * (2.0 - sum(self.albedo) / 3.0) ** 1.1)

    def orders(self) -> dict[str, Any]:
        """Pixels, directions of the light and passes from each."""
        quality = QUALITIES[self.quality]
        if not self.all_views:
            one = {"pixels": quality.pixels, "passes": quality.passes}
            return one | {"elevations": (self.elevation,)}
        across, down = quality.pixels
        side = max(round(math.sqrt(across * down)), 8)
        views = max(quality.passes // 2, 2)
        # Equal parts of the sphere of directions from which one may look.
        elevations = [math.asin((2 * view + 1) / views - 1.0) for view in range(views)]
        return {"pixels": (side, side), "passes": 2, "elevations": elevations}

    def key(self) -> str:
        """Hash of everything that decides the result."""
        quality = asdict(QUALITIES[self.quality])
        # Colours come in double precision from a command line and in single from a panel.
        albedo = [float(f"{part:.6g}") for part in self.albedo]
        request = asdict(self.complete()) | {"albedo": albedo}
        facts = [VERSION, bpy.app.version_string, request, quality]
        text = json.dumps(facts, sort_keys=True)
        return hashlib.blake2b(text.encode(), digest_size=12).hexdigest()


def cache_folder() -> Path:
    """Where measurements are kept: the extension's own folder, else Blender's data files.

    Raises:
        MeasurementError: No folder can be made.
    """
    package = (__package__ or "cdrf_addon.measuring").removesuffix(".measuring")
    try:
        # Refuses packages that were not installed as extensions.
        return Path(bpy.utils.extension_path_user(package, path="measured", create=True))
    except (ValueError, OSError):
        pass
    try:
        found = bpy.utils.user_resource("DATAFILES", path="cdrf_measured", create=True)
        folder = Path(found) if found else Path(tempfile.gettempdir()) / "cdrf_measured"
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise MeasurementError(
            f"No folder for measurements can be made: {error.strerror}. "
            "Check Blender's user folder."
        ) from error
    return folder


def cached(request: Request, folder: Path) -> SphereMeasurement | None:
    """Return an earlier measurement of the same request; a damaged file counts as none."""
    try:
        found = load(_file(request, folder))
    except MeasurementError:
        return None
    same = np.allclose(found.albedo, request.albedo, atol=1e-5) and np.array_equal(
        found.scales, request.complete().scales
    )
    return found if same else None


def _file(request: Request, folder: Path) -> Path:
    return folder / f"{request.key()}.npz"


def measure(request: Request, folder: Path) -> SphereMeasurement:
    """Measure, or take from the cache, and wait for it; see `measure_steps`."""
    return run_steps(measure_steps(request, folder))


def measure_steps(
    request: Request, folder: Path
) -> Generator[tuple[float, str], None, SphereMeasurement]:
    """Measure in a child process, or take from the cache.

    Args:
        request: What to measure.
        folder: The cache, made if it is not there; see `cache_folder`.

    Yields:
        Progress from 0 to 1 and what is being done, at least ten times a second.

    Raises:
        MeasurementError: The child failed, or the folder cannot be written.
    """
    request = request.complete()
    if (found := cached(request, folder)) is not None:
        return found
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _sweep(folder)
        with tempfile.TemporaryDirectory(dir=folder, prefix="run-") as place:
            yield from _render(request, Path(place))
            measurement = _read(request, Path(place) / "answer.npz")
    except OSError as error:
        raise MeasurementError(
            f"Spheres could not be measured in {folder}: {error.strerror}. Check that this folder "
            "can be written and that the disk is not full."
        ) from error
    save(_file(request, folder), measurement)
    return measurement


def write_order(request: Request, folder: Path) -> Path:
    """Write the worker's order, and return its path."""
    names = ("albedo", "scales", "radius", "seed", "method")
    order = {name: getattr(request, name) for name in names} | request.orders()
    order["samples"] = request.samples()
    order["answer"] = str(folder / "answer.npz")
    path = folder / "order.json"
    path.write_text(json.dumps(order), encoding="utf-8")
    return path


def _render(request: Request, folder: Path) -> Iterator[tuple[float, str]]:
    order = write_order(request, folder)
    if bpy.app.binary_path:
        head = [bpy.app.binary_path, "--background", "--factory-startup", "--python-exit-code", "1"]
        command = [*head, "--python", str(WORKER), "--", str(order)]
    else:
        command = [sys.executable, str(WORKER), str(order)]
    log = folder / "log.txt"
    told = (0.0, "Starting Blender for the path tracing")
    with _child(command, log) as child:
        ended = False
        while not ended:
            # Asked first, so that the last words of a child that was quick are heard too.
            ended = child.poll() is not None
            told = _progress(log) or told
            yield told
            if not ended:
                time.sleep(POLL_SECONDS)
    if child.returncode != 0 or not (folder / "answer.npz").exists():
        raise MeasurementError(
            f"Cycles could not render the spheres: {_reason(log, child.returncode)} Check that "
            "this Blender renders with Cycles on the CPU, and that there is memory and disk space."
        )


@contextmanager
def _child(command: list[str], log: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Run a command with its output in a file; end it when the block is left."""
    with log.open("wb") as output:
        child = subprocess.Popen(
            # The child reads this pipe, and ends when we do, however that comes.
            command,
            stdin=subprocess.PIPE,
            stdout=output,
            stderr=subprocess.STDOUT,
        )
        try:
            yield child
        finally:
            if child.poll() is None:
                child.kill()
            child.wait(KILL_SECONDS)
            if child.stdin is not None:
                child.stdin.close()


def _sweep(folder: Path) -> None:
    """Remove what runs that were killed have left."""
    for left in folder.glob("run-*"):
        try:
            if time.time() - left.stat().st_mtime > STALE_SECONDS:
                shutil.rmtree(left, ignore_errors=True)
        except OSError:
            continue  # another process was faster


def _lines(log: Path) -> list[str]:
    return log.read_text(encoding="utf-8", errors="replace").splitlines()


def _progress(log: Path) -> tuple[float, str] | None:
    for line in reversed(_lines(log)):
        words = line.split(maxsplit=2)
        if len(words) == 3 and words[0] == PROGRESS:
            return float(words[1]), words[2]
    return None


def _reason(log: Path, code: int) -> str:
    """Return the last line of a traceback, or that there was none."""
    lines = [line.strip() for line in _lines(log) if line.strip()]
    if code == 0 or not any(line.startswith("Traceback") for line in lines):
        return f"Blender ended early (exit code {code})."
    errors = [line for line in lines if "Error" in line.split(":")[0]]
    return f"{errors[-1] if errors else lines[-1]}."


def _read(request: Request, path: Path) -> SphereMeasurement:
    quality = QUALITIES[request.quality]
    with np.load(path, allow_pickle=False) as file:
        raw = {name: file[name] for name in file.files}
    numbers = bin_pixels(raw["cosine"])
    passes = request.orders()["passes"]
    pooled = pool(raw["cosine"], raw["total"], raw["square"], passes, numbers)
    return SphereMeasurement(
        np.array(request.albedo),
        np.array(request.scales),
        *(pooled.cosine, pooled.values, pooled.errors),
        samples=request.samples() * quality.passes,
        seed=request.seed,
        blender=str(raw["blender"]),
        method=request.method,
        elevation=request.elevation,
        all_views=request.all_views,
    )
