# SPDX-License-Identifier: GPL-3.0-or-later
"""Error against run time of the curvature estimators: writes results/estimators.md, .json and .svg.

    ./dev python tests/benchmarks/estimators.py             everything: hours on two cores
    ./dev python tests/benchmarks/estimators.py --missing   goes on where an earlier run stopped
    ./dev python tests/benchmarks/estimators.py --page      the page and figures, from the JSON file
    ./dev python tests/benchmarks/estimators.py --quick     a look, into output/estimators/

Every measurement is a process of its own, forked from one that has loaded the libraries and no
mesh, so that its peak memory above the start is the estimator's. Linux only, therefore. Matplotlib
comes with the tools for testing, which `./dev lint` installs.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import multiprocessing
import os
import platform
import resource
import statistics
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, field, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

# One thread, so that CPU seconds are seconds; numpy reads this when it is loaded.
os.environ["OPENBLAS_NUM_THREADS"] = "1"
ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "support")]

import matplotlib as mpl  # noqa: E402  (after the setting above)
import numpy as np  # noqa: E402  (the same)
from matplotlib.figure import Figure  # noqa: E402
from numpy.typing import ArrayLike  # noqa: E402
from surfaces import ALL_SURFACES, BORDER_ROWS, noisy, torus  # noqa: E402

from cdrf_addon.core.curvature.estimators import DEFAULT_METHOD, DEFAULT_RADIUS, METHODS  # noqa: E402
from cdrf_addon.core.curvature.field import CurvatureField, principal_curvatures  # noqa: E402
from cdrf_addon.core.curvature.mesh import TriMesh  # noqa: E402

SEED = 19760102
SIZES = (1_000, 10_000, 100_000, 1_000_000)
NOISES = (0.0, 0.001, 0.01)
RADII = (2, 3, 5)
SCALING_SIZES = (10_000, 20_000, 50_000, 100_000, 200_000, 500_000, 1_000_000, 2_000_000)
SCALING_SURFACE = "jittered torus"
LARGE = 200_000
"""From here on the fixed costs of a run no longer count."""
CLICK = "Make Translucent"
# A run that takes longer than this hangs.
LIMIT = 3_600.0
# Runs go on, three at the most, until this many seconds are spent; the quickest counts.
PATIENCE = 0.3
SCALING_PATIENCE = 3.0
QUICK_PATIENCE = 0.1
# Errors below this are rounding: an estimator is exact on that surface.
EXACT = 1e-7
PARTS = ("inner", "border")
QUANTITIES = ("k1", "k2", "mean", "kappa")

Table = tuple[list[str], list[list[str]]]


@dataclass(frozen=True)
class Family:
    """Surfaces whose errors are told together."""

    title: str
    surfaces: tuple[str, ...]
    part: str = "inner"


OPEN = ("cylinder", "cone", "saddle", "catenoid", "sine field")
FAMILIES = {
    # Spheres are apart: normals weighted after Max (1999) are exact there and nowhere else.
    "irregular": Family(
        "Irregular meshes", ("jittered torus", "irregular ellipsoid", "jittered sine field")
    ),
    "spheres": Family("Irregular spheres", ("irregular sphere", "jittered sphere")),
    "regular": Family("Regular closed meshes", ("ico-sphere", "torus")),
    "poles": Family("The UV sphere and its poles", ("UV sphere",)),
    "open": Family("Regular meshes with a boundary, away from it", OPEN),
    "border": Family(
        f"The {BORDER_ROWS} rows of vertices next to a boundary",
        (*OPEN, "jittered sine field"),
        "border",
    ),
}


@dataclass(frozen=True)
class Row:
    """One measurement; errors are parts of the surface's RMS curvedness."""

    surface: str
    size: int
    """Vertices wanted; a surface has about as many."""
    noise: float
    """Standard deviation of the positions along the normal, in mean edges."""
    method: str
    rings: int | None
    vertices: int = 0
    seconds: float = math.nan
    """CPU seconds, of all threads."""
    wall: float = math.nan
    megabytes: float = math.nan
    """Peak above what the process held with the mesh loaded."""
    filled: int = 0
    code: str = ""
    """Fingerprint of the sources measured."""
    failure: str = ""
    errors: dict[str, float] = field(default_factory=dict)
    """Keys such as "inner kappa rms" and "border k1 worst"."""

    @property
    def key(self) -> tuple[Any, ...]:
        return self.surface, self.size, self.noise, self.method, self.rings


Config = tuple[str, int | None]
"""A method and, if it takes one, the radius of its fit in rings."""


