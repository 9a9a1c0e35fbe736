# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that crash, hang or silently zero libigl, each in a process of its own.

Run as a script with the name of a case, this file is that process: it computes the curvature and
prints what came out.
"""

import json
import math
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike

from cdrf_addon.core.curvature.field import principal_curvatures
from cdrf_addon.core.curvature.summary import summarise
from cdrf_addon.core.curvature.tri_mesh import TriMesh
from cdrf_addon.core.errors import CdrfError

pytestmark = pytest.mark.smoke

ROOT = Path(__file__).resolve().parents[2]
# Most cases take half a second, nearly all of it to start Python and load scipy.
SECONDS = 20.0
# Where most of the mesh is a good unit sphere of 32 x 16: the median kappa is high by 3 % there.
SPHERE = (0.97, 1.06)

Arrays = tuple[ArrayLike, ArrayLike]
CASES: dict[str, tuple[Callable[[], Arrays], str | tuple[float, float]]] = {}


def case(expected: str | tuple[float, float]) -> Callable[[Callable[[], Arrays]], None]:
    """Register a case: the words of its refusal, or the limits of the median of kappa."""

    def register(make: Callable[[], Arrays]) -> None:
        CASES[make.__name__] = (make, expected)

    return register


# --- pieces -------------------------------------------------------------------------------------


def sheet(rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """A grid in the plane z = 0 and its triangles, two to a cell."""
    x, y = np.indices((rows, columns)).reshape(2, -1).astype(np.float64)
    a = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    b, c, d = a + columns, a + columns + 1, a + 1
    faces = np.concatenate((np.stack((a, b, c), 1), np.stack((a, c, d), 1)))
    return np.stack((x, y, 0.0 * x), 1), faces


def ball() -> tuple[np.ndarray, np.ndarray]:
    """A unit sphere, rolled up from a sheet: its seam and poles are welded by hand."""
    flat, faces = sheet(17, 33)
    polar, around = flat[:, 0] * math.pi / 16.0, flat[:, 1] * math.pi / 16.0
    out = np.sin(polar)
    vertices = np.stack((out * np.cos(around), out * np.sin(around), np.cos(polar)), 1)
    name = np.arange(17 * 33).reshape(17, 33)
    name[:, 32] = name[:, 0]
    name[0], name[16] = name[0, 0], name[16, 0]
    faces = name.ravel()[faces]
    alive = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    used, compact = np.unique(faces[alive], return_inverse=True)
    return vertices[used], compact.reshape(-1, 3)


def before(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Put a piece before a ball, so that libigl meets it first."""
    good, sides = ball()
    return np.vstack((vertices, good)), np.vstack((faces, sides + len(vertices)))


def with_first(position: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """A ball whose first vertex is somewhere else."""
    vertices, faces = ball()
    vertices[0] = position
    return vertices, faces


# --- nothing to work on -------------------------------------------------------------------------


@case("no vertices")
def empty() -> Arrays:
    return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)


@case("no faces")
def vertices_without_faces() -> Arrays:
    return ball()[0], np.zeros((0, 3), dtype=np.int64)


@case("nowhere (NaN)")
def all_nan() -> Arrays:
    vertices, faces = ball()
    return vertices * math.nan, faces


@case("shrink to one point")
def all_points_equal() -> Arrays:
    vertices, faces = ball()
    return 0.0 * vertices + 0.1, faces


@case("no area")
def collinear() -> Arrays:
    vertices, faces = ball()
    return vertices[:, :1] * (1.0, 2.0, 3.0), faces


@case("shrink to points")
def only_faces_of_one_vertex() -> Arrays:
    vertices, _ = ball()
    return vertices, np.repeat(np.arange(len(vertices)), 3).reshape(-1, 3)


# --- numbers ------------------------------------------------------------------------------------


@case(SPHERE)
def nan_first() -> Arrays:
    return with_first((math.nan, 0.0, 0.0))


@case(SPHERE)
def infinity_first() -> Arrays:
    return with_first((0.0, -math.inf, math.inf))


@case(SPHERE)
def one_vertex_at_1e200_first() -> Arrays:
    return with_first((1e200, 1e200, -1e200))


@case(SPHERE)
def one_vertex_at_1e300() -> Arrays:
    vertices, faces = ball()
    vertices[200] = 1e300
    return vertices, faces


@case((SPHERE[0] * 1e-100, SPHERE[1] * 1e-100))
def scale_1e100() -> Arrays:
    vertices, faces = ball()
    return vertices * 1e100, faces


@case((SPHERE[0] * 1e-300, SPHERE[1] * 1e-300))
def scale_1e300() -> Arrays:
    vertices, faces = ball()
    return vertices * 1e300, faces


@case((SPHERE[0] * 1e100, SPHERE[1] * 1e100))
def scale_1e_100() -> Arrays:
    vertices, faces = ball()
    return vertices * 1e-100, faces


@case((SPHERE[0] * 1e300, SPHERE[1] * 1e300))
def scale_1e_300() -> Arrays:
    vertices, faces = ball()
    return vertices * 1e-300, faces


@case("outside what numbers can hold")
def subnormal_scale() -> Arrays:
    vertices, faces = ball()
    return vertices * 1e-310, faces


# --- shapes and indices -------------------------------------------------------------------------


@case("does not exist")
def index_equals_the_number_of_vertices() -> Arrays:
    vertices, faces = ball()
    faces[7, 1] = len(vertices)
    return vertices, faces


