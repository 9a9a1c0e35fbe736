# SPDX-License-Identifier: GPL-3.0-or-later
"""The look-up table in rendered EEVEE pixels: writes results/lut.md and data/lut.json.

    ./dev python tests/benchmarks/lut.py            about five minutes on two cores

Every variant (size, storage, mapping of the axes, filter, projection) shades one square of a
picture. Across a square the cosine is swept, up it sigma, both crowded where f bends; the pixels
are compared with the model in float64 at the same arguments, which are rendered too, to be sure.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "support")]

import bpy  # noqa: E402  (the checkout must be importable first)
import numpy as np  # noqa: E402
from machine import machine  # noqa: E402
from numpy.typing import NDArray  # noqa: E402
from rig import Rig  # noqa: E402
from tolerances import SHADER  # noqa: E402

from cdrf_addon.blender.nodes.tree import TreeBuilder  # noqa: E402
from cdrf_addon.compat import ensure_node_tree  # noqa: E402
from cdrf_addon.core.reflectance.lut import (  # noqa: E402
    DEFAULT_LAYOUT,
    SIGMA_MAX,
    LutLayout,
    build_lut,
    sample_lut,
)
from cdrf_addon.core.reflectance.models import (  # noqa: E402
    RING,
    SKIN_PROFILE,
    SPHERE,
    Model,
    Profile,
    profile,
    ring,
    sphere,
)

Values = NDArray[np.float64]
Wire = Callable[[TreeBuilder, Any, Any], Any]
DOCS = ROOT / "docs" / "results"
PIXELS = 160
"""Side of a square."""
SQUARES = (8, 5)
"""Squares in a picture."""
# The film is half float: a value is written as floor and fraction of SPLIT times itself, exact to
# 2^-11 / SPLIT = 5e-7 of the span that covers a cubic filter's overshoot too.
SPLIT, LOW, SPAN = 1024.0, -1.1, 2.2
ARGUMENT_ERROR = 3e-6
GOAL_MS = 50.0
MODELS = {SPHERE: sphere(), RING: ring()}
SIZES = (
    *((64, 32), (128, 64), (192, 128), (160, 160), (192, 160), (160, 192), (192, 192)),
    *((256, 128), (256, 160), (256, 192), (256, 256), (512, 256)),
)
MAPPING_SIZES = ((128, 64), (192, 192), (512, 256))
FILTER_SIZES = ((192, 192), (512, 256))
LOG_KNEE = 0.05


@dataclass(frozen=True)
class Mapping:
    """One axis of the table: the shader's nodes, and the values at the texels."""

    name: str
    nodes: Callable[[TreeBuilder, Any], Any]
    inverse: Callable[[Values], Values]


def _angle(b: TreeBuilder, cosine: Any) -> Any:
    """1 - 2 theta / pi, from -1 to 1."""
    return b.math("MULTIPLY_ADD", b.math("ARCCOSINE", cosine), -2.0 / math.pi, 1.0)


def _signed_root(b: TreeBuilder, cosine: Any) -> Any:
    root = b.math("SQRT", b.math("ABSOLUTE", cosine))
    return b.math("MULTIPLY", root, b.math("SIGN", cosine))


def _log(b: TreeBuilder, sigma: Any) -> Any:
    grown = b.math("MULTIPLY_ADD", sigma, 1.0 / LOG_KNEE, 1.0)
    scale = 1.0 / math.log1p(SIGMA_MAX / LOG_KNEE)
    return b.math("MULTIPLY", b.math("LOGARITHM", grown, math.e), scale)


def _root(b: TreeBuilder, sigma: Any) -> Any:
    return b.math("SQRT", b.math("MULTIPLY", sigma, 1.0 / SIGMA_MAX))


