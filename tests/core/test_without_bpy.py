# SPDX-License-Identifier: GPL-3.0-or-later
"""The numerics run in a plain Python: nothing in cdrf_addon.core needs Blender."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

CHILD = """
import importlib, pkgutil, sys

BLENDER = ("bpy", "_bpy", "bpy_extras", "bpy_types", "bmesh", "mathutils", "gpu", "idprop")


class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in BLENDER:
            raise ImportError(f"{name} was asked for")
        return None


sys.meta_path.insert(0, Refuse())

import cdrf_addon.core

start = "cdrf_addon.core."
found = pkgutil.walk_packages(cdrf_addon.core.__path__, start)
names = [module.name.removeprefix(start) for module in found]
modules = {name: importlib.import_module(start + name) for name in names}
# Opening Blender must not wait for these: they are loaded when something is computed.
print("early:", sorted({"scipy", "igl"} & set(sys.modules)))

value = float(modules["reflectance.ring_model"].ring_reflectance(0.0, 0.3))
grid = [(x, y, -0.05 * (x * x + y * y)) for x in range(-3, 4) for y in range(-3, 4)]
faces = []
for corner in (7 * x + y for x in range(6) for y in range(6)):
    faces += [(corner, corner + 7, corner + 8), (corner, corner + 8, corner + 1)]
mesh = modules["curvature.tri_mesh"].TriMesh.from_arrays(grid, faces)
mean = modules["curvature.field"].principal_curvatures(mesh).mean[24]
print("blender:", sorted(set(BLENDER) & set(sys.modules)))
print("modules:", " ".join(sorted(names)))
print(f"reflectance: {value:.4f}")
print(f"mean: {mean:.4f}")
"""


@pytest.mark.smoke
def test_every_module_works_where_blender_is_not() -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", CHILD],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
        cwd=ROOT,
        env=environment,
    )
    assert done.returncode == 0, done.stderr
    told = dict(line.split(": ", 1) for line in done.stdout.splitlines())
    assert told["early"] == "[]"
    assert told["blender"] == "[]"
    assert {
        "errors",
        "curvature.field",
        "curvature.clean",
        "reflectance.lut",
        "reflectance.ring_model",
    } <= set(told["modules"].split())
    # The lobe's edges are more than 5 sigma away: what is left is exp(-sigma^2 / 2) cos(0).
    assert told["reflectance"] == "0.9560"
    # z = -c (x^2 + y^2) has k1 = k2 = 2 c = 0.1 at its top, and a quadric is fitted exactly.
    assert told["mean"] == "0.1000"
