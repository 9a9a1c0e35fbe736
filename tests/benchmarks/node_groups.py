# SPDX-License-Identifier: GPL-3.0-or-later
"""What the node group holds and costs, by lights and shadows: docs/results/node_groups.md.

    ./dev bench node_groups         half an hour on two cores; Blender 5.2

Viewport draws, interleaved: in each round every contender is drawn in turn, so that a drift of the
machine meets all alike. Ratios are to the Diffuse BSDF with the same lights. Times are CPU seconds
of all threads: a software rasteriser spends nothing else, and other jobs disturb them little.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import bpy
import numpy as np
from rig import Rig, cdrf_node, diffuse_material

from cdrf_addon import ids, register, unregister
from cdrf_addon.compat import ensure_node_tree

from .common.draws import drawer, node_types
from .common.files import write_page
from .common.machine import machine
from .common.markdown import facts, generated, table
from .common.pictures import image_of
from .common.timing import spread

PIXELS = 1024
GREY, RGB = (1.0, 1.0, 1.0), (1.0, 0.35, 0.2)
COUNTS = (1, 2, 4, 8, 16)
SHADOWED = (1, 2, 3, 4)


@dataclass
class Contender:
    """A material under some of the lights."""

    name: str
    material: bpy.types.Material
    lights: int
    """How many suns shine; without any, the picture of a world does."""
    shadows: bool = False
    nodes: int = 0
    """Nodes in all, those of nested groups counted each time they are used."""
    own: int = 0
    """Nodes in the group itself."""
    lookups: int = 0
    first: float = 0.0
    times: list[float] = field(default_factory=list)


def sky() -> bpy.types.World:
    """A world of one picture, bright above and coloured all round, without a sun."""
    width, height = 64, 32
    up = np.sin(np.linspace(-math.pi / 2, math.pi / 2, height))[:, None]
    round_ = np.linspace(0.0, 2.0 * math.pi, width)[None, :]
    pixels = np.ones((height, width, 4), dtype=np.float32)
    for channel in range(3):
        pixels[..., channel] = 0.6 + 0.3 * up + 0.2 * np.cos(round_ + 2.0 * channel)
    image = image_of("Sky", pixels)
    world = bpy.data.worlds.new("Sky")
    tree = ensure_node_tree(world)
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = image
    tree.links.new(texture.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    return world


class Stage:
    """One sphere, sixteen suns, and the contenders."""

    def __init__(self) -> None:
        self.rig = Rig()
        self.obj = self.rig.sphere(subdivisions=6)
        self.obj.scale = (1.0, 1.0, 1.001)  # not quite a sphere: the shader reads the attribute
        self.suns = [
            self.rig.light(
                "SUN",
                name=f"Sun {i}",
                energy=math.pi / (1 + i),
                angle=0.0,
                rotation=(0.5 + 0.11 * i, 0.0, 1.7 * i),
            )
            for i in range(max(COUNTS))
        ]
        self.black, self.sky = self.rig.scene.world, sky()

    def light(self, lights: int, *, shadows: bool) -> None:
        """Switch on the first few suns, or the sky in place of none."""
        self.rig.scene.world = self.black if lights else self.sky
        for number, sun in enumerate(self.suns):
            sun.hide_render = sun.hide_viewport = number >= lights
            sun.data.use_shadow = shadows

    def show(self, contender: Contender) -> None:
        """Make the scene a contender's."""
        self.light(contender.lights, shadows=contender.shadows)
        self.obj.data.materials.clear()
        self.obj.data.materials.append(contender.material)
        bpy.context.view_layer.update()

    def translucent(
        self,
        lights: int,
        ratio: Sequence[float],
        *,
        shadows: bool = False,
        edges: bool = False,
        model: str = "SPHERE",
    ) -> Contender:
        """Make a material with a shader group of its own for these lights."""
        material = bpy.data.materials.new("Translucent")
        kind = "coloured shadows" if edges else "shadows" if shadows else "no shadows"
        colour = "profile" if model == "PROFILE" else "grey" if ratio == GREY else "RGB"
        contender = Contender(f"CDRF, {colour}, {kind}", material, lights, shadows)
        self.show(contender)
        material.cdrf.model = model
        material.cdrf.shadows = "ON" if shadows else "OFF"
        material.cdrf.shadow_edges = edges
        assert bpy.ops.cdrf.setup() == {"FINISHED"}
        material.cdrf.sigma0 = 0.2
        material.cdrf.sigma0_ratio = ratio
        node = cdrf_node(self.obj)
        node.node_tree = tree = node.node_tree.copy()
        tree[ids.SCENE_KEY] = (
            f"benchmark {contender.name} {lights}"  # the next set-up leaves it alone
        )
        node.inputs[ids.SIGMA0].default_value = 0.2
        node.inputs[ids.SIGMA0_RATIO].default_value = ratio
        output = tree_output(material)
        material.node_tree.links.new(node.outputs[ids.SHADER], output.inputs["Surface"])
        if ids.THICKNESS in node.outputs and shadows:
            material.node_tree.links.new(node.outputs[ids.THICKNESS], output.inputs[ids.THICKNESS])
        inside = node_types(tree)
        contender.nodes, contender.own = len(inside), len(tree.nodes)
        contender.lookups = inside.count("TEX_IMAGE")
        return contender


