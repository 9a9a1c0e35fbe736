# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds as harmonics, against environments whose irradiance is known in closed form."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest

from cdrf_addon.core.errors import ParameterError
from cdrf_addon.core.reflectance import environment as ambient
from cdrf_addon.core.reflectance.lut import build_lut, sigma_axis
from cdrf_addon.core.reflectance.model import Model, ring, sphere
from cdrf_addon.core.reflectance.profile import profile

SIZE = (128, 256)
SIGMAS = np.array([0.0, 1e-3, 0.01, 0.1, 0.5, 1.0, 2.0, 5.0])
NO_BLUR = np.ones((3, 3))


def normals(count: int = 500) -> np.ndarray:
    random = np.random.default_rng(5)
    points = random.normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def grey(values: np.ndarray) -> np.ndarray:
    return np.repeat(values[..., None], 3, axis=-1)


def disc(axis: np.ndarray, half_angle: float, radiance: float) -> np.ndarray:
    """A panorama with a uniform disc, its edge smoothed over the pixels' own parts."""
    fine = ambient.panorama_directions(8 * SIZE[0], 8 * SIZE[1]) @ axis >= math.cos(half_angle)
    blocks = fine.reshape(SIZE[0], 8, SIZE[1], 8).mean(axis=(1, 3))
    return grey(radiance * blocks)


def test_pixels_cover_the_sphere() -> None:
    assert ambient.solid_angles(*SIZE).sum() * SIZE[1] == pytest.approx(4.0 * math.pi, rel=1e-12)
    towards = ambient.panorama_directions(*SIZE)
    assert np.allclose(np.linalg.norm(towards, axis=-1), 1.0)
    assert np.allclose(towards[64, 128], (0.0, 1.0, 0.0), atol=0.02)  # the centre looks along +Y
    assert towards[64, 192, 0] > 0.99 and towards[-1, 0, 2] > 0.99  # right is +X, the top +Z


def test_white_world_gives_one_for_every_sigma() -> None:
    found = ambient.project(np.ones((*SIZE, 3)))
    for sigma in SIGMAS:
        factors = ambient.band_factors(sphere(), np.full(3, sigma))
        assert np.abs(ambient.lit_by(found.harmonics, normals(), factors) - 1.0).max() <= 1e-4
    assert found.is_uniform and not found.is_black
    assert np.allclose(ambient.uniform((1.0, 1.0, 1.0)).harmonics, found.harmonics, atol=1e-3)
    assert ambient.project(np.zeros((*SIZE, 3))).is_black


def test_gradients_are_exact() -> None:
    """Radiance 1 + a z + b (3 z^2 - 1) gives irradiance / pi 1 + 2/3 a n + 1/4 b (3 n^2 - 1)."""
    z = ambient.panorama_directions(*SIZE)[..., 2]
    found = ambient.project(grey(1.0 + 0.5 * z + 0.2 * (3.0 * z**2 - 1.0)))
    n = normals()
    for sigma in SIGMAS:
        left = np.exp(-np.array([1.0, 3.0]) * sigma**2)
        expected = 1.0 + 0.5 * 2.0 / 3.0 * left[0] * n[:, 2]
        expected += 0.2 / 4.0 * left[1] * (3.0 * n[:, 2] ** 2 - 1.0)
        factors = ambient.band_factors(sphere(), np.full(3, sigma))
        value = ambient.lit_by(found.harmonics, n, factors)
        assert np.abs(value - expected[:, None]).max() <= 3e-4


def test_half_a_white_sky() -> None:
    """Under a half sky the irradiance is pi (1 + cos) / 2: band 2 and all even ones vanish."""
    z = ambient.panorama_directions(*SIZE)[..., 2]
    value = ambient.lit_by(ambient.project(grey((z > 0.0) * 1.0)).harmonics, normals(), NO_BLUR)
    assert np.abs(value - (1.0 + normals()[:, 2:]) / 2.0).max() <= 2e-4


def test_channels_are_damped_by_their_own_sigma() -> None:
    z = ambient.panorama_directions(*SIZE)[..., 2]
    found = ambient.project(grey(1.0 + z))
    factors = ambient.band_factors(sphere(), np.array([1.0, 0.3, 0.0]))
    up = ambient.lit_by(found.harmonics, (0.0, 0.0, 1.0), factors)
    assert up == pytest.approx(1.0 + 2.0 / 3.0 * np.exp([-1.0, -0.09, 0.0]), abs=3e-4)