ROOT_COSINE, ROOT_SIGMA = "sign(c) √\\|c\\|", "√σ"
COLUMNS = {
    mapping.name: mapping
    for mapping in (
        Mapping(ROOT_COSINE, _signed_root, lambda q: np.sign(q) * q**2),
        Mapping("c", lambda _, cosine: cosine, lambda q: q),
        Mapping("θ", _angle, lambda q: np.cos((1.0 - q) * math.pi / 2.0)),
    )
}
ROWS = {
    mapping.name: mapping
    for mapping in (
        Mapping(ROOT_SIGMA, _root, lambda w: SIGMA_MAX * w**2),
        Mapping("σ", lambda b, s: b.math("MULTIPLY", s, 1.0 / SIGMA_MAX), lambda w: SIGMA_MAX * w),
        Mapping(
            "log(1 + 20 σ)",
            _log,
            lambda w: LOG_KNEE * np.expm1(w * math.log1p(SIGMA_MAX / LOG_KNEE)),
        ),
    )
}


@dataclass(frozen=True)
class Variant:
    """One way to make and to read a table."""

    width: int = DEFAULT_LAYOUT.width
    height: int = DEFAULT_LAYOUT.height
    storage: str = "float"
    columns: str = ROOT_COSINE
    rows: str = ROOT_SIGMA
    filter: str = "Linear"
    projection: str = "TUBE"

    @property
    def layout(self) -> LutLayout:
        """Texels, and how the axes lie on them."""
        return LutLayout(self.width, self.height)

    @property
    def kib(self) -> float:
        """Four channels in the .blend and on the graphics card."""
        return self.width * self.height * 4 * (4 if self.storage == "float" else 2) / 1024

    def table(self, model: Model) -> NDArray[np.float32]:
        """Tabulate a model."""
        layout = self.layout
        u = (np.arange(layout.width) + 0.5) / layout.width
        q = np.clip((1.0 - 2.0 * u) / layout.seam_factor, -1.0, 1.0)
        w = np.arange(layout.height) / (layout.height - 1.0)
        theta = np.arccos(np.clip(COLUMNS[self.columns].inverse(q), -1.0, 1.0))
        sigma = ROWS[self.rows].inverse(w)
        return model.evaluate(theta[None, :], sigma[:, None]).astype(np.float32)

    def nodes(self, b: TreeBuilder, image: bpy.types.Image, cosine: Any, sigma: Any) -> Any:
        """Wire the look-up; the socket of its red channel."""
        layout = self.layout
        q = COLUMNS[self.columns].nodes(b, cosine)
        w = ROWS[self.rows].nodes(b, sigma)
        v = b.math("MULTIPLY_ADD", w, layout.row_scale, layout.row_offset)
        if self.projection == "TUBE":
            p = b.math("MULTIPLY", q, math.pi * layout.seam_factor)
            across = b.math("MULTIPLY_ADD", b.math("SINE", p), 0.5, 0.5)
            along = b.math("MULTIPLY_ADD", b.math("COSINE", p), 0.5, 0.5)
            place = b.combine(across, along, v)
        else:
            u = b.math("MULTIPLY_ADD", q, -0.5 * layout.seam_factor, 0.5)
            place = b.combine(u, v, 0.0)
        texture = b.node(
            "ShaderNodeTexImage",
            image=image,
            projection=self.projection,
            interpolation=self.filter,
            extension="EXTEND",
        )
        b.feed(texture.inputs["Vector"], place)
        value = b.node("ShaderNodeSeparateColor")
        b.feed(value.inputs["Color"], texture.outputs["Color"])
        return value.outputs["Red"]


def variants() -> list[Variant]:
    """Every size with either storage; the mappings and the filters at some sizes."""
    found = [Variant(w, h, storage) for (w, h), storage in product(SIZES, ("float", "half"))]
    found += [
        Variant(w, h, columns=columns, rows=rows)
        for (w, h), columns, rows in product(MAPPING_SIZES, COLUMNS, ROWS)
    ]
    filters, projections = ("Linear", "Cubic", "Closest"), ("TUBE", "FLAT")
    found += [
        Variant(w, h, filter=name, projection=projection)
        for (w, h), name, projection in product(FILTER_SIZES, filters, projections)
    ]
    return list(dict.fromkeys(found))


def arguments() -> tuple[Values, Values]:
    """Cosine across and sigma up a square, (PIXELS,) each: what `sweep` makes of pixel centres."""
    centre = (np.arange(PIXELS) + 0.5) / PIXELS
    return np.clip(1.02 * (2.0 * centre - 1.0), -1.0, 1.0) ** 3, SIGMA_MAX * centre**3


