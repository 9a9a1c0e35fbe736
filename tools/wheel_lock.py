# SPDX-License-Identifier: GPL-3.0-or-later
"""Which wheels go into which extension zip: the targets, the lock file and the download.

Every zip serves one Python only. With wheels of several Pythons in one zip, Blender derives the
Pythons that it supports from the wheel names and counts an `abi3` wheel for none of them as soon
as another wheel names a minor version; a zip per Python leaves nothing to derive.
"""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
import tempfile
import tomllib
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LOCK_FILE = ROOT / "tools" / "wheels.lock.toml"
PINS_FILE = ROOT / "requirements" / "bundled.txt"
CACHE_DIR = ROOT / "wheels"


class BuildError(Exception):
    """A failure that one sentence explains; printed without a traceback."""


@dataclass(frozen=True)
class PythonRelease:
    """A Python that Blender ships, and the Blender versions that ship it."""

    version: str
    blender_min: str
    blender_max: str | None
    """The first Blender that no longer fits, as in the manifest; None while there is none."""


PYTHONS = {
    "cp311": PythonRelease("3.11", "4.5.0", "5.1.0"),
    "cp313": PythonRelease("3.13", "5.1.0", None),
}

# Platform tags of pip, best first. scipy has no wheel for macOS 11, so Apple silicon starts at 12.
PIP_PLATFORMS = {
    "linux-x64": ("manylinux_2_28_x86_64", "manylinux_2_27_x86_64", "manylinux2014_x86_64"),
    "windows-x64": ("win_amd64",),
    "macos-arm64": ("macosx_12_0_arm64",),
    "macos-x64": ("macosx_12_0_x86_64",),
}

# Blender left the Intel Mac with 5.0, so Python 3.13 never ran in a Blender there.
WITHOUT_BLENDER = frozenset({("cp313", "macos-x64")})


@dataclass(frozen=True)
class Target:
    """One zip: a Python tag and a platform as Blender names it."""

    python: str
    platform: str


@dataclass(frozen=True)
class Wheel:
    """One locked wheel of one target."""

    name: str
    version: str
    python: str
    platform: str
    file: str
    sha256: str

    @property
    def target(self) -> Target:
        """The zip that carries this wheel."""
        return Target(self.python, self.platform)


def all_targets() -> list[Target]:
    """List every zip that a full build makes, in the order of its output."""
    return [
        Target(python, platform)
        for python in PYTHONS
        for platform in PIP_PLATFORMS
        if (python, platform) not in WITHOUT_BLENDER
    ]


def read_pins(path: Path = PINS_FILE) -> dict[str, str]:
    """Read the `name==version` lines of the bundled packages."""
    lines = (line.strip() for line in path.read_text(encoding="utf-8").splitlines())
    return dict(line.split("==", 1) for line in lines if line and not line.startswith("#"))


def read_lock(path: Path = LOCK_FILE) -> list[Wheel]:
    """Read the locked wheels.

    Raises:
        BuildError: The lock is missing or damaged.
    """
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise BuildError(f"{path.name} is missing; run with --update-lock to write it.") from None
    except tomllib.TOMLDecodeError as error:
        raise BuildError(f"{path.name} is not valid TOML: {error}.") from None
    return [Wheel(**entry) for entry in table["wheel"]]


def write_lock(wheels: list[Wheel], path: Path = LOCK_FILE) -> None:
    """Write the lock, sorted so that differences stay small."""
    lines = ["# Written by tools/build_extension.py --update-lock; do not edit.\n"]
    for wheel in sorted(wheels, key=lambda w: (w.python, w.platform, w.name)):
        lines.append("\n[[wheel]]\n")
        # A JSON string of plain ASCII is also a TOML string.
        lines.extend(f"{key} = {json.dumps(value)}\n" for key, value in asdict(wheel).items())
    path.write_text("".join(lines), encoding="utf-8")


def lock_targets(targets: list[Target]) -> list[Wheel]:
    """Download the pinned packages for `targets`; return their wheels.

    Raises:
        BuildError: One cannot be downloaded.
    """
    wheels = []
    for target in targets:
        for name, version in read_pins().items():
            file = _download(name, version, target)
            sha256 = _sha256(file)
            wheels.append(Wheel(name, version, target.python, target.platform, file.name, sha256))
    return wheels


def fetch(wheel: Wheel) -> Path:
    """Return the cached file of `wheel`; download it if needed, and verify its checksum.

    Raises:
        BuildError: It cannot be downloaded, or is not the file that was locked.
    """
    cached = CACHE_DIR / wheel.file
    # A damaged file in the cache is downloaded again; only a fresh one that differs is an error.
    if cached.is_file() and _sha256(cached) == wheel.sha256:
        return cached
    file = _download(wheel.name, wheel.version, wheel.target)
    if file.name != wheel.file:
        raise BuildError(
            f"pip chose {file.name} where the lock names {wheel.file}; "
            "run with --update-lock if that is intended."
        )
    if (found := _sha256(file)) != wheel.sha256:
        file.unlink()
        raise BuildError(
            f"{wheel.file} has the SHA-256 {found} where the lock wants {wheel.sha256}; "
            "it was not used."
        )
    return file


def _sha256(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _download(name: str, version: str, target: Target) -> Path:
    """Let pip download one wheel, of any platform, into the cache."""
    CACHE_DIR.mkdir(exist_ok=True)
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check"]
    command += ["--no-deps", "--only-binary=:all:", "--implementation=cp"]
    command += [f"--python-version={PYTHONS[target.python].version}"]
    command += [f"--abi={target.python}", "--abi=abi3"]
    command += [f"--platform={tag}" for tag in PIP_PLATFORMS[target.platform]]
    # Inside the cache, so that the finished file is moved there in one step.
    with tempfile.TemporaryDirectory(dir=CACHE_DIR) as folder:
        run = subprocess.run(
            [*command, f"--dest={folder}", f"{name}=={version}"],
            capture_output=True,
            text=True,
            check=False,
        )
        files = list(Path(folder).glob("*.whl"))
        if run.returncode or len(files) != 1:
            raise BuildError(_explain_pip(run.stderr, f"{name} {version}", target))
        return files[0].replace(CACHE_DIR / files[0].name)


def _explain_pip(stderr: str, what: str, target: Target) -> str:
    """Turn pip's error output into a sentence that the reader can act on."""
    if "No module named pip" in stderr:
        return "This Python has no pip; run the build as ./dev build."
    wanted = f"{what} for {target.python} on {target.platform}"
    # pip reports an unreachable index as "no versions"; the retries before it tell them apart.
    if "Retrying" in stderr or "connection" in stderr.lower():
        return f"Could not download {wanted}: the package index cannot be reached."
    last = stderr.strip().splitlines()[-1] if stderr.strip() else "it printed no reason"
    return f"pip could not download {wanted}: {last}."
