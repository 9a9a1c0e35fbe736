# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors of every variant in rendered pixels, of the ideal filter, and the time of generation."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdrf_addon.blender.nodes.tree import TreeBuilder
from cdrf_addon.core.reflectance.lut import (
    LutLayout,
    build_lut,
    sample_lut,
)
from cdrf_addon.core.reflectance.model import RING, Model, ring, sphere
from cdrf_addon.core.reflectance.profile import SKIN_PROFILE, Profile, profile

from ..common.timing import least_cpu_milliseconds
from .render import arguments, batches, image_of, render
from .variants import SIZES, Values, Variant, variants


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
            spent = least_cpu_milliseconds(partial(variant.table, model))
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
                "ms": least_cpu_milliseconds(partial(build_lut, model, layout)),
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
    return {
        name: least_cpu_milliseconds(partial(build_lut, model)) for name, model in models.items()
    }