def configurations(radii: Sequence[int] = RADII) -> list[Config]:
    """List every estimator with every radius it is measured at."""
    return [
        (key, rings)
        for key, method in METHODS.items()
        for rings in (radii if method.takes_radius else (None,))
    ]


def name_of(config: Config) -> str:
    """Name an estimator for the page."""
    method, rings = config
    label = METHODS[method].label if method in METHODS else method
    return label if rings is None else f"{label} {rings}"


def estimate(mesh: TriMesh, config: Config) -> CurvatureField:
    """Run an estimator."""
    method, rings = config
    if rings is None:
        return principal_curvatures(mesh, method=method)
    return principal_curvatures(mesh, method=method, radius=rings)


# --- processes ----------------------------------------------------------------------------------

FORK = multiprocessing.get_context("fork")


class ChildFailedError(RuntimeError):
    """A measurement crashed, raised (its traceback is on the terminal) or hung."""


def in_child(call: Callable[..., Any], *arguments: Any) -> Any:
    """Run a call in a process of its own.

    Raises:
        ChildFailedError: It sent no result.
    """
    receiver, sender = FORK.Pipe(duplex=False)

    def run() -> None:
        sender.send(call(*arguments))

    child = FORK.Process(target=run)
    child.start()
    sender.close()
    try:
        if not receiver.poll(LIMIT):
            raise ChildFailedError(f"no result after {LIMIT:.0f} s")
        return receiver.recv()
    except EOFError:
        child.join()
        raise ChildFailedError(f"the process ended with code {child.exitcode}") from None
    finally:
        child.kill()
        child.join()