@case("does not exist")
def index_beyond_32_bits() -> Arrays:
    vertices, faces = ball()
    faces[0, 0] = 2**32
    return vertices, faces


@case("does not exist")
def index_negative() -> Arrays:
    vertices, faces = ball()
    faces[-1, 2] = -1
    return vertices, faces


@case("shape")
def faces_of_two() -> Arrays:
    vertices, faces = ball()
    return vertices, faces[:, :2]


@case("shape")
def quads() -> Arrays:
    vertices, _ = sheet(5, 5)
    return vertices, [(0, 5, 6, 1), (1, 6, 7, 2)]


@case("shape")
def vertices_in_the_plane() -> Arrays:
    vertices, faces = ball()
    return vertices[:, :2], faces


@case("shape")
def vertices_transposed() -> Arrays:
    vertices, faces = ball()
    return vertices.T, faces


# --- surfaces -----------------------------------------------------------------------------------


@case(SPHERE)
def zero_area_patch_first() -> Arrays:
    vertices, faces = sheet(6, 6)
    return before(vertices * (1.0, 0.0, 0.0), faces)


# Most of it is a flat sheet with two sides.
@case((0.0, 0.01))
def opposite_sheets_first() -> Arrays:
    # The same vertices, wound the other way and cut along the other diagonal.
    vertices, faces = sheet(30, 30)
    a, b, c, d = (
        faces[: 29 * 29, 0],
        faces[: 29 * 29, 1],
        faces[: 29 * 29, 2],
        faces[29 * 29 :, 2],
    )
    back = np.concatenate((np.stack((a, d, b), 1), np.stack((d, c, b), 1)))
    return before(vertices, np.vstack((faces, back)))


@case(SPHERE)
def collapsed_ring_first() -> Arrays:
    vertices, faces = sheet(5, 5)
    inner = np.array((6, 7, 8, 11, 12, 13, 16, 17, 18))
    vertices[inner] = vertices[12]
    return before(vertices, faces)


@case((0.5, 0.7))
def fan_of_20000() -> Arrays:
    around = np.arange(20_000) * 2.0 * math.pi / 20_000
    rim = np.stack((np.cos(around), np.sin(around), np.zeros(20_000)), 1)
    here = np.arange(20_000)
    faces = np.stack((np.zeros_like(here), here + 1, (here + 1) % 20_000 + 1), 1)
    return np.vstack(((0.0, 0.0, 1.0), rim)), faces


@case(SPHERE)
def duplicated_reversed_faces() -> Arrays:
    vertices, faces = ball()
    return vertices, np.vstack((faces, faces[:, ::-1]))


@case(SPHERE)
def unwelded() -> Arrays:
    vertices, faces = ball()
    return vertices[faces.ravel()], np.arange(faces.size).reshape(-1, 3)


@case(SPHERE)
def half_flipped() -> Arrays:
    vertices, faces = ball()
    turned = np.arange(len(faces))[:, None] % 2 == 0
    return vertices, np.where(turned, faces[:, ::-1], faces)


@case((0.3, 1.0))
def moebius_strip() -> Arrays:
    flat, faces = sheet(61, 8)
    u, v = flat[:, 0] * math.pi / 30.0, (flat[:, 1] - 3.5) / 12.0
    out = 1.0 + v * np.cos(u / 2.0)
    name = np.arange(61 * 8)
    name[60 * 8 :] = np.arange(8)[::-1]
    vertices = np.stack((out * np.cos(u), out * np.sin(u), v * np.sin(u / 2.0)), 1)
    return vertices[: 60 * 8], name[faces]


@case(SPHERE)
def isolated_vertices() -> Arrays:
    vertices, faces = ball()
    loose = np.full((5, 3), 3.0)
    return np.vstack((loose, vertices, loose + 1.0)), faces + 5


# --- the process and its judge ------------------------------------------------------------------


def work(name: str) -> None:
    """Compute one case and print the outcome as JSON."""
    vertices, faces = CASES[name][0]()
    told: dict[str, object] = {}
    try:
        mesh = TriMesh.from_arrays(vertices, faces)
        field = principal_curvatures(mesh)
        values = np.stack((field.kappa, field.k1, field.k2, field.mean))
        told["finite"] = bool(np.isfinite(values).all())
        told["whole"] = values.shape == (4, len(mesh.vertices))
        told["median"] = summarise(mesh, field).median
        told["sentences"] = field.sentences()
    except CdrfError as refusal:
        told["refusal"] = str(refusal)
    print(json.dumps(told))


@pytest.mark.parametrize("name", list(CASES))
def test_no_crash_no_hang_no_nonsense(name: str, record_property) -> None:
    done = subprocess.run(
        # A warning on the console is what a programmer should see, not an artist.
        [sys.executable, "-X", "faulthandler", "-W", "error", __file__, name],
        capture_output=True,
        text=True,
        check=False,
        timeout=SECONDS,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    record_property("outcome", told.get("refusal") or f"median κ {told['median']:.3g}")
    expected = CASES[name][1]
    if isinstance(expected, str):
        text = told["refusal"]
        assert expected in text
        assert text[0].isupper()
        assert text.endswith(".")
    else:
        assert told.get("refusal") is None
        assert told["finite"]
        assert told["whole"]
        low, high = expected
        assert low <= told["median"] <= high
        assert all(line.endswith(".") for line in told["sentences"])


if __name__ == "__main__":
    work(sys.argv[1])
