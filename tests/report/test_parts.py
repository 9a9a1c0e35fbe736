# SPDX-License-Identifier: GPL-3.0-or-later
"""The report's own arithmetic: texture blurring, similarity, profiles, Pareto front, time split."""

from __future__ import annotations

import ast
import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from stability import EXTREMES

from cdrf_addon.core.reflectance.profile import SKIN_PROFILE
from cdrf_addon.core.scattering.node_radius import BURLEY, RANDOM_WALK, sigma0_per_radius
from tests.benchmarks.report import metrics, stability, texture_blurring
from tests.benchmarks.report.contenders import DEFAULT, LAMBERT
from tests.benchmarks.report.matrix import keep_pictures, load_pictures
from tests.benchmarks.report.settings import quick
from tests.benchmarks.report.substances import PRESET_OF, profile_of, substance
from tests.benchmarks.report.timing import split
from tests.benchmarks.view_dependence import page, study

TESTS = Path(__file__).resolve().parents[1]
# Unit square in the plane z = 0, two triangles; texture coordinates are positions.
SQUARE = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)])
FACES = np.array([(0, 1, 2), (0, 2, 3)])


def flat_atlas(size: int = 192, stretch: float = 1.0) -> texture_blurring.Atlas:
    """The square, drawn out along x, filling its texture."""
    uv = SQUARE[FACES][..., :2]
    return texture_blurring.make_atlas(SQUARE * (stretch, 1.0, 1.0), FACES, uv, size)


def island_atlas() -> texture_blurring.Atlas:
    """Two islands with a gap, one of them turned and of another scale."""
    vertices = np.concatenate((SQUARE, SQUARE + np.array((3.0, 0.0, 0.0))))
    faces = np.concatenate((FACES, FACES + 4))
    turned = SQUARE[:, [1, 0]] * 0.2 + (0.7, 0.1)
    corners = np.concatenate((SQUARE[:, :2] * 0.5 + 0.05, turned))[faces]
    return texture_blurring.make_atlas(vertices, faces, corners, 96)


def wave(atlas: texture_blurring.Atlas, cycles: float) -> np.ndarray:
    """A cosine along u around 1/2, all channels alike."""
    u = (np.arange(atlas.size) + 0.5) / atlas.size
    row = 0.5 + 0.5 * np.cos(2.0 * math.pi * cycles * u)
    return np.broadcast_to(row[None, :, None], (atlas.size, atlas.size, 3)).copy()


def test_texels_know_where_they_are() -> None:
    atlas = flat_atlas(64)
    assert atlas.mask.all()
    places = atlas.interpolate(FACES, SQUARE).reshape(64, 64, 3)
    middle = (np.arange(64) + 0.5) / 64.0
    assert np.abs(places[..., 0] - middle[None, :]).max() < 1e-12
    assert np.abs(places[..., 1] - middle[:, None]).max() < 1e-12
    assert np.abs(atlas.stretch - 1.0 / 64.0).max() < 1e-12


def test_islands_cover_their_area_and_have_their_own_stretch() -> None:
    atlas = island_atlas()
    # The rim of a square island is off by half a texel a side at most.
    assert atlas.mask.mean() == pytest.approx(0.25 + 0.04, abs=4 * 0.7 / 96)
    left, right = atlas.stretch[30, 30], atlas.stretch[20, 75]
    assert left == pytest.approx([1.0 / (0.5 * 96)] * 2)
    assert right == pytest.approx([1.0 / (0.2 * 96)] * 2)


@pytest.mark.parametrize("sigma", [1e-6, 0.03, 0.4, 1e3])
def test_constant_irradiance_stays_constant(sigma: float) -> None:
    atlas = island_atlas()
    values = np.where(atlas.mask[..., None], (0.2, 0.5, 0.9), 0.0)
    blurred = texture_blurring.blur(values, atlas, sigma)
    assert np.abs(blurred - values).max() < 1e-12


@pytest.mark.parametrize("stretch", [1.0, 2.0])
def test_a_flat_patch_is_blurred_by_a_gaussian(stretch: float) -> None:
    """A wave of k fades by exp(-k^2 sigma^2 / 2), whatever the texture does to the surface."""
    atlas, sigma, cycles = flat_atlas(192, stretch), 0.03, 4.0
    blurred = texture_blurring.blur(wave(atlas, cycles), atlas, sigma)
    k = 2.0 * math.pi * cycles / stretch
    wanted = 0.5 + (wave(atlas, cycles) - 0.5) * math.exp(-0.5 * (k * sigma) ** 2)
    inner = slice(60, 132)  # three standard deviations and more from the patch's ends
    # Seven taps leave out what is beyond three deviations, and the texture is read linearly.
    assert np.abs(blurred - wanted)[:, inner].max() < 4e-3


