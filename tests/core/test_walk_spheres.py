# SPDX-License-Identifier: GPL-3.0-or-later
"""The walks that every fit rests on: laws that hold without any fit, and the flat limit."""

import math

import numpy as np
import pytest

from cdrf_addon.core.walk.chandrasekhar import cut_off, escape
from cdrf_addon.core.walk.entry import entry
from cdrf_addon.core.walk.medium import medium
from cdrf_addon.core.walk.sphere_walk import (
    ACROSS,
    ALONG,
    BALL,
    BODIES,
    HOLLOW,
    PLANE,
    diffuse_views,
    views,
    walk,
)

pytestmark = pytest.mark.smoke

# Means of so many walks: within 4.5 of their own standard deviations, once in 150,000.
SIGMAS = 4.5
COUNT = 20_000


def within(values: np.ndarray, expected: float, started: int) -> bool:
    """True where the mean over all that started is as expected, but for chance."""
    mean = values.sum() / started
    spread = math.sqrt(max((values**2).sum() / started - mean**2, 1e-12) / started)
    return bool(abs(mean - expected) <= SIGMAS * spread)


@pytest.mark.parametrize("g", [0.0, 0.7, -0.7])
@pytest.mark.parametrize(("body", "chord"), [(BALL, 4.0 / 3.0), (ACROSS, 2.0), (ALONG, 2.0)])
def test_the_mean_path_in_a_body_knows_no_scattering(body: str, chord: float, g: float) -> None:
    # Light that enters by the cosine law runs 4 V / S on average, however it scatters (Bardsley
    # and Dubi 1981): in mean free paths that is how often it scatters.
    random = np.random.default_rng(3)
    for curvature in (0.2, 1.0):
        entered = diffuse_views(COUNT, random)
        out = walk(body, curvature, entered, random, 100_000, 0.0)
        assert len(out.scattered) == COUNT
        assert within(out.scattered, chord / curvature, COUNT)
    # With an anisotropy the first ten flights count in their own unit.
    out = walk(body, 0.5, diffuse_views(COUNT, random), random, 100_000, g)
    assert len(out.scattered) == COUNT
    if g == 0.0:
        assert within(out.scattered, chord / 0.5, COUNT)


@pytest.mark.parametrize("omega", [0.3, 0.8, 0.99])
@pytest.mark.parametrize("mu", [0.1, 0.6, 1.0])
def test_a_plane_gives_back_what_h_says(mu: float, omega: float) -> None:
    random = np.random.default_rng(4)
    ways = entry(np.array([mu]), 1.0, 1.4)
    exact = ways.mean(escape(ways.depth, omega) - cut_off(ways.depth, omega, 256))[0]
    out = walk(PLANE, 1.0, views(mu, COUNT, 1.0, 1.4, random), random)
    assert within(out.weights(omega), float(exact), COUNT)


def test_a_large_ball_and_a_large_hollow_are_planes() -> None:
    random = np.random.default_rng(5)
    ways = entry(np.array([0.5]), 0.25, 1.5)
    exact = float(ways.mean(escape(ways.depth, 0.8))[0])
    for body in (BALL, HOLLOW):
        out = walk(body, 1e-4, views(0.5, COUNT, 0.25, 1.5, random), random)
        assert within(out.weights(0.8), exact, COUNT), body


@pytest.mark.parametrize("alpha", [0.0, 0.25, 1.0])
def test_drawn_and_integrated_entries_agree(alpha: float) -> None:
    random = np.random.default_rng(6)
    for mu in (0.1, 0.7):
        drawn, ways = views(mu, COUNT, alpha, 1.4, random), entry(np.array([mu]), alpha, 1.4)
        assert abs(-drawn[:, 2].mean() - ways.mean(ways.depth)[0]) <= 0.01
        assert abs(-drawn[:, 0].mean() - ways.mean(ways.along)[0]) <= 0.01
        assert np.abs(np.linalg.norm(drawn, axis=1) - 1.0).max() <= 1e-12


def test_nothing_is_lost_in_a_white_ball() -> None:
    random = np.random.default_rng(7)
    out = walk(BALL, 0.3, views(0.5, COUNT, 1.0, 1.4, random), random)
    assert out.reflected(out.weights(1.0)) == 1.0
    # And the mean over all lights of what is shown is a quarter.
    z = np.linspace(-1.0, 1.0, 401)[1::2]
    lights = np.stack((np.sqrt(1.0 - z * z), 0.0 * z, z), axis=1)
    turned = lights @ np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    shown = [out.radiance(out.weights(1.0), ring).mean() for ring in (lights, turned)]
    opposite = [out.radiance(out.weights(1.0), -ring).mean() for ring in (lights, turned)]
    assert abs(np.mean([*shown, *opposite]) - 0.25) <= 2e-3


def test_bulges_are_brighter_and_hollows_darker() -> None:
    random = np.random.default_rng(8)
    shown = {}
    for body in BODIES:
        out = walk(body, 0.3, views(0.5, COUNT, 1.0, 1.4, random), random)
        shown[body] = out.reflected(out.weights(0.8))
    assert shown[HOLLOW] < 0.9 * shown[PLANE]
    assert shown[PLANE] < shown[ALONG] < 1.05 * shown[ACROSS] < 1.05 * shown[BALL]


def test_walks_are_seeded_and_normals_are_unit() -> None:
    for body in BODIES:
        first, second = (
            walk(body, 0.2, views(0.3, 500, 1.0, 1.4, random), random)
            for random in (np.random.default_rng(9), np.random.default_rng(9))
        )
        assert np.array_equal(first.scattered, second.scattered)
        assert np.array_equal(first.normal, second.normal)
        assert np.abs(np.linalg.norm(first.normal, axis=1) - 1.0).max() <= 1e-9
        assert first.scattered.max() < 256


def test_an_anisotropic_plane_has_about_its_colour() -> None:
    # Similarity: the colour stays, to a few parts in a hundred, whatever the anisotropy.
    random = np.random.default_rng(10)
    for g in (-0.5, 0.5, 0.8):
        made = medium("RANDOM_WALK", 0.5, 1.0, g)
        omega, first = float(made.single_scattering), float(made.first_scattering)
        length = float(made.first_free_path / made.mean_free_path)
        out = walk(PLANE, 1.0, diffuse_views(COUNT, random), random, 256, g, length)
        assert abs(out.reflected(out.weights(omega, first)) - 0.5) <= 0.03, g