def peak_megabytes() -> float:
    """Most memory this process has held. A fork starts anew, from what it shares."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def timed(call: Callable[[], Any], patience: float) -> tuple[Any, dict[str, float]]:
    """Run a call and measure it; the memory is that of the first run."""
    before = peak_megabytes()
    spent: list[tuple[float, float]] = []
    while not spent or (sum(wall for _, wall in spent) < patience and len(spent) < 3):
        cpu, wall = time.process_time(), time.perf_counter()
        result = call()
        spent.append((time.process_time() - cpu, time.perf_counter() - wall))
        if len(spent) == 1:
            megabytes = peak_megabytes() - before
    seconds, wall = min(spent)
    return result, {"seconds": seconds, "wall": wall, "megabytes": megabytes}


def write_meshes(folder: Path, name: str, size: int, noises: Sequence[float]) -> dict[str, int]:
    """Make a surface and its noisy copies, as files that a measurement loads without waste."""
    surface = ALL_SURFACES[name](size)
    for noise in noises:
        # The seed follows from the noise, so that a run of some noises makes the same meshes.
        generator = np.random.default_rng((SEED, round(noise * 1e9)))
        moved = noisy(surface, noise, generator) if noise else surface
        np.save(folder / f"vertices {noise}.npy", moved.vertices)
    np.save(folder / "triangles.npy", surface.triangles)
    np.save(folder / "exact.npy", np.stack((surface.k1, surface.k2)))
    np.save(folder / "inner.npy", surface.inner)
    a, b, c = (surface.vertices[surface.triangles[:, corner]] for corner in range(3))
    upright = (np.cross(b - a, c - a) * surface.normals[surface.triangles[:, 0]]).sum(axis=1)
    return {
        "vertices": len(surface.vertices),
        "border": int((~surface.inner).sum()),
        "inverted": int((upright <= 0.0).sum()),
    }


def load_mesh(folder: Path, noise: float) -> TriMesh:
    """Load a mesh that `write_meshes` wrote."""
    return TriMesh.from_arrays(
        np.load(folder / f"vertices {noise}.npy"), np.load(folder / "triangles.npy")
    )


def measure(folder: Path, noise: float, config: Config, patience: float) -> dict[str, Any]:
    """Run one estimator on one mesh, and judge it; the exact values are loaded afterwards."""
    mesh = load_mesh(folder, noise)
    found, cost = timed(lambda: estimate(mesh, config), patience)
    k1, k2 = np.load(folder / "exact.npy")
    inner = np.load(folder / "inner.npy")
    kappa = np.sqrt((k1**2 + k2**2) / 2.0)
    exact = {"k1": k1, "k2": k2, "mean": (k1 + k2) / 2.0, "kappa": kappa}
    scale = math.sqrt(float((kappa**2).mean()))
    errors: dict[str, float] = {}
    for part, chosen in zip(PARTS, (inner, ~inner), strict=True):
        if chosen.any():
            for quantity in QUANTITIES:
                error = np.abs(getattr(found, quantity) - exact[quantity])[chosen] / scale
                errors[f"{part} {quantity} worst"] = float(error.max())
                errors[f"{part} {quantity} rms"] = math.sqrt(float((error**2).mean()))
    return {
        "vertices": len(mesh.vertices),
        "filled": int(found.filled.sum()),
        "errors": errors,
        **cost,
    }


def click(folder: Path) -> dict[str, Any]:
    """Measure the operator, from the click to the finished material, in Blender."""
    import bpy  # late: only this process may carry Blender
    from rig import Rig

    from cdrf_addon import register

    register()
    surface = load_mesh(folder, 0.0)
    rig = Rig()
    rig.light("SUN")
    mesh = bpy.data.meshes.new("Surface")
    count = len(surface.triangles)
    mesh.vertices.add(len(surface.vertices))
    mesh.attributes["position"].data.foreach_set(
        "vector", surface.vertices.astype(np.float32).ravel()
    )
    mesh.loops.add(3 * count)
    mesh.loops.foreach_set("vertex_index", surface.triangles.astype(np.int32).ravel())
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * count, 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    rig.link(mesh).select_set(True)
    bpy.context.view_layer.update()
    # Once only: the second time it would find nothing to do.
    outcome, cost = timed(bpy.ops.cdrf.setup, 0.0)
    if outcome != {"FINISHED"}:
        raise RuntimeError(f"the operator returned {outcome}")
    return {"vertices": len(surface.vertices), **cost}


# --- results ------------------------------------------------------------------------------------


@dataclass
class Results:
    """All there is in the JSON file."""

    machine: dict[str, str] = field(default_factory=dict)
    meshes: dict[str, dict[str, dict[str, int]]] = field(default_factory=dict)
    rows: dict[tuple[Any, ...], Row] = field(default_factory=dict)
    """By `Row.key`."""
    scaling: dict[tuple[Any, ...], Row] = field(default_factory=dict)
    """The whole pipeline, on one surface at more sizes; of the operator, `CLICK`, too."""

    @classmethod
    def load(cls, path: Path) -> Results:
        """Read a file, or start with nothing."""
        if not path.exists():
            return cls()
        stored = json.loads(path.read_text())
        tables = {}
        for name in ("rows", "scaling"):
            rows = [Row(**row) for row in stored[name]]
            tables[name] = {row.key: row for row in rows}
        return cls(stored["machine"], stored["meshes"], **tables)

    def save(self, path: Path) -> None:
        """Write a file, a measurement a line."""
        lines = [f'{{"machine": {json.dumps(self.machine)},', '"meshes": {']
        meshes = [f"{json.dumps(name)}: {json.dumps(facts)}" for name, facts in self.meshes.items()]
        lines += [",\n".join(meshes) + "},"]
        for name, table in (("rows", self.rows), ("scaling", self.scaling)):
            rows = ",\n".join(json.dumps(_brief(asdict(row))) for row in table.values())
            lines += [f'"{name}": [\n{rows}]' + ("," if name == "rows" else "}")]
        path.write_text("\n".join(lines) + "\n")


def _brief(value: Any) -> Any:
    """Four digits are enough, and what is empty need not be written."""
    if isinstance(value, dict):
        return {key: _brief(item) for key, item in value.items() if item not in ("", {})}
    return float(f"{value:.4g}") if isinstance(value, float) else value


def fingerprint() -> str:
    """Tell versions of the measured sources apart."""
    digest = hashlib.sha256()
    for path in (
        *sorted((ROOT / "cdrf_addon" / "core").rglob("*.py")),
        ROOT / "tests/support/surfaces.py",
    ):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:8]


def machine() -> dict[str, str]:
    """Name what the numbers were measured on."""
    told = Path("/proc/cpuinfo")
    lines = told.read_text().splitlines() if told.exists() else []
    model = next((line.split(":")[1].strip() for line in lines if "model name" in line), "unknown")
    versions = {}
    for name in ("numpy", "scipy", "libigl", "bpy", "matplotlib"):
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "unknown"
    return {
        "date": time.strftime("%Y-%m-%d"),
        "processor": model,
        "cores": str(os.cpu_count()),
        "architecture": platform.machine(),
        "system": platform.system(),
        "python": platform.python_version(),
        **versions,
    }


def attempt(row: Row, call: Callable[..., dict[str, Any]], *arguments: Any) -> Row:
    """Measure in a child; a failure becomes part of the row."""
    try:
        return replace(row, **in_child(call, *arguments))
    except ChildFailedError as error:
        return replace(row, failure=str(error))


def is_there(row: Row, table: dict[tuple[Any, ...], Row]) -> bool:
    """Tell whether a row was measured before, and did not fail."""
    return row.key in table and not table[row.key].failure


def measure_errors(
    results: Results,
    wanted: Iterable[Row],
    patience: float,
    missing: bool,
    save: Callable[[], None],
) -> None:
    """Measure rows, those of a mesh together; keep what `missing` says may stay."""
    jobs: dict[tuple[str, int], list[Row]] = {}
    for row in wanted:
        if not (missing and is_there(row, results.rows)):
            jobs.setdefault((row.surface, row.size), []).append(row)
    for (name, size), rows in jobs.items():
        start = time.perf_counter()
        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(temporary)
            noises = sorted({row.noise for row in rows})
            facts = in_child(write_meshes, folder, name, size, noises)
            results.meshes.setdefault(name, {})[str(size)] = facts
            for row in rows:
                arguments = folder, row.noise, (row.method, row.rings), patience
                results.rows[row.key] = attempt(row, measure, *arguments)
        save()
        spent = time.perf_counter() - start
        print(f"{name}, {size:,}: {len(rows)} measurements in {spent:.1f} s", flush=True)


def measure_scaling(
    results: Results,
    sizes: Sequence[int],
    configs: Sequence[Config],
    code: str,
    patience: float,
    missing: bool,
    save: Callable[[], None],
) -> None:
    """Measure the pipeline at more sizes, at the default radius, and the operator as a whole."""
    for size in sizes:
        start = time.perf_counter()
        chosen = [*configs, (CLICK, None)]
        rows = [Row(SCALING_SURFACE, size, 0.0, *config, code=code) for config in chosen]
        rows = [row for row in rows if not (missing and is_there(row, results.scaling))]
        if not rows:
            continue
        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(temporary)
            in_child(write_meshes, folder, SCALING_SURFACE, size, [0.0])
            for row in rows:
                if row.method == CLICK:
                    done = attempt(row, click, folder)
                else:
                    arguments = folder, 0.0, (row.method, row.rings), patience
                    done = attempt(row, measure, *arguments)
                results.scaling[row.key] = done
        save()
        print(f"scaling, {size:,}: {time.perf_counter() - start:.1f} s", flush=True)


def warm_up(configs: Iterable[Config]) -> None:
    """Load what the estimators load late, so that no fork pays for it."""
    small = torus(300)
    for config in configs:
        estimate(TriMesh.from_arrays(small.vertices, small.triangles), config)


# --- what the numbers say -----------------------------------------------------------------------


@dataclass(frozen=True)
class Point:
    """An estimator's error and time on a family at one size and noise."""

    config: Config
    error: float
    seconds: float

    @property
    def product(self) -> float:
        return self.error * self.seconds