def test_a_profile_is_the_sum_of_its_gaussians() -> None:
    atlas, cycles, millimetres = flat_atlas(), 6.0, 60.0
    cost = texture_blurring.Cost()
    blurred = texture_blurring.diffuse(wave(atlas, cycles), atlas, SKIN_PROFILE, millimetres, cost)
    assert cost.passes == 12
    assert cost.taps == 12 * 7 * atlas.size**2
    k = 2.0 * math.pi * cycles / millimetres
    widths, weights = np.array(SKIN_PROFILE.widths), np.array(SKIN_PROFILE.weights)
    left = np.exp(-0.5 * (k * widths) ** 2) @ (weights / weights.sum(axis=0))
    wanted = 0.5 + (wave(atlas, cycles) - 0.5) * left
    assert np.abs(blurred - wanted)[:, 60:132].max() < 0.01


@pytest.mark.parametrize("name", list(PRESET_OF))
def test_six_gaussians_stand_for_the_dipole(name: str) -> None:
    shape = profile_of(name)
    assert len(shape.widths) == 6
    assert np.sum(shape.weights, axis=0) == pytest.approx((1.0, 1.0, 1.0))
    media = substance(name).preset.media
    assert media is not None
    for channel, medium in enumerate(media):
        # What is left of a wave as long as the medium's own length, and of one three times that.
        for k in (1.0 / medium.sigma0(), 1.0 / (3.0 * medium.sigma0())):
            shares = np.exp(-np.array(medium.depths) * medium.transport)
            beyond = math.hypot(k, medium.transport) - medium.transport
            wanted = float(np.exp(-np.array(medium.depths) * beyond) @ (shares / shares.sum()))
            gaussians = np.exp(-0.5 * (k * np.array(shape.widths)) ** 2)
            assert gaussians @ np.array(shape.weights)[:, channel] == pytest.approx(
                wanted, abs=0.01
            )


def test_the_path_tracer_and_the_slider_get_the_same_number() -> None:
    marble = substance("marble")
    back = marble.radius(25.0) * sigma0_per_radius(marble.albedo)
    assert back == pytest.approx(np.array(marble.preset.sigma0) / 25.0)


@pytest.mark.parametrize("method", [RANDOM_WALK, BURLEY])
def test_every_method_gets_the_radius_of_one_sigma0(method: str) -> None:
    skin = substance("skin")
    back = skin.radius(25.0, method) * sigma0_per_radius(skin.albedo, method)
    assert back == pytest.approx(np.array(skin.preset.sigma0) / 25.0)


def study_row(look: float) -> dict[str, Any]:
    """A scene in which every other contender is 0.04 off."""
    errors = dict.fromkeys(study.COMPARED, 0.04) | {DEFAULT: look}
    shares = dict.fromkeys(page.PARTS, (1.0 / 3.0, 1.0 / 3.0))
    return {
        "contenders": {
            name: {
                "rmse": dict.fromkeys(study.MASKS, off),
                "gain": {"rmse": off / 2.0},
                "shares": shares,
            }
            for name, off in errors.items()
        },
        "floor": dict.fromkeys(study.MASKS, 0.001),
        "apart": dict.fromkeys(study.MASKS, 0.03),
    }


def test_the_study_means_geometrically_and_names_what_is_worse() -> None:
    cells = {"sphere, skin, sun": study_row(0.01), "torus, milk, sun": study_row(0.16)}
    results = {
        "machine": {"date": "2026-11-28"},
        "references": {RANDOM_WALK: cells, BURLEY: {"sphere, skin, sun": study_row(0.08)}},
    }
    found = study.measured(results, RANDOM_WALK)
    assert [cell.name for cell in found] == list(cells)
    assert study.share(found.values(), DEFAULT, LAMBERT, "all") == pytest.approx(1.0)
    assert study.unscaled(found.values(), DEFAULT) == pytest.approx(0.5)
    text = page.page(results)
    assert "Scenes in which it is farther off than Lambert: torus, milk, sun (4.00)." in text
    assert "34 not measured yet" in text
    assert "| scenes worse than Lambert | 0 | 1 | **no** |" in text
    assert "the error of the look is 2.00" in text
    (sentence,) = page.default_sentences(results, alone=True)
    assert "than Lambert in 1 of 2 scenes with lamps" in sentence
    assert page.default_sentences({}, alone=True) == []


