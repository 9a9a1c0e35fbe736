# SPDX-License-Identifier: GPL-3.0-or-later
"""The measured model against fresh path-traced spheres that are in no table."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cdrf_addon.core.errors import MeasurementError
from cdrf_addon.core.measured.fitting import ModelFitter
from cdrf_addon.core.measured.measurement import equator_weights
from cdrf_addon.core.measured.model import MeasuredModel
from cdrf_addon.measuring import process
from cdrf_addon.measuring.process import measure, measure_steps
from cdrf_addon.measuring.request import QUALITIES, Quality, Request

# Half octaves, as a table has them, but only those that the fresh spheres need.
ROWS = tuple(2.0 ** (0.5 * step) for step in range(-12, 0))
FRESH = (0.11, 0.3)
SKIN = (0.8, 0.5, 0.4)
RATIO = (1.0, 0.35, 0.2)
TINY = Quality((24, 8), 2, 2)
# Four times the default's paths; the noise that is left is known and is subtracted.
REFERENCE = Quality((80, 20), 96, 10)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("albedo", "radius", "rows"), [((0.5, 0.9, 0.9), (1.0,) * 3, ROWS), (SKIN, RATIO, ())]
)
def test_fresh_spheres_are_met(
    albedo: tuple[float, float, float],
    radius: tuple[float, float, float],
    rows: tuple[float, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(QUALITIES, "fine", REFERENCE)
    # Skin needs all rows of a table: near the last ones less is smoothed across.
    model = MeasuredModel(measure(Request(albedo, seed=3, scales=rows), tmp_path), radius)
    asked = Request(albedo, "fine", 1_000_003, FRESH, radius)
    fresh = measure(asked, tmp_path)
    weights = equator_weights(fresh.theta)
    width = model.sigma_per_scale * fresh.scales
    found = np.moveaxis(model.evaluate(fresh.theta[None, :], width[:, None]), -1, 1)
    # The reference's own Monte-Carlo variance is no error of the model.
    squares = ((found - fresh.values) ** 2 - fresh.errors**2) @ weights
    assert np.sqrt(np.maximum(squares.mean(axis=0), 0.0)).max() <= 0.004
    if albedo[1] == 0.9:
        for name, most in (("ring", 0.036), ("sphere", 0.06)):
            fitter = ModelFitter(name, fresh.theta, weights)
            assert max(fitter.fit(values).rms for values in fresh.values[:, 1]) <= most


@pytest.fixture
def tiny(monkeypatch: pytest.MonkeyPatch) -> Request:
    monkeypatch.setitem(QUALITIES, "preview", TINY)
    return Request((0.8, 0.5, 0.4), "preview", scales=(0.01, 0.1, 1.0))


@pytest.mark.smoke
def test_progress_comes_often_and_the_result_is_kept(
    tiny: Request, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert process.POLL_SECONDS <= 0.1  # Esc and the bar stay alive
    steps, reported = measure_steps(tiny, tmp_path), []
    while True:
        try:
            reported.append(next(steps))
        except StopIteration as done:
            first = done.value
            break
    parts = [part for part, _ in reported]
    assert parts == sorted(parts)
    assert parts[-1] == 1.0
    assert [path.suffix for path in tmp_path.iterdir()] == [".npz"]
    assert first.values.shape[:2] == (3, 3)
    monkeypatch.setattr(process, "WORKER", tmp_path / "none")  # nothing is rendered again
    again = measure(tiny, tmp_path)
    assert (again.values == first.values).all()


def test_a_damaged_file_is_measured_again(tiny: Request, tmp_path: Path) -> None:
    first = measure(tiny, tmp_path)
    (file,) = tmp_path.iterdir()
    file.write_bytes(file.read_bytes()[:500])
    assert (measure(tiny, tmp_path).values == first.values).all()


def test_closing_leaves_nothing_behind(tiny: Request, tmp_path: Path) -> None:
    steps = measure_steps(tiny, tmp_path)
    for _ in range(10):
        next(steps)
    steps.close()
    assert list(tmp_path.iterdir()) == []


def test_another_seed_is_another_measurement(tiny: Request) -> None:
    assert tiny.key() != Request(tiny.albedo, "preview", 1, tiny.scales).key()
    assert tiny.key() == Request(tiny.albedo, "preview", 0, tiny.scales).key()


def test_a_child_that_fails_becomes_a_sentence(
    tiny: Request, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = tmp_path / "broken.py"
    broken.write_text("raise RuntimeError('no such device')\n")
    monkeypatch.setattr(process, "WORKER", broken)
    with pytest.raises(
        MeasurementError, match=r"Cycles could not render .* no such device\. Check"
    ):
        measure(tiny, tmp_path / "cache")
    assert list((tmp_path / "cache").iterdir()) == []


def test_a_child_that_dies_becomes_a_sentence(
    tiny: Request, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = tmp_path / "broken.py"
    broken.write_text("import os\nos._exit(7)\n")
    monkeypatch.setattr(process, "WORKER", broken)
    with pytest.raises(MeasurementError, match=r"ended early \(exit code 7\)"):
        measure(tiny, tmp_path / "cache")


def test_a_folder_that_is_none_becomes_a_sentence(tiny: Request, tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("")
    with pytest.raises(MeasurementError, match="could not be measured"):
        measure(tiny, file / "cache")


@pytest.mark.parametrize(
    "arguments",
    [
        {"albedo": (0.0, 0.5, 0.5)},
        {"albedo": (1.1, 0.5, 0.5)},
        {"quality": "best"},
        {"seed": -1},
        {"scales": (0.2, 0.1)},
        {"scales": (0.0, 0.1)},
        {"radius": (1.0, 0.0, 1.0)},
    ],
)
def test_impossible_requests_are_refused(arguments: dict[str, object]) -> None:
    with pytest.raises(MeasurementError):
        Request(**{"albedo": (0.5, 0.5, 0.5), **arguments})  # type: ignore[arg-type]
