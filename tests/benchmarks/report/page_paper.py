# SPDX-License-Identifier: GPL-3.0-or-later
"""The report's part on the paper: its figures, its fit, and the claims of its section 5."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..common.markdown import table
from ..common.timing import spread
from .contenders import DEFAULT, LAMBERT, SHADOWS, SPHERE, TEXTURE
from .results import Results, with_spread
from .shapes import FIGURINE, HEAD
from .substances import PRESET_OF

# What the paper says: look-ups, "a few" operations, "almost" the cost, times faster.
LOOK_UPS, FEW_NODES, ALMOST, FASTER = 3, 20, 1.25, 10.0


def paper_part(results: Results) -> list[str]:
    """Fig. 1 to 4, and section 5."""
    if not results.paper:
        return []
    lines = [
        "## The paper again",
        "",
        "Kubo, Dobashi, Morishima: *Curvature-dependent reflectance function for "
        "interactive rendering of subsurface scattering*, HCI International 2011.",
        "",
    ]
    lines += [
        "### Fig. 1: the workflow",
        "",
        *results.image("figure1.png", "Mesh, curvature, look-up table, render"),
        "The table in 3 is the sphere model's. The two closed forms beside Lambert:",
        "",
        *results.image("lobes.svg", "Ring and sphere beside Lambert"),
    ]
    lines += _fit_part(results)
    lines += _head_part(results)
    lines += [
        "### Fig. 4: a second example, in hard light",
        "",
        f"The head as a figurine of {FIGURINE:g} mm, of the same skin: light goes a large "
        "part of the way through it.",
        "",
        *results.image("figure4.png", "A figurine of skin"),
        *_closest(
            results.paper.get("figure4", {}).get("rmse", {}),
            "RMSE from this one path-traced picture",
        ),
    ]
    return [*lines, *_claims_part(results)]


def _fit_part(results: Results) -> list[str]:
    part = results.paper.get("figure2")
    if not part:
        return []
    lines = [
        "### Fig. 2: spheres, and the fit",
        "",
        "Path-traced spheres of the skin, lit from the right; the ratio is red's scatter "
        "radius to the sphere's.",
        "",
        *results.image("figure2.png", "Path-traced spheres, lit from the right"),
        *results.image("figure2_fit.png", "Radiance over the angle, fits and residuals"),
    ]
    rows = []
    for row in part["rows"]:
        cells = [
            row["channel"],
            f"{row['albedo']:.2f}",
            f"{row['scale']:.3g}",
            f"{row['lambert']:.4f}",
        ]
        for name in ("ring", "sphere"):
            cells.append(f"{row[f'{name} fixed']['rms']:.4f}")
        for name in ("ring", "sphere"):
            free = row[f"{name} free"]
            cells += [f"{free['sigma']:.3f}", f"{free['gain']:.2f}", f"{free['rms']:.4f}"]
        rows.append([*cells, f"{row['noise']:.4f}"])
    lines += [
        "RMS residuals along the equator, of the albedo times the irradiance / π; `scale` "
        "is the channel's scatter radius over the sphere's.",
        "",
    ]
    lines += table(
        [
            "channel",
            "albedo",
            "scale",
            "Lambert",
            "ring, gain 1",
            "sphere, gain 1",
            "ring σ",
            "gain",
            "RMS",
            "sphere σ",
            "gain",
            "RMS",
            "noise",
        ],
        rows,
    )
    free = [row["lambert"] / max(row["ring free"]["rms"], 1e-9) for row in part["rows"]]
    fixed = [row["lambert"] / max(row["ring fixed"]["rms"], 1e-9) for row in part["rows"]]
    verdict = "holds" if min(free) > 1.0 else "does not hold everywhere"
    lines += [
        f"**The paper's fit {verdict} in shape:** with a free gain the ring is "
        f"{min(free):.1f} to {max(free):.1f} times closer than Lambert. With the gain at "
        f"1, which is how it is used, {min(fixed):.1f} to {max(fixed):.1f} times: a small "
        "sphere sends out more light than the form allows for.",
        "",
    ]
    return [*lines, *(f"- {sentence}" for sentence in part["sentences"]), ""]


def _head_part(results: Results) -> list[str]:
    part = results.paper.get("figure3")
    if not part:
        return []
    low, middle, high = (part["curvature"][name] for name in ("low", "median", "high"))
    return [
        "### Fig. 3: the human head",
        "",
        f"Life size ({HEAD:g} mm), one sun from the side, {PRESET_OF['skin']} (Jensen et "
        f"al. 2001): σ₀ = {', '.join(f'{s:g}' for s in part['sigma0 mm'])} mm. Curvature "
        f"from black, {low:.2g}, to white, {high:.2g} per unit (median {middle:.2g}); "
        f"{part['vertices']:,} vertices.",
        "",
        *results.image("figure3.png", "Curvature, Lambert, texture blurring, CDRF, Cycles"),
        *_strip_of(results, "head, skin, sun"),
    ]


def _strip_of(results: Results, cell: str) -> list[str]:
    """Errors of a figure's contenders in the matrix, in words."""
    rows = results.cells.get(cell, {}).get("contenders", {})
    usual = (LAMBERT, TEXTURE, SPHERE, SHADOWS, DEFAULT)
    names = [name for name in usual if "rmse" in rows.get(name, {})]
    if len(names) < 2:
        return []
    found = {name: rows[name]["rmse"]["all"] for name in names}
    return _closest(found, "RMSE in the scene of the matrix")


