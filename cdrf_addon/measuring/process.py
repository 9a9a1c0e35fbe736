# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure path-traced spheres in a Blender of their own, so that the artist's stays responsive.

`measure_steps` is a generator: it starts the child process, yields progress while the child
renders, and returns the measurement. Closing it cancels: the child ends, its files are removed.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path

import bpy
import numpy as np

from ..core.errors import MeasurementError
from ..core.measured.measurement import SphereMeasurement, bin_pixels, pool
from ..core.progress import run_steps
from .cache import cached, keep
from .request import QUALITIES, Request

WORKER = Path(__file__).resolve().with_name("worker.py")
PROGRESS = "CDRF-PROGRESS"
"""First word of a line of progress in the worker's output, which has its own copy."""
POLL_SECONDS = 0.05
KILL_SECONDS = 10.0
STALE_SECONDS = 24.0 * 3600.0


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
    keep(request, measurement, folder)
    return measurement


def write_order(request: Request, folder: Path) -> Path:
    """Write the worker's order as JSON; return its path."""
    names = ("albedo", "scales", "radius", "seed", "method")
    order = {name: getattr(request, name) for name in names} | asdict(request.views())
    order["samples"] = request.samples()
    order["answer"] = str(folder / "answer.npz")
    path = folder / "order.json"
    path.write_text(json.dumps(order), encoding="utf-8")
    return path


def _render(request: Request, folder: Path) -> Iterator[tuple[float, str]]:
    """Run the worker until it ends; yield its progress."""
    order = write_order(request, folder)
    if bpy.app.binary_path:
        head = [bpy.app.binary_path, "--background", "--factory-startup", "--python-exit-code", "1"]
        command = [*head, "--python", str(WORKER), "--", str(order)]
    else:
        command = [sys.executable, str(WORKER), str(order)]
    log = folder / "log.txt"
    progress = (0.0, "Starting Blender for the path tracing")
    with _child(command, log) as child:
        ended = False
        while not ended:
            # First the state, then the log: the last line of a quick child is read too.
            ended = child.poll() is not None
            progress = _progress(log) or progress
            yield progress
            if not ended:
                time.sleep(POLL_SECONDS)
    if child.returncode != 0 or not (folder / "answer.npz").exists():
        raise MeasurementError(
            f"Cycles could not render the spheres: {_reason(log, child.returncode)} Check that "
            "this Blender renders with Cycles on the CPU, and that there is memory and disk space."
        )


@contextmanager
def _child(command: list[str], log: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Run a command, its output in a file; end it when the block is left."""
    with log.open("wb") as output:
        child = subprocess.Popen(
            # The child reads this pipe, so it ends when this process does, for whatever reason.
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
    """Remove the folders of runs that were killed."""
    for left in folder.glob("run-*"):
        try:
            if time.time() - left.stat().st_mtime > STALE_SECONDS:
                shutil.rmtree(left, ignore_errors=True)
        except OSError:
            continue  # another process removed it first


def _lines(log: Path) -> list[str]:
    return log.read_text(encoding="utf-8", errors="replace").splitlines()


def _progress(log: Path) -> tuple[float, str] | None:
    """Return the last progress in the log; None if there is none yet."""
    for line in reversed(_lines(log)):
        words = line.split(maxsplit=2)
        if len(words) == 3 and words[0] == PROGRESS:
            return float(words[1]), words[2]
    return None


def _reason(log: Path, code: int) -> str:
    """Return the error of a traceback as a sentence, or the exit code if there is none."""
    lines = [line.strip() for line in _lines(log) if line.strip()]
    if code == 0 or not any(line.startswith("Traceback") for line in lines):
        return f"Blender ended early (exit code {code})."
    errors = [line for line in lines if "Error" in line.split(":")[0]]
    return f"{errors[-1] if errors else lines[-1]}."


def _read(request: Request, path: Path) -> SphereMeasurement:
    """Read the worker's sums and pool the pixels of equal N.L."""
    quality = QUALITIES[request.quality]
    with np.load(path, allow_pickle=False) as file:
        raw = {name: file[name] for name in file.files}
    numbers = bin_pixels(raw["cosine"])
    pooled = pool(raw["cosine"], raw["total"], raw["square"], request.views().passes, numbers)
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
