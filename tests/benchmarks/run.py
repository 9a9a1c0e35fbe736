# SPDX-License-Identifier: GPL-3.0-or-later
"""Run time of the operator and of a draw: writes docs/benchmarks.md and docs/benchmarks.json.

    ./dev python tests/benchmarks/run.py            everything, about ten minutes on two cores
    ./dev python tests/benchmarks/run.py --only setup frame

Timings are seconds on the clock. Draws are given as ratios too, as those of a software rasteriser
mean little by themselves; they need Blender 5.2. The look-up table has its own, lut.py.
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "support")]

import bpy  # noqa: E402  (the checkout must be importable first)
import igl  # noqa: E402
import numpy as np  # noqa: E402
from machine import machine  # noqa: E402
from rig import Rig, cdrf_node, diffuse_material  # noqa: E402
from surfaces import ALL_SURFACES, Surface  # noqa: E402

from cdrf_addon import register, unregister  # noqa: E402
from cdrf_addon.compat import ensure_node_tree  # noqa: E402

DRAWS = 15
DRAW_PIXELS = 1024
Rows = list[list[Any]]


def bench_setup() -> tuple[str, list[str], Rows]:
    """The whole of Make Translucent, and of pressing it again with nothing changed.

    libigl's own quadric fit, without cleaning or diffusion, is timed on the same mesh as a
    yardstick of the machine.
    """
    rows: Rows = []
    for wanted in (10_000, 100_000, 1_000_000):
        rig = Rig()
        rig.light("SUN")
        surface = ALL_SURFACES["jittered torus"](wanted)
        start = time.perf_counter()
        igl.principal_curvature(surface.vertices, surface.triangles, 2)
        yardstick = time.perf_counter() - start
        item = rig.link(mesh_of(surface))
        item.select_set(True)
        bpy.context.view_layer.update()
        before = reset_peak()
        start = time.perf_counter()
        bpy.ops.cdrf.setup()
        first = time.perf_counter() - start
        memory = peak_megabytes() - before
        start = time.perf_counter()
        bpy.ops.cdrf.setup()
        again = time.perf_counter() - start
        count = len(item.data.vertices)
        row = [f"{count:,}", f"{first:.2f}", f"{1e6 * first / count:.1f}", f"{memory:.0f}"]
        rows.append([*row, f"{again:.3f}", f"{yardstick:.2f}", f"{first / yardstick:.2f}"])
    return (
        "Make Translucent: from click to finish",
        [
            "vertices",
            "first time, s",
            "us a vertex",
            "peak MB more",
            "again, nothing changed, s",
            "libigl's fit alone, s",
            "ratio",
        ],
        rows,
    )


def mesh_of(surface: Surface) -> bpy.types.Mesh:
    """Hand a surface to Blender."""
    mesh = bpy.data.meshes.new("Surface")
    triangles = surface.triangles.astype(np.int32)
    mesh.vertices.add(len(surface.vertices))
    mesh.vertices.foreach_set("co", surface.vertices.astype(np.float32).ravel())
    mesh.loops.add(triangles.size)
    mesh.loops.foreach_set("vertex_index", triangles.ravel())
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, triangles.size, 3, dtype=np.int32))
    mesh.update()
    return mesh


def reset_peak() -> float:
    """Start a new measurement of peak memory (Linux); return what is in use, MB."""
    Path("/proc/self/clear_refs").write_text("5")
    return peak_megabytes()


def peak_megabytes() -> float:
    """Peak memory of this process since the last reset."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return int(next(line for line in lines if line.startswith("VmHWM")).split()[1]) / 1024.0


def _contenders(rig: Rig) -> dict[str, Callable[[], None]]:
    """Materials and lights to be timed; each call prepares the scene for one."""
    item = rig.sphere(subdivisions=6)
    item.scale = (1.0, 1.0, 1.001)  # not quite a sphere: the shader reads the attribute
    suns = [
        rig.light("SUN", name=f"Sun {i}", energy=1.0, rotation=(0.6 + 0.2 * i, 0.0, 1.5 * i))
        for i in range(4)
    ]
    emission = bpy.data.materials.new("Emission")
    tree = ensure_node_tree(emission)
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    glow = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(glow.outputs["Emission"], output.inputs["Surface"])
    skin = bpy.data.materials.new("Skin")
    subsurface = bpy.data.materials.new("Subsurface")
    principled = next(
        node for node in ensure_node_tree(subsurface).nodes if node.type == "BSDF_PRINCIPLED"
    )
    principled.inputs["Subsurface Weight"].default_value = 1.0
    diffuse = diffuse_material()

    def scene(material: bpy.types.Material, lights: int, ratio: tuple[float, ...] = ()) -> None:
        for number, sun in enumerate(suns):
            sun.hide_render = number >= lights
        item.data.materials.clear()
        item.data.materials.append(material)
        bpy.context.view_layer.update()
        if ratio:
            bpy.ops.cdrf.setup()
            material.cdrf.sigma0 = 0.2
            material.cdrf.sigma0_ratio = ratio
            assert cdrf_node(item) is not None

    grey, skin_ratio = (1.0, 1.0, 1.0), (1.0, 0.35, 0.2)
    return {
        "Emission": lambda: scene(emission, 1),
        "Diffuse BSDF, 1 sun": lambda: scene(diffuse, 1),
        "CDRF, 1 sun, 1 look-up": lambda: scene(skin, 1, grey),
        "CDRF, 1 sun, 3 look-ups": lambda: scene(skin, 1, skin_ratio),
        "Diffuse BSDF, 4 suns": lambda: scene(diffuse, 4),
        "CDRF, 4 suns, 3 look-ups": lambda: scene(skin, 4, skin_ratio),
        "Principled with subsurface, 1 sun": lambda: scene(subsurface, 1),
    }