def _closest(errors: Mapping[str, float], words: str) -> list[str]:
    """Errors of a figure's contenders, and the least."""
    if not errors:
        return []
    phrases = ", ".join(f"{name} {value:.4f}" for name, value in errors.items())
    best = min(errors, key=lambda name: errors[name])
    return [f"{words}: {phrases}. Closest: {best}.", ""]


def _claims_part(results: Results) -> list[str]:
    sentences = claim_sentences(results)
    if not sentences:
        return []
    lines = ["### Section 5: what the paper claims", ""]
    lines += [f"- {sentence}" for sentence in sentences]
    work = results.paper["claims"]["arithmetic"]
    lines += [
        "",
        "The arithmetic of the same pixels, all in NumPy on one core, interleaved:",
        "",
    ]
    base = work["seconds"]["Lambert"]
    rows = []
    for name in ("Lambert", "CDRF", TEXTURE):
        seconds = work["seconds"][name]
        over = [a / max(b, 1e-6) for a, b in zip(seconds, base, strict=True)]
        reads = {"CDRF": work["look-ups"], "Texture blurring": work["taps"]}.get(name, 0)
        rows.append(
            [name, f"{reads:,}", f"{1e3 * float(np.median(seconds)):.1f}", with_spread(over, 1)]
        )
    lines += table(["", "table or texture reads", "ms", "ratio to Lambert"], rows)
    lines += [
        f"Texture blurring: {work['passes']} passes of 7 taps over {work['texels']:,} texels "
        f"(a map of {work['atlas']}²) for {work['pixels']:,} pixels; maps and shadows are "
        "not counted. It is the same work in the same language on the same processor, not "
        "a graphics card's: there the passes are bandwidth and run side by side. What "
        "carries over is the count of reads, and that it grows with the texels, not with "
        "the pixels.",
        "",
    ]
    return lines


def claim_sentences(results: Results) -> list[str]:
    """Each claim of section 5, confirmed or corrected."""
    if not results.paper.get("claims"):
        return []
    claims, found = results.paper["claims"], []
    found += _cost_sentence(results)
    nodes = claims["nodes"]["3 colours"]
    found.append(
        "*Three look-ups and a few operations*: the look-ups "
        f"{'confirmed' if nodes['look-ups'] == LOOK_UPS else 'corrected'}, the operations "
        f"{'confirmed' if nodes['nodes'] <= FEW_NODES else 'corrected'} (up to {FEW_NODES} counts "
        "as a few). One light takes "
        f"{nodes['look-ups']} look-ups among {nodes['nodes']} nodes, a light's settings and "
        "curvature at three lengths included; "
        f"{claims['nodes']['grey']['look-ups']} among {claims['nodes']['grey']['nodes']} where "
        "the colours scatter alike."
    )
    work = claims["arithmetic"]
    over = [
        a / max(b, 1e-6)
        for a, b in zip(work["seconds"]["Texture blurring"], work["seconds"]["CDRF"], strict=True)
    ]
    verdict = "confirmed" if spread(over)[0] > FASTER else "corrected"
    texel, pixel = work["taps"] / work["texels"], work["look-ups"] / work["pixels"]
    found.append(
        f"*More than 10 times faster than texture blurring*: {verdict} for the same "
        f"pixels in NumPy, {with_spread(over, 0)} times; by reads "
        f"{work['taps'] / work['look-ups']:.0f} times: {texel:g} a texel against {pixel:g} a "
        f"pixel, so it holds while the picture shows fewer than {texel / pixel / FASTER:.1f} "
        "pixels of the surface for a texel of it."
    )
    bare = claims["without UV"]
    verdict = (
        "confirmed" if not bare["uv maps"] and bare["light behind the terminator"] else "corrected"
    )
    found.append(
        f"*No UV needed*: {verdict}. A bunny with {bare['uv maps']} UV maps has light "
        "behind its terminator "
        f"(radiance up to {bare['light behind the terminator']:.3f})."
    )
    return found


def _cost_sentence(results: Results) -> list[str]:
    """What a draw costs beside Lambert's, in seconds of all cores: they waver less."""
    plain = results.ratio("draws", SPHERE, "draw", "cpu")
    if not plain:
        return []
    verdict = _almost(plain)
    part = results.timing["draws"]
    sentence = (
        f"*Almost the cost of Lambert*: {verdict}. A draw of {part['cell']} with one light, sphere "
        f"model, View Dependence off, costs {with_spread(plain)} times the Diffuse BSDF's where "
        f"the scene's shadows are switched off (up to {ALMOST:g} counts as almost)"
    )
    shadows = results.ratio("draws", SHADOWS, "draw", "cpu")
    if shadows:
        sentence += (
            f". With cast shadows, which the paper lacks: {_almost(shadows)}, "
            f"{with_spread(shadows)} times a draw of the Diffuse BSDF with shadows"
        )
    frames = results.timing.get("frames", {}).get("rows", {}).get(SHADOWS, {})
    most = max((count for count in frames if count.isdigit()), key=int, default="")
    over = results.ratio("frames", SHADOWS, most)
    if over:
        sentence += f"; of a final frame of {most} samples, {with_spread(over)} times"
    return [f"{sentence}."]


def _almost(ratios: Sequence[float]) -> str:
    return "confirmed" if spread(ratios)[0] <= ALMOST else "corrected"
