# SPDX-License-Identifier: GPL-3.0-or-later
"""Viewport draws without a window, and the nodes that a material draws with."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable

import bpy
from rig import Rig


def drawer(rig: Rig, pixels: int) -> Callable[[], float]:
    """Return a function that draws once into a viewport and returns the CPU seconds it took.

    Args:
        rig: The scene, seen through its camera.
        pixels: Size of the viewport, each way.
    """
    import gpu  # late: only Blender 5.2 can draw without a window

    gpu.init()
    rig.scene.eevee.taa_samples = 1
    area = next(a for s in bpy.data.screens for a in s.areas if a.type == "VIEW_3D")
    space = area.spaces.active
    space.shading.type = "RENDERED"
    space.overlay.show_overlays = False
    region = next(region for region in area.regions if region.type == "WINDOW")
    target = gpu.types.GPUOffScreen(pixels, pixels, format="RGBA16F")
    view = rig.camera.matrix_world.inverted()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    lens = rig.camera.calc_matrix_camera(depsgraph, x=pixels, y=pixels)
    turns = itertools.count()

    def draw() -> float:
        # A view that stands still is not drawn again, so each is a hair beside the last.
        view.translation.x = 1e-5 * next(turns)
        start = time.process_time()
        target.draw_view3d(
            rig.scene, bpy.context.view_layer, space, region, view, lens, do_color_management=False
        )
        with target.bind():  # reading a pixel waits for the drawing to end
            gpu.state.active_framebuffer_get().read_color(0, 0, 1, 1, 4, 0, "FLOAT")
        return time.process_time() - start

    return draw


def node_types(tree: bpy.types.ShaderNodeTree) -> list[str]:
    """Return the types of the nodes of a tree and of its groups, each time they are used."""
    found = []
    for node in tree.nodes:
        if node.type == "GROUP":
            found += node_types(node.node_tree)
        elif node.type not in {"GROUP_INPUT", "GROUP_OUTPUT"}:
            found.append(node.type)
    return found