def bench_frame() -> tuple[str, list[str], Rows]:
    """Time of a viewport draw; final renders vary by a factor of three from run to run here.

    The Diffuse BSDF comes first and last, so that a drift of the machine shows.
    """
    import gpu  # late: only Blender 5.2 can draw without a window

    gpu.init()
    rig = Rig()
    contenders = _contenders(rig)
    rig.scene.eevee.taa_samples = 1
    area = next(a for s in bpy.data.screens for a in s.areas if a.type == "VIEW_3D")
    space = area.spaces.active
    space.shading.type = "RENDERED"
    space.overlay.show_overlays = False
    region = next(region for region in area.regions if region.type == "WINDOW")
    target = gpu.types.GPUOffScreen(DRAW_PIXELS, DRAW_PIXELS, format="RGBA16F")
    depsgraph = bpy.context.evaluated_depsgraph_get()
    view = rig.camera.matrix_world.inverted()
    lens = rig.camera.calc_matrix_camera(depsgraph, x=DRAW_PIXELS, y=DRAW_PIXELS)

    turns = itertools.count()

    def draw() -> float:
        # A view that stands still is not drawn again, so each is a hair beside the last.
        view.translation.x = 1e-5 * next(turns)
        start = time.perf_counter()
        target.draw_view3d(
            rig.scene, bpy.context.view_layer, space, region, view, lens, do_color_management=False
        )
        with target.bind():  # reading a pixel waits for the drawing to end
            gpu.state.active_framebuffer_get().read_color(0, 0, 1, 1, 4, 0, "FLOAT")
        return time.perf_counter() - start

    base = "Diffuse BSDF, 1 sun"
    order = [base, *(name for name in contenders if name != base), base]
    measured = []
    for name in order:
        contenders[name]()
        bpy.context.view_layer.update()
        first = draw()
        measured.append((name, first, [draw() for _ in range(DRAWS)]))
    reference = float(np.median([*measured[0][2], *measured[-1][2]]))
    rows: Rows = []
    for name, first, times in measured:
        low, middle, high = np.percentile(times, (10, 50, 90))
        row = [
            name,
            f"{middle / reference:.2f}",
            f"{low / reference:.2f} to {high / reference:.2f}",
        ]
        rows.append([*row, f"{middle:.3f}", f"{first:.0f}"])
    return (
        f"A viewport draw of {DRAW_PIXELS} x {DRAW_PIXELS} pixels against the Diffuse BSDF",
        ["material", "ratio, median", "10 % to 90 %", "s", "first draw with compilation, s"],
        rows,
    )


BENCHES = {
    "setup": bench_setup,
    "frame": bench_frame,
}


def to_markdown(results: dict[str, Any]) -> str:
    """Render all tables as one page."""
    facts = ", ".join(f"{name} {value}" for name, value in results["machine"].items())
    lines = ["# Benchmarks", "", "Generated by `tests/benchmarks/run.py`; do not edit.", ""]
    lines += [f"Measured on: {facts}; EEVEE on a software rasteriser.", ""]
    for name in BENCHES:
        if name in results:
            title, head, rows = results[name]
            lines += [f"## {title}", "", "| " + " | ".join(head) + " |"]
            lines += ["|" + "---|" * len(head)]
            lines += ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows] + [""]
    return "\n".join(lines)


def main() -> None:
    """Run the chosen benches; results of the others stay as they are in the JSON file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", choices=BENCHES, default=list(BENCHES))
    chosen = parser.parse_args().only
    data = ROOT / "docs" / "benchmarks.json"
    results = json.loads(data.read_text()) if data.exists() else {}
    results["machine"] = machine()
    register()
    try:
        for name in chosen:
            print(f"{name} ...", flush=True)
            results[name] = BENCHES[name]()
    finally:
        unregister()
    data.write_text(json.dumps(results, indent=1) + "\n")
    (ROOT / "docs" / "benchmarks.md").write_text(to_markdown(results))


if __name__ == "__main__":
    main()