class Summary:
    """Aggregates of the rows; a number is NaN where a surface is missing or failed."""

    def __init__(self, results: Results) -> None:
        self.rows = results.rows
        present = {(row.method, row.rings) for row in self.rows.values()}
        self.configs = [config for config in configurations() if config in present]
        self.sizes = sorted({row.size for row in self.rows.values()})
        self.noises = sorted({row.noise for row in self.rows.values()})

    def _of(self, surfaces: Iterable[str], size: int, noise: float, config: Config) -> list[Row]:
        keys = [(surface, size, noise, *config) for surface in surfaces]
        return [self.rows[key] for key in keys if key in self.rows]

    def error(
        self, family: Family, size: int, noise: float, config: Config, quantity: str, kind: str
    ) -> float:
        """RMS over the surfaces of the RMS errors, or the worst of the worst."""
        rows = self._of(family.surfaces, size, noise, config)
        values = [row.errors.get(f"{family.part} {quantity} {kind}", math.nan) for row in rows]
        if len(values) < len(family.surfaces) or any(math.isnan(value) for value in values):
            return math.nan
        return max(values) if kind == "worst" else math.sqrt(statistics.fmean(v**2 for v in values))

    def cost(self, config: Config, size: int, what: str, family: Family | None = None) -> float:
        """Median of seconds or megabytes over the surfaces and noises; they hardly differ."""
        surfaces = family.surfaces if family else ALL_SURFACES
        rows = [row for noise in self.noises for row in self._of(surfaces, size, noise, config)]
        values = [getattr(row, what) for row in rows if not row.failure]
        return statistics.median(values) if values else math.nan

    def filled(self, config: Config, size: int) -> float:
        """Per cent of vertices that an estimator left to their neighbours, on the worst mesh."""
        found = [
            row for noise in self.noises for row in self._of(ALL_SURFACES, size, noise, config)
        ]
        return max((100.0 * r.filled / r.vertices for r in found if r.vertices), default=math.nan)

    def points(self, family: Family, size: int, noise: float) -> list[Point]:
        """Error of the curvedness and time of every estimator that has both."""
        points = [
            Point(
                config,
                self.error(family, size, noise, config, "kappa", "rms"),
                self.cost(config, size, "seconds", family),
            )
            for config in self.configs
        ]
        return [point for point in points if math.isfinite(point.product)]

    def order(self, family: Family, config: Config) -> float:
        """Power of the edge length with which the RMS error of the curvedness falls."""
        errors = {
            size: self.error(family, size, 0.0, config, "kappa", "rms") for size in self.sizes
        }
        known = {size: error for size, error in errors.items() if error > EXACT}
        if len(known) < 2:
            return math.nan
        return -2.0 * exponent(list(known), list(known.values()))[0]