def sweep(b: TreeBuilder) -> tuple[Any, Any]:
    """Wire both arguments from the square's texture coordinates; the ends are whole columns."""
    u, v, _ = b.separate(b.node("ShaderNodeTexCoord").outputs["UV"])
    wide = b.math("MULTIPLY_ADD", u, 2.04, -1.02)
    wide = b.math("MAXIMUM", -1.0, b.math("MINIMUM", 1.0, wide))
    cube = b.math("MULTIPLY", b.math("MULTIPLY", wide, wide), wide)
    sigma = b.math("MULTIPLY", b.math("MULTIPLY", v, v), b.math("MULTIPLY", v, SIGMA_MAX))
    return cube, sigma


def material(wire: Wire) -> bpy.types.Material:
    """Make a material that emits floor and fraction of what `wire` makes of the arguments."""
    made = bpy.data.materials.new("Square")
    tree = ensure_node_tree(made)
    tree.nodes.clear()
    b = TreeBuilder(tree)
    scaled = b.math("MULTIPLY_ADD", wire(b, *sweep(b)), SPLIT / SPAN, -LOW * SPLIT / SPAN)
    emission = b.node("ShaderNodeEmission")
    parts = b.combine(b.math("FLOOR", scaled), b.math("FRACT", scaled), 0.0)
    b.feed(emission.inputs["Color"], parts)
    output = b.node("ShaderNodeOutputMaterial")
    tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])
    return made


def image_of(variant: Variant, table: NDArray[np.float32]) -> bpy.types.Image:
    """Hand a table to Blender, as blender/image.py does."""
    width, height = variant.width, variant.height
    image = bpy.data.images.new("Table", width, height, float_buffer=True, is_data=True)
    image.use_half_precision = variant.storage == "half"
    image.alpha_mode = "CHANNEL_PACKED"
    pixels = np.ones((height, width, 4), dtype=np.float32)
    pixels[..., :3] = table[..., None]
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()
    return image


def render(wires: Sequence[Wire]) -> list[Values]:
    """Render a square for each wiring, one picture for all; the values, (PIXELS, PIXELS) each."""
    across, up = SQUARES
    assert len(wires) <= across * up
    rig = Rig(ortho_scale=float(max(SQUARES)))
    rig.scene.render.resolution_x, rig.scene.render.resolution_y = across * PIXELS, up * PIXELS
    rig.camera.location = (across / 2.0, -10.0, up / 2.0)
    for number, wire in enumerate(wires):
        row, column = divmod(number, across)
        bpy.ops.mesh.primitive_plane_add(
            size=1.0, location=(column + 0.5, 0.0, row + 0.5), rotation=(math.pi / 2.0, 0.0, 0.0)
        )
        bpy.context.object.data.materials.append(material(wire))
    picture = rig.render()
    value = (picture[..., 0] + picture[..., 1]) / SPLIT * SPAN + LOW
    squares = value.reshape(up, PIXELS, across, PIXELS).swapaxes(1, 2)
    return list(squares.reshape(-1, PIXELS, PIXELS)[: len(wires)])


def check_arguments() -> float:
    """Render the arguments themselves; the largest difference to what `arguments` says."""
    cosine, sigma = arguments()
    seen = render([lambda _, c, s: c, lambda b, c, s: b.math("MULTIPLY", s, 1.0 / SIGMA_MAX)])
    worst = max(
        float(np.abs(seen[0] - cosine[None, :]).max()),
        float(np.abs(seen[1] - sigma[:, None] / SIGMA_MAX).max()),
    )
    assert worst <= ARGUMENT_ERROR, f"The arguments are {worst:.1e} off."
    return worst


def milliseconds(call: Callable[[], Any], repeat: int = 5) -> float:
    """Least CPU time of a few runs."""
    times = []
    for _ in range(repeat):
        start = time.process_time()
        call()
        times.append(time.process_time() - start)
    return 1e3 * min(times)


def batches(items: list[Variant]) -> Iterator[list[Variant]]:
    """Part a list into what fits on a picture."""
    count = SQUARES[0] * SQUARES[1]
    for start in range(0, len(items), count):
        yield items[start : start + count]


