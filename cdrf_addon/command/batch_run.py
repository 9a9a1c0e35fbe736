# SPDX-License-Identifier: GPL-3.0-or-later
"""The batch renderer: many inputs, each in a process of its own where there are several.

A crash of Blender therefore costs one input. The same command goes on where it was stopped.
"""

from __future__ import annotations

import atexit
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import bpy

from .. import register, unregister
from ..core.errors import ParameterError
from .batch_job import SceneJob, unique_stems
from .batch_journal import read_done
from .batch_options import BatchOptions, parse_options
from .batch_pictures import render_scene
from .batch_summary import SceneRecord, write_summary
from .console import own_arguments, print_line

DOOR = Path(__file__).resolve().parents[1] / "batch_render.py"
WORKER = "--worker"
"""First argument of the process of one input; its order and answer follow, both JSON files."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the batch; return the exit code: 0, 1 if a scene failed, 2 for a wrong command line."""
    arguments = own_arguments(sys.argv) if argv is None else list(argv)
    if arguments[:1] == [WORKER]:
        return work(Path(arguments[1]), Path(arguments[2]))
    try:
        options = parse_options(arguments)
        _make_folder(options.output)
    except ParameterError as error:
        print_line(f"batch_render: {error}")
        return 2
    except SystemExit as stop:  # argparse has printed why
        return int(stop.code or 0)
    return run(options)


def _make_folder(output: Path) -> None:
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ParameterError(f"{output} cannot be made a folder: {error.strerror}.") from error


def run(options: BatchOptions) -> int:
    """Render all inputs; return the exit code: 0, 1 if a scene failed, 130 after Ctrl-C."""
    ensure_registered()
    start = time.perf_counter()
    summary = options.output / "summary.json"
    done = read_done(options.output)
    scenes: list[SceneRecord] = []
    stems = unique_stems(options.inputs)
    for number, (path, stem) in enumerate(zip(options.inputs, stems, strict=True), 1):
        print_line(f"({number}/{len(stems)}) {path}")
        job = SceneJob(path, stem, options, done)
        try:
            record = render_scene(job) if len(stems) == 1 else run_in_process(job)
        except KeyboardInterrupt:
            scenes.append(SceneRecord(str(path), "stopped"))
            write_summary(summary, scenes, time.perf_counter() - start)
            print_line("Stopped. The same command goes on from here.")
            return 130
        scenes.append(record)
        _print_record(record)
        write_summary(summary, scenes, time.perf_counter() - start)
    _print_result(scenes, summary)
    return 1 if any(scene.state == "failed" for scene in scenes) else 0


def _print_record(record: SceneRecord) -> None:
    for line in record.warnings:
        print_line(f"  note: {line}")
    if record.error:
        print_line(f"  FAILED: {record.error}")
    for name, seconds in record.seconds.items():
        print_line(f"  {name:<20} {seconds:8.2f} s")


def _print_result(scenes: Sequence[SceneRecord], summary: Path) -> None:
    failed = sum(scene.state == "failed" for scene in scenes)
    images = [image for scene in scenes for image in scene.images]
    print_line(
        f"{len(images)} picture(s), {failed} of {len(scenes)} scene(s) failed; see {summary}"
    )
    for image in images:
        if image.side_by_side is not None:
            print_line(f"Lambert | CDRF: {image.side_by_side}")


def run_in_process(job: SceneJob) -> SceneRecord:
    """Render one input in a Blender of its own; a crash becomes a failed record."""
    with tempfile.TemporaryDirectory() as folder:
        order, answer = Path(folder) / "order.json", Path(folder) / "answer.json"
        order.write_text(json.dumps(job.as_json()))
        if bpy.app.binary_path:
            head = [bpy.app.binary_path, "--background", "--python", str(DOOR), "--"]
        else:
            head = [sys.executable, str(DOOR)]
        command = [*head, WORKER, str(order), str(answer)]
        code = subprocess.run(command, check=False).returncode
        try:
            return SceneRecord.from_json(json.loads(answer.read_text()))
        except (OSError, ValueError, TypeError, KeyError):
            error = f"Blender ended early (exit code {code}) on {job.path.name}."
            return SceneRecord(str(job.path), "failed", error)


def work(order: Path, answer: Path) -> int:
    """Be the process of one input: read its order, render, and write its record."""
    ensure_registered()
    record = render_scene(SceneJob.from_json(order.read_text()))
    answer.write_text(json.dumps(record.as_json()))
    return 0


def ensure_registered() -> None:
    """Register the extension unless Blender has it enabled already."""
    if hasattr(bpy.types.Material, "cdrf"):
        return
    register()
    if not bpy.app.binary_path:
        # bpy 4.5 as a module never returns from its exit while classes are registered.
        atexit.register(unregister)