def pareto(points: Iterable[Point]) -> list[Point]:
    """Those that none other beats in error and time both, from quick to accurate."""
    front: list[Point] = []
    for point in sorted(points, key=lambda p: (p.seconds, p.error)):
        if not front or point.error < front[-1].error:
            front.append(point)
    return front


def exponent(sizes: ArrayLike, values: ArrayLike) -> tuple[float, float]:
    """Slope in the log-log plot and its standard error (NaN from two points)."""
    x, y = np.log(sizes), np.log(values)
    slope, base = np.polyfit(x, y, 1)
    if len(x) < 3:
        return float(slope), math.nan
    spread = ((y - base - slope * x) ** 2).sum() / (len(x) - 2)
    return float(slope), math.sqrt(float(spread / ((x - x.mean()) ** 2).sum()))


# --- the page -----------------------------------------------------------------------------------


def short(value: float) -> str:
    """Two significant digits without an exponent; 0 is less than any error of interest."""
    if not math.isfinite(value):
        return "–"
    if abs(value) < 100.0 * EXACT:
        return "0"
    return np.format_float_positional(value, 2, fractional=False, unique=False, trim="-")


def count_of(size: int) -> str:
    """1k, 10k, 1M."""
    return f"{size // 1_000_000}M" if size >= 1_000_000 else f"{size // 1_000}k"


def noise_of(noise: float) -> str:
    """Name a level of noise."""
    return f"{100 * noise:g} % noise" if noise else "clean"


def series(values: Iterable[float]) -> str:
    """A number for each size in one cell."""
    return " / ".join(short(value) for value in values)


def to_lines(table: Table) -> list[str]:
    """Render a table."""
    head, rows = table
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return [*lines, *("| " + " | ".join(row) + " |" for row in rows), ""]


def family_table(summary: Summary, family: Family) -> Table:
    """Errors of a family in per cent, a number for each size."""
    loudest = summary.noises[-1]
    columns: list[tuple[str, str, float]] = [
        ("κ", "rms", 0.0),
        ("κ", "worst", 0.0),
        ("H", "rms", 0.0),
        ("k₁, k₂", "rms", 0.0),
        *(("κ", "rms", noise) for noise in summary.noises if noise),
        ("κ", "worst", loudest),
    ]
    columns = list(dict.fromkeys(columns))
    quantities = {"κ": ("kappa",), "H": ("mean",), "k₁, k₂": ("k1", "k2")}
    rows = []
    for config in summary.configs:
        cells = [name_of(config)]
        for symbol, kind, noise in columns:
            # Of k1 and k2, the worse one.
            errors = [
                [
                    summary.error(family, size, noise, config, quantity, kind)
                    for quantity in quantities[symbol]
                ]
                for size in summary.sizes
            ]
            cells.append(series(100.0 * float(np.max(both)) for both in errors))
        rows.append([*cells, short(summary.order(family, config))])
    kinds = {"rms": "RMS", "worst": "worst"}
    head = [f"{symbol} {kinds[kind]}, {noise_of(noise)}" for symbol, kind, noise in columns]
    return ["estimator, rings", *head, "order, κ RMS, clean"], rows


def cost_table(summary: Summary) -> Table:
    """Seconds and memory of every estimator."""
    largest = summary.sizes[-1]
    rows = []
    for config in summary.configs:
        seconds = [summary.cost(config, size, "seconds") for size in summary.sizes]
        memory = [summary.cost(config, size, "megabytes") for size in summary.sizes]
        wall = [summary.cost(config, size, "wall") for size in summary.sizes]
        each = 1e6 * seconds[-1] / largest
        cells = [name_of(config), series(seconds), short(each), series(wall), series(memory)]
        rows.append([*cells, series(summary.filled(config, size) for size in summary.sizes)])
    head = ["CPU s", f"µs a vertex at {count_of(largest)}", "s by the clock"]
    return ["estimator, rings", *head, "peak MB above the mesh", "filled at the most, %"], rows