def test_similarity_of_known_pictures() -> None:
    whole = np.ones((64, 64), dtype=bool)
    rng = np.random.default_rng(5)
    noise = rng.random((64, 64, 3))
    assert metrics.ssim(noise, noise, whole) == pytest.approx(1.0)
    c1, c2 = metrics.STEADY
    # Two constants differ in luminance alone.
    grey = np.ones((32, 32, 3), dtype=np.float64)
    flat = metrics.ssim_map(0.3 * grey, 0.6 * grey)
    assert flat == pytest.approx((2 * 0.3 * 0.6 + c1) / (0.3**2 + 0.6**2 + c1))
    # A pattern and its negative: the covariance is minus the variance.
    board = np.array(np.indices((64, 64)).sum(axis=0) % 2 - 0.5, dtype=np.float64)[..., None]
    inner = metrics.ssim_map(0.5 + 0.2 * board, 0.5 - 0.2 * board)[16:48, 16:48]
    variance = 0.1**2
    assert inner == pytest.approx((c2 - 2.0 * variance) / (2.0 * variance + c2), abs=1e-3)


def test_rmse_is_the_mean_of_the_channels() -> None:
    one, mask = np.zeros((4, 4, 4)), np.eye(4, dtype=bool)
    other = one + np.array((0.1, 0.2, 0.6, 9.0))
    assert metrics.rmse(one, other, mask) == pytest.approx(0.3)


def test_the_front_is_what_nothing_beats() -> None:
    # Late: matplotlib is not in every environment.
    from tests.benchmarks.report.figures.plots import Point, front

    places = [(1.0, 0.5), (2.0, 0.6), (3.0, 0.2), (0.5, 0.9), (3.5, 0.2)]
    found = front([Point("", "", "", 1, seconds, error) for seconds, error in places])
    assert [(one.seconds, one.error) for one in found] == [(0.5, 0.9), (1.0, 0.5), (3.0, 0.2)]


def test_time_is_split_into_fixed_and_per_sample() -> None:
    rows = {
        str(count): [{"wall": fixed + slope * count} for fixed, slope in ((2.0, 0.1), (3.0, 0.2))]
        for count in (1, 9, 25)
    }
    found = split({**rows, "first": [{"wall": 99.0}, {"wall": 99.0}]})
    assert np.array(found) == pytest.approx(np.array([(2.0, 0.1), (3.0, 0.2)]))


def test_pictures_are_kept_beside_those_that_are_there(tmp_path: Path) -> None:
    path = tmp_path / "cell.npz"
    for name, value in itertools.product(("a", "b"), (0.25, 0.5)):
        keep_pictures(path, {name: np.full((2, 2, 4), value)})
    assert {name: float(p[0, 0, 0]) for name, p in load_pictures(path).items()} == {
        "a": 0.5,
        "b": 0.5,
    }


def test_results_that_were_broken_off_are_whole(tmp_path: Path) -> None:
    settings = quick(tmp_path, tmp_path / "cache")
    assert settings.read("errors") == {}
    settings.write("errors", {"value": 1.23456789, "name": "σ₀"})
    found = settings.read("errors")
    assert (found["value"], found["name"]) == (1.23457, "σ₀")
    assert [path.name for path in settings.data.iterdir()] == ["report_errors.json"]


def test_every_extreme_names_a_test_that_exists() -> None:
    for extreme in EXTREMES:
        file, _, function = extreme.test.partition("::")
        tree = ast.parse((TESTS / file).read_text(encoding="utf-8"))
        names = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
        assert function in names, extreme.test


def test_the_page_names_what_failed_and_what_was_not_run() -> None:
    case = {"case": "1e-12", "outcome": "failed", "seconds": 0.0, "said": "0.1 off"}
    test = {"area": "σ", "test": "a.py::b", "tried": "small", "held": "fine", "guard": "care"}
    good = {**case, "case": "1", "outcome": "passed", "said": ""}
    text = stability.page(
        {"machine": {"cores": "2"}, "tests": [{**test, "cases": [case, good]}], "not run": ["c::d"]}
    )
    assert "2 cases: 1 came out as they should, 1 did not" in text
    assert "**NOT: fine** | 1 of 2" in text
    assert "| 1e-12 | 0.1 off **FAILED** |" in text
    assert "Not run: `c::d`." in text
