# SPDX-License-Identifier: GPL-3.0-or-later
"""The blur that stands for a spherical light, against the light integrated with its horizon."""

import functools
import itertools
import math

import numpy as np
import pytest

from cdrf_addon.core.reflectance.finite_light import RING_GAIN, SPHERE_GAIN, finite_light
from cdrf_addon.core.reflectance.ring_model import ring_reflectance
from cdrf_addon.core.reflectance.sphere_model import sphere_reflectance

pytestmark = pytest.mark.smoke

# Half-angle in radians and the worst error of the irradiance in units of its peak. A Gaussian has
# no hard horizon, so the fit is what it is: the error is 0.9 % of the half-angle to 0.4 rad and
# grows faster beyond. Each row is the measured error rounded up by a tenth or less (the first by a
# fifth); the rows in degrees are those the docstring of core/finite_light.py states.
WORST = [
    (0.01, 1e-4),
    (0.05, 4.8e-4),
    (0.1, 9.5e-4),
    (0.2, 1.9e-3),
    (0.3, 2.9e-3),
    (0.4, 4.1e-3),
    (0.5, 5.5e-3),
    (0.6, 7.2e-3),
    (0.7, 9.5e-3),
    (0.8, 1.2e-2),
    (math.radians(6.0), 1e-3),
    (math.radians(17.0), 3e-3),
    (math.radians(29.0), 7e-3),
    (math.radians(46.0), 1.5e-2),
]
TOLERANCE = {
    # The quadrature below against closed forms: 200 nodes a piece leave 3e-13.
    "quadrature": 1e-11,
    # Its sum over all directions: 60 nodes across the kinks at the ends of the pieces.
    "flux": 1e-8,
    # Four half-angles above the horizon the Gaussian's tail (7 of its widths) is nothing; what is
    # left is the product of the gain and the blur, which is 1.
    "high": 1e-9,
}


@functools.cache
def nodes(count: int = 200) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre in t, mapped by sin(pi t / 2): the integrand ends in square roots."""
    at, weight = np.polynomial.legendre.leggauss(count)
    return np.sin(math.pi / 2.0 * at), weight * math.pi / 2.0 * np.cos(math.pi / 2.0 * at)


def irradiance(theta: np.ndarray, half_angle: float) -> np.ndarray:
    """Integrate cos over the part of a cone of directions that is above the horizon.

    In rings of polar angle a around the surface normal: a ring lies inside the cone over an azimuth
    of 2 arccos((cos w - cos a cos theta) / (sin a sin theta)). The unit is the peak, pi sin^2 w.
    """
    inner = np.minimum(np.abs(theta - half_angle), math.pi / 2.0)
    outer = np.minimum(theta + half_angle, math.pi / 2.0)
    at, weight = nodes()
    total = np.zeros_like(theta)
    # Up to `inner` a ring is wholly inside or outside, beyond `outer` it is outside.
    for start, end in ((np.zeros_like(theta), inner), (inner, np.maximum(inner, outer))):
        half = (end - start)[:, None] / 2.0
        a = start[:, None] + half * (1.0 + at)
        reach = math.cos(half_angle) - np.cos(a) * np.cos(theta)[:, None]
        across = np.sin(a) * np.sin(theta)[:, None]
        # |reach| >= across is a whole ring or none; at theta = 0 both are.
        ratio = np.where(np.abs(reach) < across, reach, np.sign(reach)) / np.where(
            np.abs(reach) < across, across, 1.0
        )
        total += (np.cos(a) * np.sin(a) * 2.0 * np.arccos(ratio) * half * weight).sum(axis=1)
    return total / (math.pi * math.sin(half_angle) ** 2)


@pytest.mark.parametrize("half_angle", [0.01, 0.3, 0.8])
def test_the_quadrature_is_sound(half_angle: float) -> None:
    theta = np.linspace(0.0, math.pi, 1441)
    exact = irradiance(theta, half_angle)
    # A light above the horizon has the closed form, one below it gives nothing.
    whole, none = theta <= math.pi / 2.0 - half_angle, theta >= math.pi / 2.0 + half_angle
    assert np.abs(exact[whole] - np.cos(theta[whole])).max() <= TOLERANCE["quadrature"]
    assert np.abs(exact[none]).max() <= TOLERANCE["quadrature"]
    # Summed over all directions of the light, every patch of it gives pi: total pi times its size.
    edge = [0.0, math.pi / 2.0 - half_angle, math.pi / 2.0, math.pi / 2.0 + half_angle, math.pi]
    at, weight = nodes(60)
    flux = 0.0
    for start, end in itertools.pairwise(edge):
        theta = start + (end - start) / 2.0 * (1.0 + at)
        flux += (irradiance(theta, half_angle) * np.sin(theta) * weight).sum() * (end - start) / 2.0
    assert flux == pytest.approx(
        (1.0 - math.cos(half_angle)) / math.sin(half_angle) ** 2, abs=TOLERANCE["flux"]
    )


@pytest.mark.parametrize("along", ["ring", "sphere"])
@pytest.mark.parametrize(("half_angle", "worst"), WORST)
def test_the_blur_stands_for_the_light(half_angle: float, worst: float, along: str) -> None:
    theta = np.linspace(0.0, math.pi, 1441)
    model = {"ring": ring_reflectance, "sphere": sphere_reflectance}[along]
    variance, gain = finite_light(
        math.sin(half_angle) ** 2, {"ring": RING_GAIN, "sphere": SPHERE_GAIN}[along]
    )
    blurred = model(theta, math.sqrt(float(variance))) * gain
    worst *= 1.4 if along == "sphere" else 1.0  # the coefficients are the ring's
    error = np.abs(blurred - irradiance(theta, half_angle))
    assert error.max() <= worst, f"worst at {math.degrees(theta[error.argmax()]):.1f} degrees"
    # High above the horizon the gain undoes the blur: there the light is a point.
    high = theta <= math.pi / 2.0 - 4.0 * half_angle
    assert error[high].max(initial=0.0) <= TOLERANCE["high"]


def test_a_point_is_not_blurred() -> None:
    variance, gain = finite_light(0.0)
    assert float(variance) == 0.0
    assert float(gain) == 1.0


def test_a_larger_light_blurs_more_and_shapes_are_kept() -> None:
    variance, gain = finite_light(np.linspace(0.0, 1.0, 101).reshape(1, 101))
    assert variance.shape == gain.shape == (1, 101)
    assert (np.diff(variance) > 0.0).all()
    assert (np.diff(gain) > 0.0).all()
    assert gain.dtype == variance.dtype == np.float64
