# SPDX-License-Identifier: GPL-3.0-or-later
"""Build the extension zips, one per platform and Python, with Blender's own builder.

The builder comes from the installed `bpy` wheel, so no Blender is needed:

    ./dev build [--platform linux-x64] [--python cp313] [--output-dir dist]
    ./dev build --update-lock
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wheel_lock import (
    PIP_PLATFORMS,
    PYTHONS,
    ROOT,
    BuildError,
    Target,
    Wheel,
    all_targets,
    fetch,
    lock_targets,
    read_lock,
    write_lock,
)

MANIFEST = "blender_manifest.toml"
BUILDER = "*/scripts/addons_core/bl_pkg/cli/blender_ext.py"


@dataclass(frozen=True)
class Built:
    """A finished zip: a row of the table that is printed at the end."""

    path: Path
    wheels: int
    seconds: float


def find_builder() -> Path:
    """Find Blender's extension builder inside the installed bpy wheel, without importing bpy.

    Raises:
        BuildError: There is none.
    """
    spec = importlib.util.find_spec("bpy")
    for folder in (spec and spec.submodule_search_locations) or ():
        for builder in Path(folder).glob(BUILDER):
            return builder
    raise BuildError("This Python has no bpy wheel with the builder; run the build as ./dev build.")


def target_manifest(
    manifest: dict[str, Any], target: Target, wheels: Sequence[Wheel]
) -> dict[str, Any]:
    """Narrow the authors' manifest to one zip: its platform, Blender versions and wheels."""
    release = PYTHONS[target.python]
    narrowed = {
        **manifest,
        "blender_version_min": release.blender_min,
        "platforms": [target.platform],
        "wheels": [f"./wheels/{wheel.file}" for wheel in wheels],
    }
    if release.blender_max:
        narrowed["blender_version_max"] = release.blender_max
    return narrowed


def manifest_text(manifest: dict[str, Any]) -> str:
    """Return a manifest as TOML; it holds strings, lists of strings and tables of those."""
    tables = {key: value for key, value in manifest.items() if isinstance(value, dict)}
    lines = [_toml_line(key, value) for key, value in manifest.items() if key not in tables]
    for name, table in tables.items():
        lines += ["", f"[{name}]", *(_toml_line(key, value) for key, value in table.items())]
    return "\n".join(lines) + "\n"


def _toml_line(key: str, value: str | list[str]) -> str:
    # JSON strings and lists of them are TOML too, as long as characters are not escaped in pairs.
    return f"{key} = {json.dumps(value, ensure_ascii=False)}"


def project_files() -> list[Path]:
    """List the files that git tracks or would track, so that caches and results never ship.

    Raises:
        BuildError: Git is missing or cannot list them.
    """
    # The checkout may belong to another user (a container, CI); reading it is safe all the same.
    command = ["git", "-c", f"safe.directory={ROOT}", "-C", str(ROOT), "ls-files", "-z"]
    command += ["--cached", "--others", "--exclude-standard"]
    try:
        listing = subprocess.run(command, capture_output=True, check=True).stdout
    except FileNotFoundError:
        raise BuildError("git is needed to list the files of the extension; install it.") from None
    except subprocess.CalledProcessError as error:
        reason = error.stderr.decode(errors="replace").strip()
        raise BuildError(f"git could not list the files of the checkout: {reason}") from None
    files = (Path(os.fsdecode(name)) for name in listing.split(b"\0") if name)
    return [file for file in files if (ROOT / file).is_file()]  # a deleted file is still listed


def stage(folder: Path, files: Sequence[Path], manifest: str, wheels: Sequence[Path]) -> None:
    """Copy to `folder` what the builder packs.

    Args:
        folder: An empty folder.
        files: Files of the checkout, relative to it.
        manifest: Text of the manifest.
        wheels: The wheels to bundle.
    """
    for file in files:
        copy = folder / file
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / file, copy)
    (folder / MANIFEST).write_text(manifest, encoding="utf-8")
    (folder / "wheels").mkdir(exist_ok=True)
    for wheel in wheels:
        shutil.copy2(wheel, folder / "wheels")


