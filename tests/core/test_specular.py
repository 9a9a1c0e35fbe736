# SPDX-License-Identifier: GPL-3.0-or-later
"""What a glossy coat keeps from the surface under it, against numerical integration of GGX."""

from __future__ import annotations

import numpy as np
import pytest

from cdrf_addon.core.reflectance.specular import dielectric_f0, specular_albedo


def albedo(cosine: float, roughness: float, f0: float, steps: int = 200) -> float:
    """Integrate GGX with Smith's correlated masking and Schlick's Fresnel over its half vectors."""
    alpha = max(roughness**2, 1e-3)
    view = np.array([np.sqrt(1.0 - cosine**2), 0.0, cosine])
    u = (np.arange(steps) + 0.5) / steps
    part, around = np.meshgrid(u, 2.0 * np.pi * u, indexing="ij")
    up = np.sqrt((1.0 - part) / (1.0 + (alpha**2 - 1.0) * part))
    out = np.sqrt(1.0 - up**2)
    half = np.stack((out * np.cos(around), out * np.sin(around), up), axis=-1)
    along = half @ view
    light = 2.0 * along[..., None] * half - view
    above = light[..., 2]

    def smith(c: np.ndarray) -> np.ndarray:
        c = np.maximum(c, 1e-6)
        return (np.sqrt(1.0 + alpha**2 * (1.0 - c**2) / c**2) - 1.0) / 2.0

    masking = 1.0 / (1.0 + smith(np.full_like(above, cosine)) + smith(above))
    fresnel = f0 + (1.0 - f0) * (1.0 - np.clip(along, 0.0, 1.0)) ** 5
    weight = np.where((above > 0.0) & (along > 0.0), masking * along / (cosine * up) * fresnel, 0.0)
    return float(weight.mean())


def test_fit_against_integration() -> None:
    errors = {}
    for cosine in (0.05, 0.1, 0.2, 0.4, 0.7, 1.0):
        for roughness in (0.1, 0.3, 0.5, 0.8, 1.0):
            for f0 in (0.03, 0.04, 0.08):
                fit = float(specular_albedo(cosine, roughness, f0))
                errors[cosine, roughness, f0] = fit - albedo(cosine, roughness, f0)
    values = np.array(list(errors.values()))
    facing = np.array([error for (cosine, *_), error in errors.items() if cosine >= 0.2])
    print(f"worst {np.abs(values).max():.4f}, facing {np.abs(facing).max():.4f}")
    # Nearly mirrors seen edge on, where the albedo itself is 0.7.
    assert np.abs(values).max() <= 0.06
    assert np.abs(facing).max() <= 0.016
    assert np.sqrt((values**2).mean()) <= 0.015


def test_limits() -> None:
    assert dielectric_f0(1.5) == pytest.approx(0.04)
    assert dielectric_f0(1.0) == 0.0 and dielectric_f0(1.5, 0.0) == 0.0
    assert specular_albedo(0.01, 0.1, 0.0) == 0.0
    grid = specular_albedo(np.linspace(0.0, 1.0, 50)[:, None], np.linspace(0.0, 1.0, 50), 0.3)
    assert (grid >= 0.0).all() and (grid <= 1.0).all()