def tree_output(material: bpy.types.Material) -> bpy.types.ShaderNode:
    """The output that EEVEE uses."""
    return material.node_tree.get_output_node("EEVEE")


def contenders(stage: Stage) -> list[Contender]:
    """All that is compared; the Diffuse BSDF under each number of lights comes first."""
    diffuse = diffuse_material()
    glow = bpy.data.materials.new("Emission")
    tree = ensure_node_tree(glow)
    tree.nodes.clear()
    emission = tree.nodes.new("ShaderNodeEmission")
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])
    scatter = bpy.data.materials.new("Subsurface")
    principled = next(
        node for node in ensure_node_tree(scatter).nodes if node.type == "BSDF_PRINCIPLED"
    )
    principled.inputs["Subsurface Weight"].default_value = 1.0
    found = [Contender("Emission", glow, n) for n in (1, 4)]
    found += [Contender("Diffuse", diffuse, n) for n in (0, *COUNTS)]
    found += [Contender("Diffuse", diffuse, n, True) for n in SHADOWED]
    found += [Contender("Principled, subsurface", scatter, n) for n in (1, 4)]
    found += [stage.translucent(n, ratio) for n in COUNTS for ratio in (GREY, RGB)]
    found += [stage.translucent(n, GREY, model="PROFILE") for n in (1, 4)]
    found.append(stage.translucent(0, RGB))
    found += [stage.translucent(n, RGB, shadows=True) for n in SHADOWED]
    found += [stage.translucent(n, RGB, shadows=True, edges=True) for n in (1, 3)]
    return found


def measure(rounds: int) -> None:
    """Draw all contenders in turn, several times, and write the page after each round."""
    stage = Stage()
    found = contenders(stage)
    draw = drawer(stage.rig, PIXELS)
    for contender in found:
        stage.show(contender)
        contender.first = draw()
        print(contender.name, contender.lights, f"first draw {contender.first:.1f} s", flush=True)
    for turn in range(rounds):
        for contender in found:
            stage.show(contender)
            draw()
            contender.times.append(draw())
        print(f"round {turn + 1} of {rounds}", flush=True)
        # Kept after each round, as a busy machine may not come to the last.
        write_page("node_groups", page(found))


def row(contender: Contender, base: Contender) -> list[str]:
    """One line of the table: medians, and the spread of the ratio over the draws."""
    ratios = np.array(contender.times) / np.array(base.times)
    middle, low, high = spread(ratios)
    own = f"{contender.own} / {contender.nodes}" if contender.own else ""
    return [
        str(contender.lights),
        contender.name if not contender.shadows or "CDRF" in contender.name else "Diffuse, shadows",
        own,
        str(contender.lookups or ""),
        f"{1e3 * float(np.median(contender.times)):.0f}",
        f"{middle:.2f} ({low:.2f} to {high:.2f})",
        f"{contender.first - base.first:+.1f}",
    ]