@pytest.mark.parametrize("model", [sphere(), ring()], ids=["sphere", "ring"])
def test_band_factors_against_mpmath(model: Model) -> None:
    """A_l by arbitrary-precision quadrature of series that owe nothing to our code."""
    legendre = {
        degree: (degree + mpmath.mpf(1) / 2)
        * mpmath.quad(lambda x, d=degree: x * mpmath.legendre(d, x), [0, 1])
        for degree in (0, 1, 2, 4, 6, 8, 10, 12)
    }
    for sigma in (0.3, 1.0, 2.0):
        s2 = mpmath.mpf(sigma) ** 2

        def f(theta: mpmath.mpf, s2: mpmath.mpf = s2) -> mpmath.mpf:
            if model.kind == "RING":
                # Fourier series of max(cos, 0), each term damped by the Gaussian's transform.
                total = 1 / mpmath.pi + mpmath.exp(-s2 / 2) * mpmath.cos(theta) / 2
                for k in range(1, 14):
                    weight = 2 / mpmath.pi * (-1) ** (k + 1) / (4 * k * k - 1)
                    total += weight * mpmath.exp(-2 * k * k * s2) * mpmath.cos(2 * k * theta)
                return total
            # Legendre series: 1/4 and cos/2, and the even degrees by their projection.
            total = mpmath.mpf(0)
            for degree, part in legendre.items():
                damping = mpmath.exp(-degree * (degree + 1) * s2 / 2)
                total += part * damping * mpmath.legendre(degree, mpmath.cos(theta))
            return total

        found = ambient.band_factors(model, sigma)
        for band in range(3):
            integral = mpmath.quad(
                lambda t, n=band, f=f: f(t) * mpmath.legendre(n, mpmath.cos(t)) * mpmath.sin(t),
                [0, mpmath.pi / 2, mpmath.pi],
            )
            expected = 2 * mpmath.pi * integral / ambient.LAMBERT_FACTORS[band]
            assert found[band] == pytest.approx(float(expected), abs=2e-7), (sigma, band)


@pytest.mark.parametrize("model", [sphere(), ring(), profile()], ids=["sphere", "ring", "profile"])
def test_table_of_band_factors(model: Model) -> None:
    """The stored look-up table gives the same factors as the model it was made of."""
    bands = ambient.bands_of_table(build_lut(model).astype(np.float64))
    sigma = np.concatenate((SIGMAS, np.random.default_rng(3).uniform(0.0, 5.0, 200)))
    exact = ambient.band_factors(model, sigma)
    if not model.colour:
        exact = np.repeat(exact[:, None, :], 3, axis=1)
    error = np.abs(ambient.sample_bands(bands, sigma**2) - exact).max()
    print(f"{model.kind}: {error:.1e}")
    assert error <= 1e-4
    assert np.abs(bands[0] - 1.0).max() == 0.0 and sigma_axis()[0] == 0.0


def test_extremes_of_sigma() -> None:
    assert ambient.band_factors(sphere(), np.inf) == pytest.approx((1.0, 0.0, 0.0))
    # The ring gains energy: f tends to 1 / pi all around, 4 / pi of what came in.
    assert ambient.band_factors(ring(), 50.0) == pytest.approx((4.0 / math.pi, 0.0, 0.0), abs=1e-7)
    assert ambient.band_factors(ring(), 0.0) == pytest.approx((1.0, 1.0, 1.0), abs=1e-7)


@pytest.mark.parametrize("half_angle", [1.0, 4.0, 10.0])
def test_sun_of_a_panorama(half_angle: float) -> None:
    axis = np.array([0.3, -0.8, 0.52])
    axis /= np.linalg.norm(axis)
    w = math.radians(half_angle)
    radiance = 3.0 / math.sin(w) ** 2  # irradiance 3 pi
    found = ambient.project(0.2 + disc(axis, w, radiance), sun_threshold=0.2 + 1e-9)
    assert found.sun is not None
    assert math.degrees(math.acos(np.dot(found.sun.direction, axis))) <= 0.3
    assert found.sun.radiance == pytest.approx((3.0,) * 3, rel=0.02)
    # A disc of a pixel or two is spread by its pixels.
    assert math.degrees(math.asin(found.sun.sin2_half_angle**0.5)) == pytest.approx(
        half_angle, abs=0.5
    )
    rest = ambient.lit_by(found.harmonics, normals(), NO_BLUR)
    assert np.abs(rest - 0.2).max() <= 2e-3


def test_energy_is_the_same_with_and_without_the_sun() -> None:
    """Bands 0 and 1 of the rest plus those of a sun of no size are those of the whole."""
    axis = np.array([0.6, 0.0, 0.8])
    picture = 0.5 + disc(axis, math.radians(3.0), 400.0) * (1.0, 0.8, 0.5)
    whole = ambient.project(picture).harmonics
    split = ambient.project(picture, sun_threshold=10.0)
    assert split.sun is not None
    flux = np.array(split.sun.radiance) * math.pi
    basis = whole * 0.0
    basis[:4] = (ambient.polynomials(split.sun.direction) * np.array(ambient._NORMS))[:4, None]
    again = split.harmonics + basis * flux
    assert np.abs(again - whole)[:4].max() <= 0.003 * np.abs(whole).max()


def test_what_is_no_single_sun_stays_in_the_harmonics() -> None:
    hazy = ambient.project(1.0 + disc(np.array([0.0, 0.0, 1.0]), 0.5, 2.0), sun_threshold=10.0)
    assert hazy.sun is None  # nothing stands out
    speck = np.full((*SIZE, 3), 2.0)
    speck[70, 30] = 20.0
    assert ambient.project(speck, sun_threshold=10.0).sun is None  # too little to be worth a light
    lamp = disc(np.array([0.0, 0.0, 1.0]), 0.1, 900.0)
    assert ambient.project(lamp, sun_threshold=0.0).sun is None


def test_senseless_pixels_are_black_and_shapes_are_checked() -> None:
    picture = np.ones((*SIZE, 3))
    picture[3, 3] = (np.nan, -5.0, -np.inf)
    assert np.isfinite(ambient.project(picture).harmonics).all()
    picture[64, 3] = np.inf
    assert np.isfinite(ambient.project(picture, sun_threshold=10.0).harmonics).all()
    with pytest.raises(ParameterError):
        ambient.project(np.ones((4, 4)))