def statistics(error: Values) -> dict[str, float]:
    """Worst pixel, and the RMS over a sphere lit from the camera at the worst sigma of all."""
    cosine, _ = arguments()
    # Such a sphere shows the cosine c on an area in proportion to c dc.
    share = np.maximum(cosine, 0.0) * np.gradient(cosine)
    on_sphere = np.sqrt(error**2 @ (share / share.sum()))
    return {"worst": float(np.abs(error).max()), "RMS": float(on_sphere.max())}


def _look_up(
    variant: Variant, table: NDArray[np.float32], b: TreeBuilder, cosine: Any, sigma: Any
) -> Any:
    # The image is made here, as `render` starts from an empty file.
    return variant.nodes(b, image_of(variant, table), cosine, sigma)


def measure(model: Model) -> list[dict[str, Any]]:
    """Render all variants of a model's table; a row of numbers for each."""
    cosine, sigma = arguments()
    exact = model.evaluate(np.arccos(cosine)[None, :], sigma[:, None])
    rows: list[dict[str, Any]] = []
    for batch in batches(variants()):
        wires = [partial(_look_up, variant, variant.table(model)) for variant in batch]
        for variant, seen in zip(batch, render(wires), strict=True):
            error = seen - exact
            spent = milliseconds(partial(variant.table, model))
            rows.append(
                {
                    **variant.__dict__,
                    "KiB": variant.kib,
                    **statistics(error),
                    "ms": spent,
                }
            )
        print(f"{model.key}: {len(rows)} variants", flush=True)
    assert np.array_equal(Variant().table(model), build_lut(model)), "not the table that ships"
    return rows


def ideal(model: Model) -> list[dict[str, Any]]:
    """Every size as sampled by `sample_lut`, at the same arguments: what no shader could better."""
    cosine, sigma = arguments()
    exact = model.evaluate(np.arccos(cosine)[None, :], sigma[:, None])
    rows = []
    for width, height in (*SIZES, (1024, 512)):
        layout = LutLayout(width, height)
        table = build_lut(model, layout)
        error = sample_lut(table, cosine[None, :], sigma[:, None] ** 2, layout) - exact
        rows.append(
            {
                "width": width,
                "height": height,
                **statistics(error),
                "ms": milliseconds(partial(build_lut, model, layout)),
            }
        )
    return rows


def generation() -> dict[str, float]:
    """Milliseconds to make the default table of each closed-form model."""
    part = 1.0 / 64.0
    many = Profile(tuple(0.1 * (n + 1) for n in range(64)), ((part, part, part),) * 64)
    models = {
        "Ring": ring(),
        "Sphere (the default)": sphere(),
        "Skin profile, six Gaussians on the sphere": profile(),
        "Skin profile, six Gaussians on the ring": profile(replace(SKIN_PROFILE, base=RING)),
        "Profile of 64 Gaussians, the most there may be": profile(many),
    }
    return {name: milliseconds(partial(build_lut, model)) for name, model in models.items()}


def pick(rows: list[dict[str, Any]], /, **wanted: Any) -> list[dict[str, Any]]:
    """Rows with these settings and the default's for what is not named."""
    settings = {**Variant().__dict__, **wanted}
    free = [name for name, value in settings.items() if value is None]
    fixed = {name: value for name, value in settings.items() if name not in free}
    return [row for row in rows if all(row[name] == value for name, value in fixed.items())]


def both(results: dict[str, Any], what: str = "worst", /, **wanted: Any) -> float:
    """The larger of the two models' numbers for one variant."""
    return max(float(pick(results[kind], **wanted)[0][what]) for kind in MODELS)


def sized(results: dict[str, Any]) -> list[tuple[float, float, float, Variant]]:
    """KiB, worst and RMS error of either model, and the variant, for every size and storage."""
    found = []
    for row in pick(results[SPHERE], width=None, height=None, storage=None):
        variant = Variant(row["width"], row["height"], row["storage"])
        errors = [both(results, what, **variant.__dict__) for what in ("worst", "RMS")]
        found.append((variant.kib, errors[0], errors[1], variant))
    return sorted(found, key=lambda item: item[:3])


