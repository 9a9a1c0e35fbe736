# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension zip: what is in it, and its life in a clean Blender profile."""

import json
import os
import platform
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path
from typing import Any

import pytest
import wheel_lock

ROOT = Path(__file__).resolve().parents[2]
PYTHON = f"cp{sys.version_info.major}{sys.version_info.minor}"
PLATFORM = {
    ("Linux", "x86_64"): "linux-x64",
    ("Windows", "AMD64"): "windows-x64",
    ("Darwin", "arm64"): "macos-arm64",
    ("Darwin", "x86_64"): "macos-x64",
}[platform.system(), platform.machine()]

pytestmark = pytest.mark.smoke


def run(*command: object, **options) -> str:
    """Run a program and return its output; fail with its error."""
    done = subprocess.run(
        [str(part) for part in command],
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
        **options,
    )
    if done.returncode:
        pytest.fail((done.stderr or done.stdout).strip(), pytrace=False)
    return done.stdout


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Path:
    """The zip for this machine."""
    folder = tmp_path_factory.mktemp("dist")
    tool = ROOT / "tools" / "build_extension.py"
    run(sys.executable, tool, "--platform", PLATFORM, "--python", PYTHON, "--output-dir", folder)
    (built,) = folder.iterdir()
    return built


@pytest.fixture(scope="module")
def life(package, tmp_path_factory) -> dict[str, Any]:
    """Report of one Blender with a clean profile: install_cycle.py."""
    home = tmp_path_factory.mktemp("home")
    profile = home / "profile"
    profile.mkdir()
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    environment |= {
        "HOME": str(home),
        "BLENDER_USER_RESOURCES": str(profile),
        "XDG_CACHE_HOME": str(home / "cache"),
        "XDG_CONFIG_HOME": str(home / "config"),
        "XDG_DATA_HOME": str(home / "data"),
    }
    script = Path(__file__).with_name("install_cycle.py")
    output = run(sys.executable, "-P", script, package, profile, cwd=home, env=environment)
    report = json.loads(output.strip().splitlines()[-1])
    return {**report, "profile": profile.resolve()}


def test_zip_holds_what_ships_and_nothing_else(package):
    with zipfile.ZipFile(package) as archive:
        names = archive.namelist()
        manifest = tomllib.loads(archive.read("blender_manifest.toml").decode())
    tops = {name.split("/")[0] for name in names}
    assert {"__init__.py", "blender_manifest.toml", "cdrf_addon", "wheels", "LICENSE"} <= tops
    assert tops <= {
        *("__init__.py", "blender_manifest.toml", "cdrf_addon", "wheels", "LICENSE"),
        *("README.md", "node_groups"),
    }
    assert not [name for name in names if "__pycache__" in name or name.endswith(".pyc")]
    assert "node_groups/build.py" not in names
    locked = {
        f"wheels/{wheel.file}"
        for wheel in wheel_lock.read_lock()
        if (wheel.python, wheel.platform) == (PYTHON, PLATFORM)
    }
    assert {name for name in names if name.startswith("wheels/")} == locked
    assert {name.removeprefix("./") for name in manifest["wheels"]} == locked
    assert manifest["platforms"] == [PLATFORM]


def test_wheels_fit_this_python(package):
    """Blender takes the Pythons from the wheel names; see tools/wheel_lock.py on abi3."""
    with zipfile.ZipFile(package) as archive:
        wheels = [name for name in archive.namelist() if name.endswith(".whl")]
    assert {Path(name).name.split("-")[0] for name in wheels} == {"libigl", "scipy"}
    tags = {tuple(Path(name).name.split("-")[2:4]) for name in wheels}
    assert (PYTHON, PYTHON) in tags
    assert all(tag == (PYTHON, PYTHON) or tag[1] == "abi3" for tag in tags)


def test_blender_versions_meet_without_overlap():
    """Every Blender from 4.5 on finds exactly one zip."""
    older, newer = wheel_lock.PYTHONS["cp311"], wheel_lock.PYTHONS["cp313"]
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    assert older.blender_min == manifest["blender_version_min"]
    assert older.blender_max == newer.blender_min
    assert newer.blender_max is None


def test_lock_and_manifest_agree():
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert manifest["version"] == project["version"]
    assert "wheels" not in manifest
    lock = wheel_lock.read_lock()
    assert set(manifest["platforms"]) == {wheel.platform for wheel in lock}
    pins = wheel_lock.read_pins()
    expected = {
        (target, name, version)
        for target in wheel_lock.all_targets()
        for name, version in pins.items()
    }
    assert {(wheel.target, wheel.name, wheel.version) for wheel in lock} == expected
    assert len(lock) == len(expected)


def test_installs_and_runs_on_its_own_wheels(life):
    assert life["enabled"]
    site_packages = life["profile"] / "extensions" / ".local"
    for name, file in life["bundled"].items():
        assert site_packages in Path(file).parents, f"{name} came from {file}"


def test_main_job_of_the_installed_extension(life):
    assert life["job"]["result"] == ["FINISHED"]
    assert life["job"]["attribute"] == ["FLOAT_COLOR", "POINT"]
    assert any(name.startswith("CDRF") for name in life["job"]["groups"])


def test_measured_tables_are_kept_in_the_folder_of_the_extension(life):
    own = life["profile"] / "extensions" / ".user" / "user_default" / "cdrf"
    assert Path(life["measured"]).resolve().parent == own / "measured"


def test_commands_run_as_files_use_the_enabled_extension(life):
    package = "bl_ext.user_default.cdrf.cdrf_addon.command"
    assert life["doors"]["packages"] == [f"{package}.batch_run", f"{package}.fit_run"]
    assert life["doors"]["copies"] == []
    assert life["doors"]["code"] == 1
    assert "does not exist" in life["doors"]["summary"]["scenes"][0]["error"]


def test_disabling_leaves_nothing_behind(life):
    assert not life["enabled after disable"]
    assert life["enabled again"]
    assert life["left by disable"] == []
    assert life["timers"] == []


def test_uninstalling_leaves_nothing_behind(life):
    assert life["left by uninstall"] == []