def run_builder(builder: Path, *arguments: str) -> None:
    """Run one command of Blender's builder.

    Raises:
        BuildError: It failed; the error quotes its output.
    """
    command = [sys.executable, str(builder), *arguments]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    if run.returncode:
        reason = " ".join((run.stdout + run.stderr).split())
        raise BuildError(f"Blender's builder refused to {arguments[0]}: {reason}")


def build(target: Target, wheels: Sequence[Wheel], builder: Path, output_dir: Path) -> Built:
    """Build and validate the zip of one target.

    Args:
        target: Python and platform.
        wheels: The locked wheels of that target.
        builder: Blender's extension builder.
        output_dir: Folder for the zip, made if it is not there.

    Raises:
        BuildError: A wheel cannot be downloaded, or the builder refuses.
    """
    start = time.perf_counter()
    manifest = tomllib.loads((ROOT / MANIFEST).read_text(encoding="utf-8"))
    text = manifest_text(target_manifest(manifest, target, wheels))
    name = f"{manifest['id']}-{manifest['version']}-{target.python}-{target.platform}.zip"
    output = output_dir.resolve() / name
    output.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="cdrf-build-") as folder:
        stage(Path(folder), project_files(), text, [fetch(wheel) for wheel in wheels])
        run_builder(builder, "build", "--source-dir", folder, "--output-filepath", str(output))
    run_builder(builder, "validate", str(output))
    return Built(output, len(wheels), time.perf_counter() - start)


def print_table(zips: Sequence[Built]) -> None:
    """Print the zips as a table."""
    width = max(len(built.path.name) for built in zips)
    print(f"{'zip':<{width}}  {'MB':>6}  wheels  seconds")
    for built in zips:
        megabytes = built.path.stat().st_size / 1e6
        print(
            f"{built.path.name:<{width}}  {megabytes:6.1f}  {built.wheels:6}  {built.seconds:7.1f}"
        )


def update_lock(targets: Sequence[Target]) -> None:
    """Lock the pinned wheels of `targets` anew; keep the lock of the others."""
    kept = []
    if len(targets) < len(all_targets()):
        kept = [wheel for wheel in read_lock() if wheel.target not in targets]
    write_lock([*kept, *lock_targets(list(targets))])


def parse_arguments(arguments: Sequence[str] | None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(prog="build_extension", description=__doc__.split("\n")[0])
    parser.add_argument("--platform", choices=PIP_PLATFORMS, help="build for this platform only")
    parser.add_argument("--python", choices=PYTHONS, help="build for this Python only")
    parser.add_argument("--output-dir", type=Path, default=ROOT / "dist", help="default: dist")
    parser.add_argument(
        "--update-lock", action="store_true", help="lock the wheels of the pins, build nothing"
    )
    return parser.parse_args(arguments)


def selected_targets(options: argparse.Namespace) -> list[Target]:
    """Return the targets that --platform and --python leave.

    Raises:
        BuildError: None is left.
    """
    targets = [
        target
        for target in all_targets()
        if options.platform in (None, target.platform) and options.python in (None, target.python)
    ]
    if not targets:
        raise BuildError(f"There is no Blender with {options.python} on {options.platform}.")
    return targets


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    options = parse_arguments(arguments)
    try:
        targets = selected_targets(options)
        if options.update_lock:
            update_lock(targets)
            return 0
        builder = find_builder()
        lock = read_lock()
        zips = []
        for target in targets:
            wheels = [wheel for wheel in lock if wheel.target == target]
            zips.append(build(target, wheels, builder, options.output_dir))
    except BuildError as error:
        print(f"build_extension: {error}", file=sys.stderr)
        return 1
    print_table(zips)
    return 0


if __name__ == "__main__":
    sys.exit(main())