def knee(results: dict[str, Any]) -> list[str]:
    """Say in words, from the numbers, which variant is the knee of the tables."""
    tables = sized(results)
    good = [item for item in tables if item[1] <= SHADER.worst and item[2] <= SHADER.rms]
    default = next(item for item in tables if item[3] == Variant())
    smaller = min((item for item in tables if item[0] < good[0][0]), key=lambda item: item[2])
    larger = max(tables)
    size: dict[str, Any] = {"width": Variant().width, "height": Variant().height}
    worst = partial(both, results, **size)
    maps = sorted(
        (worst(columns=columns, rows=rows), columns, rows)
        for columns, rows in product(COLUMNS, ROWS)
        if (columns, rows) != (ROOT_COSINE, ROOT_SIGMA)
    )

    def named(item: tuple[float, float, float, Variant]) -> str:
        return f"{item[3].width} × {item[3].height} {item[3].storage} ({item[0]:.0f} KiB)"

    first = "the default" if good[0] == default else f"not the default, {named(default)}"
    return [
        "The smallest table that keeps both models within what the shader may be off, a worst",
        f"pixel of {SHADER.worst:.0e} and an RMS of {SHADER.rms:.0e}, is **{named(good[0])}**,",
        f"{first}: {good[0][1]:.1e} and {good[0][2]:.1e}.",
        f"The best of the smaller ones, {named(smaller)},",
        f"has {smaller[1]:.1e} and {smaller[2]:.1e}; {named(larger)} takes",
        f"{larger[0] / default[0]:.1f} times the space for {larger[1]:.1e} and {larger[2]:.1e}.",
        "",
        f"At the default's size, half floats are {worst(storage='half'):.1e} off. Of the other",
        f"mappings the best (columns {maps[0][1]}, rows {maps[0][2]}) is {maps[0][0]:.1e} off, the",
        f"plainest (c and σ) {worst(columns='c', rows='σ'):.1e}. Flat projection makes",
        f"{worst(projection='FLAT'):.1e} of the same texels, as it reads coarser mip levels; Cubic",
        f"makes {worst(filter='Cubic'):.1e}, as it rounds the kink of Lambert off; Closest",
        f"{worst(filter='Closest'):.1e}.",
    ]