def conclusions(summary: Summary) -> list[str]:
    """Say what is on the front and what is best on irregular meshes, case by case and in all."""
    family = FAMILIES["irregular"]
    rows: list[list[str]] = []
    often: Counter[Config] = Counter()
    best: Counter[Config] = Counter()
    behind: list[float] = []
    usual = next(
        (
            c
            for c in summary.configs
            if c in ((DEFAULT_METHOD, DEFAULT_RADIUS), (DEFAULT_METHOD, None))
        ),
        None,
    )
    for noise in summary.noises:
        for size in summary.sizes:
            points = summary.points(family, size, noise)
            if not points:
                continue
            front = pareto(points)
            often.update(point.config for point in front)
            winner = min(points, key=lambda point: point.product)
            best[winner.config] += 1
            behind += [p.product / winner.product for p in points if p.config == usual]
            names = "; ".join(f"{name_of(p.config)}: {short(100.0 * p.error)} %" for p in front)
            row = [noise_of(noise), count_of(size), names, name_of(winner.config)]
            rows.append([*row, short(100.0 * winner.error), short(winner.seconds)])
    if not rows:
        return ["Nothing measured on irregular meshes yet.", ""]
    never = [name_of(config) for config in summary.configs if config not in often]
    told = [
        f"Of the {len(rows)} cases of noise and size on irregular meshes (RMS error of κ against "
        "CPU seconds):",
        "",
        "- on the Pareto front most often: " + _ranking(often, len(rows)) + ";",
        "- never on it: " + ("; ".join(never) or "none") + ";",
        "- least error × time: " + _ranking(best, len(rows)) + ".",
    ]
    if behind:
        told.append(
            f"- The default, {name_of(usual)}: on the front in {often[usual]} of {len(rows)}; its "
            f"error × time is {short(statistics.median(behind))} times the least in the median, "
            f"{short(max(behind))} times at the worst."
            if usual
            else ""
        )
    head = ["noise", "vertices", "Pareto front, quick to accurate", "least error × time"]
    return [*told, "", *to_lines(([*head, "its κ RMS, %", "its CPU s"], rows))]


def _ranking(counted: Counter[Config], of: int) -> str:
    return "; ".join(
        f"{name_of(config)} ({count} of {of})" for config, count in counted.most_common()
    )


def scaling_series(results: Results) -> dict[str, list[Row]]:
    """Successful runs of the pipeline by name, by size."""
    named: dict[str, list[Row]] = {}
    for row in sorted(results.scaling.values(), key=lambda row: row.vertices):
        if not row.failure and row.method in (*METHODS, CLICK):
            named.setdefault(name_of((row.method, row.rings)), []).append(row)
    return named


def scaling_table(results: Results) -> Table:
    """Fitted exponents beside that of n log n."""
    rows = []
    for name, runs in scaling_series(results).items():
        cells = [name]
        for least in (0, LARGE):
            chosen = [run for run in runs if run.vertices >= 0.9 * least]
            if len(chosen) < 3:
                cells += ["–"] * 3
                continue
            sizes = [run.vertices for run in chosen]
            slope, doubt = exponent(sizes, [run.seconds for run in chosen])
            demanded, _ = exponent(sizes, [size * math.log(size) for size in sizes])
            beyond = slope - demanded
            verdict = "yes" if beyond <= 0.0 else "unclear" if beyond <= 2.0 * doubt else "**no**"
            cells += [f"{slope:.2f} ± {doubt:.2f}", f"{demanded:.2f}", verdict]
        each = [1e6 * run.seconds / run.vertices for run in (runs[0], runs[-1])]
        rows.append([*cells, f"{short(each[0])} → {short(each[1])}"])
    return [
        "pipeline",
        "exponent",
        "of n log n",
        "met",
        f"from {count_of(LARGE)}",
        "of n log n",
        "met",
        "µs a vertex, first → last size",
    ], rows


def mesh_table(results: Results, sizes: Sequence[int]) -> Table:
    """What the meshes are like."""
    rows = []
    for name in ALL_SURFACES:
        facts = [results.meshes.get(name, {}).get(str(size)) for size in sizes]
        cells = [
            " / ".join(f"{fact[what]:,}" if fact else "–" for fact in facts)
            for what in ("vertices", "border", "inverted")
        ]
        rows.append([name, *cells])
    return ["surface", "vertices", "next to the boundary", "triangles turned over"], rows