HEAD = """# What the node group holds and costs

{generated}

The group in a material holds one branch per light that shines, as many table look-ups in it as
there are different σ₀, and nodes for shadows only where shadows are on and the light casts one.
Nodes are given as *in the group itself / in all*, those of nested groups counted each time they are
used. A draw is one sample of {pixels} × {pixels} pixels in the viewport. Times are CPU
milliseconds of all threads, which on a software rasteriser is all the time there is; ratios are to
the Diffuse BSDF with the same lights, draw by draw (median, 10 % to 90 %). The last column is what
the first draw, with compilation, takes longer than that of the Diffuse BSDF. A profile has one
look-up for its three channels where lights have no size.

Measured on: {facts}; EEVEE on a software rasteriser.
"""
TABLE = [
    "lights",
    "material",
    "nodes",
    "look-ups",
    "CPU ms",
    "ratio to Diffuse",
    "first draw, s more",
]


def page(found: Sequence[Contender]) -> str:
    """Write the page."""
    bases = {(c.lights, c.shadows): c for c in found if c.name == "Diffuse"}

    def table_of(rows: Iterable[Contender]) -> list[str]:
        return table(TABLE, [row(one, bases[one.lights, one.shadows]) for one in rows])

    def pick(lights: int, words: str) -> Contender:
        return next(c for c in found if c.lights == lights and words in c.name)

    sentence = generated("node_groups")
    lines = [HEAD.format(pixels=PIXELS, generated=sentence, facts=facts(machine()))]
    lines += ["## Examples", "", "(a) one sun, grey σ₀; (b) three lights, RGB σ₀, shadows"]
    lines += [
        "without and with coloured edges; (c) a world's picture only, RGB σ₀. Without lights the"
    ]
    lines += ["world's bands 0 to 2 are damped per channel, each with a look-up.", ""]
    examples = [pick(1, "grey"), pick(3, "RGB, shadows"), pick(3, "coloured"), pick(0, "RGB")]
    lines += table_of(examples)
    lines += ["## Goals", "", *goals(pick), ""]
    plain = [c for c in found if not c.shadows]
    lines += ["## By number of lights, without shadows", ""]
    lines += table_of(sorted(plain, key=lambda c: c.lights))
    lines += ["## With shadows", ""]
    lines += table_of(sorted((c for c in found if c.shadows), key=lambda c: c.lights))
    return "\n".join(lines)


def goals(pick: Callable[[int, str], Contender]) -> list[str]:
    """Return which of the goals for the cost of a draw are met."""
    sentences = []
    for lights, most in ((1, 1.05), (4, 1.15)):
        base = np.array(pick(lights, "Diffuse").times)
        for words, what in (("RGB, no", "RGB, a look-up per channel"), ("profile", "RGB profile")):
            middle, low, high = spread(pick(lights, words).times / base)
            sentences.append(
                f"- {lights} light{'s' * (lights > 1)}, {what}: {middle:.2f} × Diffuse "
                f"({low:.2f} to {high:.2f}); at most {most}: {verdict(middle <= most)}."
            )
    for lights in (1, 4):
        glow = np.array(pick(lights, "Emission").times)
        above = [
            float(np.median(np.array(pick(lights, words).times) - glow))
            for words in ("RGB, no", "Principled")
        ]
        sentences.append(
            f"- Above plain Emission, {lights} light{'s' * (lights > 1)}: RGB {1e3 * above[0]:.0f} "
            f"ms, EEVEE's subsurface scattering {1e3 * above[1]:.0f} ms"
            + (f"; at most a tenth: {verdict(10.0 * above[0] <= above[1])}." * (lights == 1))
        )
    later = pick(4, "RGB, no").first - pick(4, "Diffuse").first
    sentences.append(
        f"- First draw, 4 lights, RGB: {later:+.1f} s against Diffuse; at most + 1 s: "
        f"{verdict(later <= 1.0)}."
    )
    return sentences


def verdict(met: bool) -> str:
    """Return whether a goal is met, in a word."""
    return "met" if met else "**not met**"


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=5)
    rounds = parser.parse_args().rounds
    register()
    try:
        measure(rounds)
    finally:
        unregister()


if __name__ == "__main__":
    main()