def table_of(head: list[str], rows: list[list[str]]) -> list[str]:
    """Write a table."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return [*lines, *("| " + " | ".join(row) + " |" for row in rows), ""]


def page(results: dict[str, Any]) -> str:
    """Write the page."""
    facts = ", ".join(f"{name} {value}" for name, value in results["machine"].items())
    cosine, sigma = arguments()
    lines = [
        "# The look-up table in rendered pixels",
        "",
        "Generated by `tests/benchmarks/lut.py`; do not edit.",
        "",
        f"Measured on: {facts}; EEVEE on a software rasteriser. CPU milliseconds, least of five.",
        "",
        f"Each number is of {PIXELS} × {PIXELS} pixels whose shader looked up cos θ from -1 to 1",
        f"and σ from {sigma[0]:.0e} to {sigma[-1]:.2g}, both swept as a cube: half of the pixels",
        f"have \\|cos θ\\| < {abs(cosine[PIXELS // 4]):.2f}, half σ < {sigma[PIXELS // 2]:.2f}.",
        "They are compared with the model in float64 at the same arguments. The RMS is that of a",
        "sphere lit from the camera, at the worst σ of all.",
        "The pixels are read to 1e-6, past the half-float film; the arguments,",
        f"rendered the same way, were within {results['arguments']:.0e}.",
        "",
        "## The knee",
        "",
        *knee(results),
        "",
        "On a rendered sphere, through the whole of the shader, the value stays within",
        f"{SHADER.worst:.0e} (RMS {SHADER.rms:.0e}) at σ from 0 to 30, with either model, and with",
        "the skin profile at σ up to 1: `tests/render/test_sphere.py`.",
        "",
        *_rendered(results),
        *_computed(results),
    ]
    return "\n".join(lines)


def _rendered(results: dict[str, Any]) -> list[str]:
    lines = [
        "## Size and storage",
        "",
        f"Columns {ROOT_COSINE}, rows {ROOT_SIGMA}, tube projection, linear filter.",
        "",
    ]
    head = ["texels", "storage", "KiB", *_heads("worst"), *_heads("RMS"), *_heads("ms")]
    lines += table_of(head, _rows(results, ("storage",), width=None, height=None, storage=None))
    lines += [
        "## Mapping of the axes",
        "",
        "Float, tube projection, linear filter.",
        "",
    ]
    head = ["texels", "columns", "rows", *_heads("worst"), *_heads("RMS")]
    free = dict.fromkeys(("width", "height", "columns", "rows"))
    lines += table_of(head, _rows(results, ("columns", "rows"), MAPPING_SIZES, **free))
    lines += [
        "## Filter and projection",
        "",
        f"Float, columns {ROOT_COSINE}, rows {ROOT_SIGMA}.",
        "",
    ]
    head = ["texels", "filter", "projection", *_heads("worst"), *_heads("RMS")]
    free = dict.fromkeys(("width", "height", "filter", "projection"))
    rows = _rows(results, ("filter", "projection"), FILTER_SIZES, **free)
    lines += table_of(head, rows)
    lines += [
        "Left out, as the tables above leave no doubt: other mappings with half floats, with other",
        "filters or in flat projection; mappings and filters at the sizes that are not in their",
        "table; and 1024 × 512, which is only sampled in numpy below.",
        "",
    ]
    return lines


def _computed(results: dict[str, Any]) -> list[str]:
    lines = [
        "## The same table sampled by an ideal bilinear filter",
        "",
    ]
    head = ["texels", *_heads("worst"), *_heads("RMS"), *_heads("ms")]
    pairs = zip(*(results["ideal"][kind] for kind in MODELS), strict=True)
    rows = [
        [f"{p[0]['width']} x {p[0]['height']}", *_numbers(p, ("worst", "RMS", "ms"))] for p in pairs
    ]
    lines += table_of(head, rows)
    lines += [
        "## Generation",
        "",
        f"The default table, {Variant().width} x {Variant().height}.",
        "",
    ]
    made = [[name, f"{spent:.0f}"] for name, spent in results["generation"].items()]
    lines += table_of(["model", "CPU ms"], made)
    slow = [name for name, spent in results["generation"].items() if spent > GOAL_MS]
    verdict = f"All but these are within the goal of {GOAL_MS:.0f} ms: {', '.join(slow)}."
    lines += [verdict if slow else f"All are within the goal of {GOAL_MS:.0f} ms.", ""]
    return lines


def _heads(what: str) -> list[str]:
    return [f"{what}, {kind.lower()}" for kind in MODELS]


def _numbers(pair: tuple[dict[str, Any], ...], names: tuple[str, ...]) -> list[str]:
    return [
        f"{row[name]:.0f}" if name == "ms" else f"{row[name]:.1e}" for name in names for row in pair
    ]


def _rows(
    results: dict[str, Any],
    shown: tuple[str, ...],
    sizes: tuple[tuple[int, int], ...] = SIZES,
    **free: Any,
) -> list[list[str]]:
    rows = []
    pairs = zip(*(pick(results[kind], **free) for kind in MODELS), strict=True)
    order = sorted(pairs, key=lambda pair: (pair[0]["width"], pair[0]["height"]))
    for pair in order:
        first = pair[0]
        if (first["width"], first["height"]) not in sizes:
            continue
        default = all(first[name] == value for name, value in Variant().__dict__.items())
        texels = f"{first['width']} x {first['height']}"
        row = [f"**{texels}**" if default else texels, *(str(first[name]) for name in shown)]
        if "storage" in shown:
            row += [f"{first['KiB']:.0f}", *_numbers(pair, ("worst", "RMS", "ms"))]
        else:
            row += _numbers(pair, ("worst", "RMS"))
        rows.append(row)
    return rows


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write-only", action="store_true", help="from the JSON of the last run")
    data = DOCS / "data" / "lut.json"
    if parser.parse_args().write_only:
        results = json.loads(data.read_text())
    else:
        results = {"machine": machine(), "arguments": check_arguments(), "generation": generation()}
        results["ideal"] = {kind: ideal(model) for kind, model in MODELS.items()}
        results |= {kind: measure(model) for kind, model in MODELS.items()}
        data.write_text(json.dumps(results, indent=1) + "\n")
    (DOCS / "lut.md").write_text(page(results))


if __name__ == "__main__":
    main()
