# SPDX-License-Identifier: GPL-3.0-or-later
"""Take the pictures of the panel that the guide shows, in a window of Blender's own.

    blender --factory-startup --window-geometry 0 0 1600 1000 --python tools/panel_pictures.py
    (options after `--`: --output FOLDER, default docs/guide/images)

Needs Blender 5.2 LTS in the corner of an X11 screen, a virtual one too, ImageMagick's `import`, and
libigl and scipy in that Blender's Python. The script opens the human head, presses Make
Translucent, opens the CDRF tab of the sidebar and saves what it sees:

    panel.png         the panel, up to date
    panel_update.png  the panel's foot after a light was added
    window.png        the 3D View in EEVEE beside the panel
"""

from __future__ import annotations

import argparse
import math
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
HEAD = ROOT / "tests" / "data" / "human_head.obj"
# The head's unit is the decimetre (tests/data/README.md).
HEAD_SCALE = 0.1
# Seconds that the window gets to draw after a step; the first EEVEE frame compiles its shaders.
REDRAW = 2.0
FIRST_FRAME = 60.0
# The window's picture is halved, and what surrounds the head cut off, so that it stays small.
SHRINK = 2
CUT_LEFT = 0.28
CUT_BELOW = 0.12


def head_scene() -> bpy.types.Object:
    """Replace the start-up scene by the head under a key and a rim light."""
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    bpy.ops.wm.obj_import(filepath=str(HEAD))
    head = bpy.context.selected_objects[0]
    head.name = "Head"
    head.scale = (HEAD_SCALE,) * 3
    bpy.ops.object.transform_apply(location=False, rotation=True, scale=True)
    bpy.ops.object.shade_smooth()
    head.modifiers.new("Subdivision", "SUBSURF").levels = 1
    for name, energy, angles in (("Key", 3.0, (45, 0, 25)), ("Rim", 2.0, (70, 0, 215))):
        light = bpy.data.lights.new(name, "SUN")
        light.energy = energy
        lamp = bpy.data.objects.new(name, light)
        lamp.rotation_euler = [math.radians(angle) for angle in angles]
        bpy.context.collection.objects.link(lamp)
    bpy.context.scene.world.node_tree.nodes["Background"].inputs[1].default_value = 0.3
    bpy.context.view_layer.objects.active = head
    head.select_set(True)
    return head


def view() -> tuple[bpy.types.Window, bpy.types.Area]:
    """Return the window and its 3D View."""
    window = bpy.context.window_manager.windows[0]
    return window, next(area for area in window.screen.areas if area.type == "VIEW_3D")


def in_view(action: Callable[..., object], **options: Any) -> None:
    """Call an operator as if it were chosen in the 3D View."""
    window, area = view()
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        action(**options)


def open_panel() -> None:
    """Fill the window with a rendered 3D View and open the sidebar's CDRF tab."""
    _, area = view()
    space = area.spaces.active
    space.show_region_ui = True
    space.show_region_toolbar = False
    space.show_gizmo = space.overlay.show_overlays = False
    space.shading.type = "RENDERED"
    space.lens = 85.0
    in_view(bpy.ops.view3d.view_axis, type="FRONT")
    in_view(bpy.ops.view3d.view_orbit, angle=math.radians(25), type="ORBITLEFT")
    in_view(bpy.ops.view3d.view_selected)


def choose_tab() -> None:
    """Bring the CDRF tab to the front; it exists once the sidebar was drawn."""
    _, area = view()
    sidebar(area).active_panel_category = "CDRF"
    area.tag_redraw()


def sidebar(area: bpy.types.Area) -> bpy.types.Region:
    """Return the region of the sidebar."""
    return next(region for region in area.regions if region.type == "UI")


def screenshot() -> np.ndarray:
    """Return the screen's pixels, (height, width, 4), row 0 at the bottom.

    By ImageMagick, as Blender's own screenshot is black on a virtual screen.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "screen.png"
        subprocess.run(["import", "-window", "root", str(path)], check=True)
        image = bpy.data.images.load(str(path))
        width, height = image.size
        pixels = np.empty(width * height * 4, np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)


def cut(pixels: np.ndarray, region: Any) -> np.ndarray:
    """Cut a region or an area out of the window's pixels."""
    return pixels[region.y : region.y + region.height, region.x : region.x + region.width]


def trim_below(pixels: np.ndarray) -> np.ndarray:
    """Cut off the empty rows under the panel, but for a margin."""
    middle = pixels[:, 12 : -(pixels.shape[1] // 5), :3]
    filled = np.flatnonzero(np.ptp(middle, axis=1).max(axis=1) > 0.05)
    return pixels[max(int(filled[0]) - 12, 0) :] if len(filled) else pixels


def save(pixels: np.ndarray, path: Path) -> None:
    """Write pixels as an opaque 8-bit PNG."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.new("panel", width, height)
    pixels = np.ascontiguousarray(pixels)
    pixels[..., 3] = 1.0
    image.pixels.foreach_set(pixels.ravel())
    image.filepath_raw, image.file_format = str(path), "PNG"
    image.save(quality=100)
    bpy.data.images.remove(image)
    print(f"{path}: {width} x {height}, {path.stat().st_size / 1000:.0f} kB")


def shrunk(pixels: np.ndarray) -> np.ndarray:
    """Average squares of SHRINK pixels."""
    height, width = (size // SHRINK * SHRINK for size in pixels.shape[:2])
    squares = pixels[:height, :width].reshape(height // SHRINK, SHRINK, width // SHRINK, SHRINK, 4)
    return squares.mean(axis=(1, 3))


def session(output: Path) -> Iterator[float]:
    """Do one step after the other; yields the seconds that the window needs in between."""
    head = head_scene()
    bpy.ops.preferences.addon_enable(module="cdrf_addon")
    in_view(bpy.ops.screen.screen_full_area)
    yield REDRAW
    bpy.ops.cdrf.setup()
    bpy.ops.cdrf.preset(preset="SKIN2", with_color=True)
    open_panel()
    yield REDRAW
    choose_tab()
    yield FIRST_FRAME
    _, area = view()
    pixels = screenshot()
    save(trim_below(cut(pixels, sidebar(area))), output / "panel.png")
    window = cut(pixels, area)
    window = window[int(CUT_BELOW * area.height) :, int(CUT_LEFT * area.width) :]
    save(shrunk(window), output / "window.png")
    lamp = bpy.data.objects.new("Fill", bpy.data.lights.new("Fill", "SUN"))
    bpy.context.collection.objects.link(lamp)
    bpy.context.view_layer.objects.active = head
    yield REDRAW
    area.tag_redraw()
    yield REDRAW
    panel = trim_below(cut(screenshot(), sidebar(area)))
    save(panel[: panel.shape[0] // 3], output / "panel_update.png")


def main() -> None:
    """Start the session; it runs beside Blender's own event loop and quits at the end."""
    parser = argparse.ArgumentParser(prog="panel_pictures", description=__doc__.split("\n")[0])
    parser.add_argument("--output", type=Path, default=ROOT / "docs" / "guide" / "images")
    own = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    output = parser.parse_args(own).output.resolve()
    output.mkdir(parents=True, exist_ok=True)
    sys.path.insert(0, str(ROOT))
    steps = session(output)

    def step() -> float | None:
        try:
            return next(steps)
        except StopIteration:
            bpy.ops.wm.quit_blender()
        except Exception:  # noqa: BLE001 (a window without a person must not stay open)
            import traceback

            traceback.print_exc()
            bpy.ops.wm.quit_blender()
        return None

    bpy.app.timers.register(step, first_interval=REDRAW)


if __name__ == "__main__":
    main()