def to_markdown(results: Results, figures: Iterable[str]) -> str:
    """Render the page."""
    summary = Summary(results)
    facts = ", ".join(f"{name} {value}" for name, value in results.machine.items())
    sizes = " / ".join(count_of(size) for size in summary.sizes)
    everything = [*results.rows.values(), *results.scaling.values()]
    codes = sorted({row.code for row in everything})
    lines = [
        "# Curvature estimators: error against run time",
        "",
        "Generated by `tests/benchmarks/estimators.py`; do not edit. Every measurement is in "
        "[estimators.json](data/estimators.json).",
        "",
        f"Measured on: {facts}.",
        "",
        "Errors are in % of the surface's RMS curvedness κ; H is the mean curvature. A cell holds "
        f"{sizes} vertices, a dash where nothing was measured. Over a family the RMS column is the "
        "RMS of its surfaces, the worst the worst vertex of them all. The order is the power of "
        "the edge length with which the error falls. Noise moves every vertex along the normal, "
        "normally distributed, by that part of the mean edge. Times are CPU seconds of all threads "
        "and include cleaning, guarding and filling; memory is the peak of a fresh process above "
        "what it held with the mesh loaded.",
        "",
    ]
    if len(codes) > 1:
        lines += [f"**The rows come from {len(codes)} versions of the sources**; run it all.", ""]
    lines += ["## Conclusions", "", *conclusions(summary)]
    for key, family in FAMILIES.items():
        lines += [f"## {family.title}", "", "Of: " + ", ".join(family.surfaces) + ".", ""]
        if key in figures:
            lines += [f"![Error against time]({figure_name(key)})", ""]
        lines += to_lines(family_table(summary, family))
    lines += [
        "## Time and memory",
        "",
        "Medians over the surfaces and the noise. A vertex is filled from its neighbours where an "
        "estimator has no value.",
        "",
        *to_lines(cost_table(summary)),
    ]
    lines += [
        "## Time against the number of vertices",
        "",
        f"The whole pipeline on a {SCALING_SURFACE}, from the arrays of the mesh to the curvature "
        f"at its vertices, at the default radius; *{CLICK}* is the operator in Blender. Demanded "
        "is n log n: the fitted exponent may not exceed that of n log n over the same sizes; an "
        "excess of less than two standard errors is unclear.",
        "",
    ]
    if "scaling" in figures:
        lines += [f"![Seconds against vertices]({figure_name('scaling')})", ""]
    lines += to_lines(scaling_table(results))
    lines += ["## The meshes", "", *to_lines(mesh_table(results, summary.sizes))]
    lines += [
        "Triangles are turned over where jitter moved a vertex across an edge.",
        "",
    ]
    failed = [row for row in everything if row.failure]
    if failed:
        head = ["surface", "vertices", "noise", "estimator", "failure"]
        rows = [
            [
                row.surface,
                count_of(row.size),
                noise_of(row.noise),
                name_of((row.method, row.rings)),
                row.failure,
            ]
            for row in failed
        ]
        lines += ["## Failures", "", *to_lines((head, rows))]
    return "\n".join(lines)


# --- the figures --------------------------------------------------------------------------------

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8B5A2B")
MARKERS = {None: "D", 2: "o", 3: "^", 5: "s"}
STYLE: Any = {
    # Text as text, and the same names in every run: small files and small differences.
    "svg.fonttype": "none",
    "svg.hashsalt": "cdrf",
    "font.size": 9,
    "axes.grid": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.5,
    "xtick.minor.size": 0,
    "ytick.minor.size": 0,
}


