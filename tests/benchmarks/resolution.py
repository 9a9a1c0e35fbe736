# SPDX-License-Identifier: GPL-3.0-or-later
"""The same shape at several resolutions: docs/results/resolution.md, with a picture.

    ./dev bench resolution [--levels 4]

The head is subdivided 0 to 4 times and rendered by EEVEE at one sigma0. What is compared is what
the scattering adds to Lambert shading, so that the finer normals of a finer mesh do not count.
"""

from __future__ import annotations

import argparse
import platform
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray
from rig import Rig, cdrf_node

from cdrf_addon import ids, register, unregister
from cdrf_addon.command import stage
from cdrf_addon.core.curvature.scale_space import LEVELS

from .common.files import IMAGES, MESHES, write_page, write_results
from .common.markdown import generated, table
from .common.pictures import save_picture, side_by_side

HEAD = MESHES / "human_head.obj"
RESOLUTION = 256
# The head in metres: skin's red, green and blue.
SCALE, SIGMA0, RATIO = 0.1, 0.006, (1.0, 0.35, 0.2)
Image = NDArray[np.float64]


def render_level(level: int) -> dict[str, Image]:
    """Render the head subdivided so often: Lambert, kappa as measured, kappa diffused."""
    rig = Rig()
    objects = stage.import_mesh(HEAD, SCALE, level)
    stage.light_and_frame(objects)
    scene = rig.scene
    scene.render.resolution_x = scene.render.resolution_y = RESOLUTION
    scene.view_settings.view_transform = "Raw"
    scene.eevee.taa_render_samples = 4
    for obj in bpy.data.objects:
        if obj.type == "LIGHT":
            obj.data.use_shadow = False
    for obj in objects:
        obj.select_set(True)
    bpy.context.view_layer.update()
    bpy.ops.cdrf.setup()
    (obj,) = objects
    material = obj.data.materials[0]
    material.cdrf.sigma0_ratio = RATIO
    cdrf_node(obj).inputs[ids.BASE_COLOR].default_value = (1.0, 1.0, 1.0, 1.0)
    images: dict[str, Image] = {}
    material.cdrf.sigma0 = 0.0
    images["Lambert"] = rig.render()
    material.cdrf.sigma0 = SIGMA0
    images["diffused"] = rig.render()
    mesh = obj.data
    colours = np.empty(4 * len(mesh.vertices), dtype=np.float32)
    mesh.attributes[ids.CURVATURE_ATTRIBUTE].data.foreach_get("color", colours)
    raw = np.repeat(colours.reshape(-1, 4)[:, :1], LEVELS, axis=1)
    mesh.attributes[ids.DIFFUSED_ATTRIBUTE].data.foreach_set("color", raw.ravel())
    mesh.update_tag()
    images["as measured"] = rig.render()
    print(f"level {level}: {len(mesh.vertices):,} vertices", flush=True)
    images["vertices"] = np.array(len(mesh.vertices))
    return images


def compare(images: dict[int, dict[str, Image]]) -> list[dict[str, float]]:
    """RMS difference of each level to the finest, in units of the brightest white."""
    reference = images[max(images)]
    rows = []
    for level, one in images.items():
        both = (one["Lambert"][..., 3] > 0.999) & (reference["Lambert"][..., 3] > 0.999)
        row: dict[str, float] = {"level": level, "vertices": int(one["vertices"])}
        peak = float(reference["Lambert"][both][:, :3].max())

        def rms(difference: Image, where: NDArray[np.bool_] = both, unit: float = peak) -> float:
            return float(np.sqrt((difference[where][:, :3] ** 2).mean())) / unit

        row["Lambert"] = rms(one["Lambert"] - reference["Lambert"])
        for kind in ("as measured", "diffused"):
            added, final = (part[kind] - part["Lambert"] for part in (one, reference))
            row[kind] = rms(added - final)
            row[f"{kind}, size"] = rms(added)
        rows.append(row)
    return rows


def page(rows: list[dict[str, float]], facts: str) -> str:
    """Write the page."""
    last = rows[0]
    lines = [
        "# The same shape at any resolution",
        "",
        generated("resolution"),
        "",
        f"{facts} The human head at σ₀ = {SIGMA0 * 1e3:g} mm × (1, 0.35, 0.2), two suns, EEVEE,",
        f"{RESOLUTION} × {RESOLUTION} pixels. RMS difference to the finest mesh, in parts of the",
        "brightest white: of Lambert shading, which is the mesh's own coarseness, and of what the",
        "scattering adds to it, with κ as it is measured at the vertices and with κ diffused over",
        "the scatter distance, as it ships.",
        "",
    ]
    kinds = ("Lambert", "as measured", "diffused")
    cells = [
        [f"{row['level']}", f"{row['vertices']:,}", *(f"{row[kind]:.4f}" for kind in kinds)]
        for row in rows
    ]
    head = ["level", "vertices", "Lambert", "scattering, κ as measured", "scattering, κ diffused"]
    lines += table(head, cells)
    lines += [
        f"The scattering itself has an RMS of {rows[-1]['as measured, size']:.4f} (as measured)",
        f"and {rows[-1]['diffused, size']:.4f} (diffused)",
        f"on the finest mesh. From {last['vertices']:,} to {rows[-1]['vertices']:,} vertices it "
        f"changes by {last['diffused']:.4f} where κ is diffused,",
        f"by {last['as measured']:.4f} where it is not.",
        "",
        "![Lambert, scattering with κ as measured and diffused, at each subdivision]"
        "(images/resolution.png)",
        "",
    ]
    return "\n".join(lines)


def save_rows(images: dict[int, dict[str, Image]], path: Path) -> None:
    """Join all pictures, a row for each kind of kappa, a column for each level."""
    kinds = ("Lambert", "as measured", "diffused")
    rows = [side_by_side([one[kind] for one in images.values()]) for kind in reversed(kinds)]
    save_picture(np.vstack(rows), path)


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--levels", type=int, default=4)
    options = parser.parse_args()
    register()
    try:
        images = {level: render_level(level) for level in range(options.levels + 1)}
        rows = compare(images)
        facts = f"Blender {bpy.app.version_string}, {platform.machine()}, software rasteriser."
        write_page("resolution", page(rows, facts))
        write_results("resolution", rows)
        save_rows(images, IMAGES / "resolution.png")
    finally:
        unregister()


if __name__ == "__main__":
    main()
