# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders docs/results/kappa_choice.md from the results."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..common.markdown import escape, facts, generated, table
from ..common.rays import OPEN_MARGIN, SHADOW_OFFSET
from ..common.shapes import EXTENT
from .curvature import KINDS
from .fits import RULES, Rule, rule_name
from .kernels import KERNELS
from .measure import RESOLUTION_MOST, RESOLUTION_RULES
from .settings import ALBEDO, LIGHTS, MANY_BOUNCES, PLAIN, QUOTIENTS, RATIO, RECOMMENDED, STORED


def matrix(
    value: Callable[[str, str], float], rules: Sequence[Rule] = RULES, form: str = ".4f"
) -> list[str]:
    """Kinds down, rules across; the best of each matrix in bold."""
    names = [rule_name(rule) for rule in rules]
    numbers = {(kind, name): value(kind, name) for kind in KINDS for name in names}
    least_of_all = min(numbers.values())
    rows = []
    for kind in KINDS:
        cells = [
            f"**{numbers[kind, n]:{form}}**"
            if numbers[kind, n] == least_of_all
            else f"{numbers[kind, n]:{form}}"
            for n in names
        ]
        rows.append([escape(kind), *cells])
    return table(["kappa", *names], rows)


class Report:
    """Numbers derived from the results, and the page made of them."""

    def __init__(self, results: dict[str, Any]) -> None:
        self.results = results
        self.cases: list[str] = list(results["cases"])

    def relative(
        self, fits: dict[str, Any], kernel: str, kind: str, rule: str, field: str = "rmse"
    ) -> float:
        """RMSE as a part of Lambert's, mean over the cases."""
        parts = [
            fits[case][kernel][kind][rule][field] / self.results["cases"][case]["lambert"]
            for case in self.cases
        ]
        return float(np.mean(parts))

    def both(self, kind: str, rule: str, noise: str = "") -> float:
        """Mean over the two kernels."""
        fits = self.results["noise"][noise] if noise else self.results["fits"]
        return float(np.mean([self.relative(fits, kernel, kind, rule) for kernel in KERNELS]))

    def conclusions(self) -> list[str]:
        """Return sentences on what the numbers show."""
        best = [
            f"{kernel}: *{kind}* with {rule} ({error:.3f})"
            for kernel in KERNELS
            for error, kind, rule in [
                min(
                    (self.relative(self.results["fits"], kernel, kind, rule_name(rule)), kind, name)
                    for kind, rule in itertools.product(KINDS, RULES)
                    for name in [rule_name(rule)]
                )
            ]
        ]
        scores = {
            (kind, rule_name(rule)): self.both(kind, rule_name(rule))
            for kind, rule in itertools.product(KINDS, RULES)
        }
        ranked = sorted(scores, key=lambda pair: scores[pair])
        chosen = (RECOMMENDED[0], rule_name(("factor", RECOMMENDED[1])))
        raw = min(scores[kind, "raw"] for kind in KINDS if "√area" not in kind)
        fixed = min(scores[pair] for pair in ranked if pair[1].startswith("l = "))
        constant = float(
            np.mean(
                [
                    self.results["cases"][case]["constant"][kernel]["rmse"]
                    / self.results["cases"][case]["lambert"]
                    for case in self.cases
                    for kernel in KERNELS
                ]
            )
        )
        lines = [
            f"RMSE as a part of Lambert's, one slider, mean over cases and both kernels: best of "
            f"all is *{ranked[0][0]}* with {ranked[0][1]} ({scores[ranked[0]]:.3f}); the choice, "
            f"*{chosen[0]}* with l = {chosen[1]}, has {scores[chosen]:.3f} and is number "
            f"{ranked.index(chosen) + 1} of {len(ranked)}. The best raw curvature has {raw:.3f}, "
            f"the best of one fixed length {fixed:.3f}, one constant curvature {constant:.3f}.",
            f"By kernel the best are {'; '.join(best)}.",
        ]
        plain = min((pair for pair in ranked if pair[0] == PLAIN), key=lambda pair: scores[pair])
        for noise in self.results["noise"]:
            lines.append(
                f"Vertices moved by {100 * float(noise):g} % of an edge, slider left where it was: "
                f"the choice has {self.both(*chosen, noise=noise):.3f}, *{plain[0]}* with "
                f"{plain[1]} {self.both(*plain, noise=noise):.3f} (clean {scores[plain]:.3f}), "
                f"raw *{PLAIN}* {self.both(PLAIN, 'raw', noise=noise):.3f}."
            )
        for quotient in QUOTIENTS if "interpolation" in self.results else ():
            lost, apart = self.interpolation_loss(quotient)
            lines.append(
                f"{STORED} stored lengths a factor {quotient} apart lose at most {lost:.5f} of "
                f"RMSE and change the image by {apart:.5f} RMS at the most."
            )
        return lines

    def interpolation_loss(self, quotient: int) -> tuple[float, float]:
        """Worst loss and worst RMS change over the head's cases, kernels and sliders."""
        entries = [
            entry[str(quotient)]
            for case in self.results["interpolation"].values()
            for kernel in case.values()
            for entry in kernel.values()
        ]
        return max(e["lost"] for e in entries), max(e["difference"] for e in entries)

    def page(self) -> str:
        """Everything, as Markdown."""
        results = self.results
        lines = ["# Which curvature, and over which length", ""]
        lines += [generated("kappa_choice"), ""]
        lines += [f"Measured on: {facts(results['machine'])}.", "", "## Conclusions", ""]
        lines += [f"- {sentence}" for sentence in self.conclusions()]
        lines += ["", "## Method", "", *self.method(), "", "## Cases", ""]
        head = ["case", "vertices", "edge", "Lambert RMSE"]
        head += [f"constant κ, {kernel}" for kernel in KERNELS]
        rows = [
            [case, f"{c['vertices']:,}", f"{c['edge']:.4f}", f"{c['lambert']:.4f}"]
            + [f"{c['constant'][kernel]['rmse']:.4f}" for kernel in KERNELS]
            for case, c in results["cases"].items()
        ]
        lines += table(head, rows)
        lines += [
            f"- {case}, light {light}: {text}."
            for case, c in results["cases"].items()
            for light, text in c["pixels"].items()
        ]
        for field, title in (("rmse", "one slider"), ("rmse_channels", "each channel fitted")):
            for kernel in KERNELS:
                lines += ["", f"## {kernel}, {title}: RMSE / Lambert's, mean over the cases", ""]
                lines += matrix(
                    lambda kind, rule, kernel=kernel, field=field: self.relative(  # type: ignore[misc]
                        results["fits"], kernel, kind, rule, field
                    ),
                    form=".3f",
                )
        for kernel, case in itertools.product(KERNELS, self.cases):
            fits = results["fits"][case][kernel]
            lines += [f"## {kernel}, {case}: RMSE, one slider", ""]
            lines += matrix(lambda kind, rule, fits=fits: fits[kind][rule]["rmse"])  # type: ignore[misc]
        for kernel in KERNELS:
            joint = results["joint"][kernel]
            lines += [f"## {kernel}: one σ0 / scale for all cases, RMSE / Lambert's", ""]
            lines += matrix(
                lambda kind, rule, joint=joint: joint[kind][rule]["relative_rmse"],  # type: ignore[misc]
                form=".3f",
            )
            lines += [f"## {kernel}: fitted σ0 / scale by case, for the chosen rule", ""]
            chosen = rule_name(("factor", RECOMMENDED[1]))
            rows = []
            for kind in KINDS:
                found = [
                    results["fits"][case][kernel][kind][chosen]["sigma0"] for case in self.cases
                ]
                scales = [float(case.rsplit(" ", 1)[1]) for case in self.cases]
                each = [f"{f / s:.2f}" for f, s in zip(found, scales, strict=True)]
                rows.append(
                    [escape(kind), *each, f"{joint[kind][chosen]['sigma0_over_scale']:.2f}"]
                )
            lines += table(["kappa", *self.cases, "all"], rows)
        for kernel, (noise, errors) in itertools.product(KERNELS, results["noise"].items()):
            title = f"vertices moved by {100 * float(noise):g} % of an edge, slider unchanged"
            lines += [f"## {kernel}, {title}: RMSE / Lambert's", ""]
            lines += matrix(
                lambda kind, rule, kernel=kernel, errors=errors: self.relative(  # type: ignore[misc]
                    errors, kernel, kind, rule
                ),
                form=".3f",
            )
        tables = {
            "resolution": self.resolution_tables,
            "interpolation": self.interpolation_tables,
            "bounces": self.bounce_tables,
        }
        for part, make in tables.items():
            lines += make() if part in results else []
        return "\n".join(lines).rstrip() + "\n"

    def method(self) -> list[str]:
        """How it was measured."""
        size, samples = self.results["size"], self.results["samples"]
        return [
            f"References: Cycles, Random Walk subsurface scattering (node defaults but for colour "
            f"{ALBEDO:g} and radius {RATIO} · scale), one sun without angle, {size}² pixels, "
            f"{samples} samples and Open Image Denoise, world black, Raw, no light from surface "
            f"to surface. Shapes are subdivided twice and {EXTENT:g} units tall; both lights "
            f"({LIGHTS}, directions towards the sun, the camera looking along +Y) share one "
            "slider.",
            "",
            f"A pixel is the point in its middle: ray cast, normals and curvature interpolated "
            f"from the vertices. Left out: pixels in a cast shadow (N·L > 0, N interpolated, while "
            f"a ray to the sun from {SHADOW_OFFSET:g} along N hits anything) and pixels within "
            f"{OPEN_MARGIN:g} of an open rim (the head's neck). Pixels with N·L ≤ 0 all stay.",
            "",
            "RMSE is the mean of those of R, G and B; 1 is a white surface facing the sun; the "
            "gain is the albedo. Curvature: libigl, two rings. Diffusion: (M + l²L/2) x = M b, "
            "once, cotangent L, barycentric M; `c σ0` takes l = c · σ0 of each channel. `tensor`: "
            "the curvature tensor diffused as six world components, the number taken afterwards. "
            "`tensor over √area/n, curvedness`: the tensor diffused over that fixed length, its "
            "curvedness taken at the vertices, and that diffused like the others.",
        ]

    def resolution_tables(self) -> list[str]:
        """Change with the mesh's resolution."""
        names = [rule_name(rule) for rule in RESOLUTION_RULES]
        lines = [
            "## Head, curvature from another subdivision level, slider unchanged",
            "",
            "RMSE / RMSE at its own level (RMS change of the image), mean of cases and kernels; "
            f"lengths above {RESOLUTION_MOST:g} count as that.",
            "",
        ]
        rows = []
        for kind in KINDS:
            row = [escape(kind)]
            for level, name in itertools.product(self.results["resolution"].values(), names):
                entries = [
                    case[kernel][kind][name] for case in level.values() for kernel in KERNELS
                ]
                part = np.mean([e["rmse"] / e["rmse_own"] for e in entries])
                row.append(f"{part:.3f} ({np.mean([e['drift'] for e in entries]):.4f})")
            rows.append(row)
        levels = self.results["resolution"]
        head = [f"level {level}, {name}" for level, name in itertools.product(levels, names)]
        return lines + table(["kappa", *head], rows)

    def interpolation_tables(self) -> list[str]:
        """Loss by storing four lengths."""
        kind, factor = RECOMMENDED
        lines = [
            f"## Head, *{kind}*, l = {factor:g} σ0, from {STORED} stored lengths √area / qⁱ",
            "",
            "RMSE lost against exact diffusion (RMS change of the image), at parts and multiples "
            "of the fitted slider.",
            "",
        ]
        rows = []
        for case, kernels in self.results["interpolation"].items():
            for kernel, steps in kernels.items():
                for step, entry in steps.items():
                    cells = [
                        f"{entry[str(q)]['lost']:+.5f} ({entry[str(q)]['difference']:.5f})"
                        for q in QUOTIENTS
                    ]
                    row = [case, kernel, f"{step} × {entry['sigma0'] / float(step):.3f}"]
                    rows.append([*row, f"{entry['exact']:.4f}", *cells])
        head = ["case", "kernel", "σ0", "RMSE exact", *(f"q = {q}" for q in QUOTIENTS)]
        return lines + table(head, rows)

    def bounce_tables(self) -> list[str]:
        """The same choice against renders with light between surfaces."""
        lines: list[str] = []
        for case, found in self.results["bounces"].items():
            for kernel in KERNELS:
                fits = found[kernel]
                lines += [
                    f"## {kernel}, {case}, with {MANY_BOUNCES} bounces between surfaces",
                    "",
                    f"RMSE, one slider; Lambert has {found['lambert']:.4f}.",
                    "",
                ]
                lines += matrix(lambda kind, rule, fits=fits: fits[kind][rule]["rmse"])  # type: ignore[misc]
        return lines