def figure_name(key: str) -> str:
    """File of a figure."""
    return f"images/estimators-{key}.svg"


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure without a date, so that equal numbers make equal files."""
    with mpl.rc_context(STYLE):
        figure.savefig(path, format="svg", metadata={"Date": None})


def colour_of(method: str) -> str:
    """One colour for a method in all figures."""
    return COLOURS[[*METHODS, method].index(method) % len(COLOURS)]


def draw_family(summary: Summary, family: Family, path: Path) -> bool:
    """Error against time, a panel for each noise, a line through the sizes of each estimator."""
    with mpl.rc_context(STYLE):
        panels = len(summary.noises)
        figure = Figure(figsize=(3.2 * panels + 2.2, 3.6), layout="constrained")
        axes = figure.subplots(1, panels, sharey=True, squeeze=False)[0]
        drawn: dict[Config, Any] = {}
        for axis, noise in zip(axes, summary.noises, strict=True):
            lines: dict[Config, list[Point]] = {}
            for size in summary.sizes:
                points = summary.points(family, size, noise)
                for point in points:
                    lines.setdefault(point.config, []).append(point)
                front = pareto(points)
                axis.plot(
                    [p.seconds for p in front],
                    [100.0 * p.error for p in front],
                    color="#999999",
                    linewidth=3.0,
                    zorder=1,
                )
            for config, points in lines.items():
                (drawn[config],) = axis.plot(
                    [p.seconds for p in points],
                    [100.0 * p.error for p in points],
                    color=colour_of(config[0]),
                    marker=MARKERS.get(config[1], "x"),
                    markersize=4,
                    linewidth=0.8,
                )
            axis.set(xscale="log", yscale="log", title=noise_of(noise), xlabel="CPU seconds")
        if not drawn:
            return False
        axes[0].set_ylabel("RMS error of κ, %")
        sizes = ", ".join(count_of(size) for size in summary.sizes)
        figure.legend(
            drawn.values(),
            [name_of(config) for config in drawn],
            loc="outside right center",
            title=f"{sizes} vertices;\ngrey: Pareto fronts",
            fontsize=8,
            title_fontsize=8,
        )
    save_figure(figure, path)
    return True


def draw_scaling(results: Results, path: Path) -> bool:
    """Seconds against vertices on logarithmic axes, with n log n through the last point."""
    named = scaling_series(results)
    if not named:
        return False
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 4.2), layout="constrained")
        axis = figure.subplots()
        for name, runs in named.items():
            sizes = np.array([run.vertices for run in runs], dtype=np.float64)
            seconds = [run.seconds for run in runs]
            colour = colour_of(runs[0].method)
            told = f"{name}: n^{exponent(sizes, seconds)[0]:.2f}" if len(runs) > 1 else name
            axis.plot(sizes, seconds, "o-", color=colour, markersize=3, linewidth=1, label=told)
            guide = sizes * np.log(sizes)
            axis.plot(sizes, seconds[-1] * guide / guide[-1], ":", color=colour, linewidth=0.8)
        axis.plot([], [], ":", color="black", linewidth=0.8, label="n log n")
        axis.set(xscale="log", yscale="log", xlabel="vertices", ylabel="CPU seconds")
        figure.legend(loc="outside right center", fontsize=8)
    save_figure(figure, path)
    return True


def write_page(results: Results, folder: Path) -> None:
    """Draw the figures and write the page around them."""
    summary = Summary(results)
    figures = [
        key
        for key, family in FAMILIES.items()
        if draw_family(summary, family, folder / figure_name(key))
    ]
    if draw_scaling(results, folder / figure_name("scaling")):
        figures.append("scaling")
    (folder / "estimators.md").write_text(to_markdown(results, figures))


def main() -> None:
    """Measure what is asked for; results of the rest stay as they are in the JSON file."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--quick", action="store_true", help="small meshes, one radius, < 2 minutes"
    )
    parser.add_argument("--missing", action="store_true", help="keep what was measured before")
    parser.add_argument("--page", action="store_true", help="measure nothing")
    parser.add_argument(
        "--sizes", nargs="+", type=int, help="vertices, in place of the usual sizes"
    )
    parser.add_argument("--noises", nargs="+", type=float, help="in mean edges")
    parser.add_argument("--radii", nargs="+", type=int, help="rings, where a method takes them")
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=list(METHODS))
    parser.add_argument("--surfaces", nargs="+", choices=ALL_SURFACES, default=list(ALL_SURFACES))
    parser.add_argument("--no-scaling", action="store_true", help="leave out time against vertices")
    parser.add_argument("--out", type=Path, help="folder to write to")
    asked = parser.parse_args()
    quick = asked.quick
    folder = asked.out or (ROOT / "output" / "estimators" if quick else ROOT / "docs" / "results")
    for part in ("data", "images"):
        (folder / part).mkdir(parents=True, exist_ok=True)
    data = folder / "data" / "estimators.json"
    results = Results.load(data)
    if not asked.page:
        start = time.perf_counter()
        results.machine = machine()
        sizes = asked.sizes or (SIZES[:2] if quick else SIZES)
        noises = asked.noises or ((NOISES[0], NOISES[-1]) if quick else NOISES)
        radii = asked.radii or ((DEFAULT_RADIUS,) if quick else RADII)
        code = fingerprint()
        configs = [config for config in configurations(radii) if config[0] in asked.methods]
        warm_up(configs)
        rows = [
            Row(surface, size, noise, *config, code=code)
            for size in sizes
            for surface in asked.surfaces
            for noise in noises
            for config in configs
        ]

        def save() -> None:
            results.save(data)

        patience = QUICK_PATIENCE if quick else PATIENCE
        measure_errors(results, rows, patience, asked.missing, save)
        if not asked.no_scaling:
            usual = [c for c in configs if c[1] in (None, DEFAULT_RADIUS)]
            more = SCALING_SIZES[:3] if quick else SCALING_SIZES
            patience = PATIENCE if quick else SCALING_PATIENCE
            measure_scaling(results, more, usual, code, patience, asked.missing, save)
        print(f"measured in {time.perf_counter() - start:.0f} s", flush=True)
    write_page(results, folder)


if __name__ == "__main__":
    main()
