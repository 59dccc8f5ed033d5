"""The hierarchical search tries the values it says, finds known lobes, and does not beat least squares."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from lambent.core.progress import silent
from lambent.materials.fitting.fit import fit
from lambent.materials.fitting.parameters import box_of, to_search
from lambent.materials.fitting.problem import Mixture, problem_of
from lambent.materials.fitting.scale import diffuse_mode
from lambent.materials.measured.inspecting.metrics import METRICS
from lambent.published import grid_search
from lambent.published.grid_search import Schedule, fit_lobes, search
from tests.materials.fitting.known_answers import FEW, PAINT, grey


@pytest.fixture(autouse=True)
def few_values(monkeypatch):
    monkeypatch.setattr(grid_search, "VALUES", 4_000)


@pytest.fixture(scope="module")
def problem():
    return problem_of(grey(PAINT, FEW), "reflection", METRICS["cuberoot"], "beckmann", False)


def searched(problem, schedule, fix):
    box = box_of("reflection", 0, True, 1, fix, {"mx": (0.1, 0.2)})
    return search(problem, Mixture(np.array([0.2])), box, silent, [], 0, schedule)


def test_one_level_tries_the_equidistant_values_and_no_others(problem):
    found = searched(problem, Schedule(n=5, levels=1), {"r0": 0.06, "alpha": 0.3})
    tried = np.linspace(np.log(0.1), np.log(0.2), 5)
    assert np.abs(tried - found.coordinates[0]).min() < 1e-9
    assert found.shape[0] == pytest.approx(0.1 * 2**0.5, rel=1e-6)  # the nearest to .15 in the logarithm


@pytest.mark.parametrize("levels", [2, 3, 4])
def test_each_level_shrinks_the_interval_by_n_minus_1(problem, levels):
    n = 5
    found = searched(problem, Schedule(n, levels), {"r0": 0.06, "alpha": 0.3})
    pitch = np.log(2) / (n - 1) ** levels
    steps = (found.coordinates[0] - np.log(0.1)) / pitch * 2  # boxes are centred: half steps
    assert steps == pytest.approx(round(steps), abs=1e-6)
    assert found.shape[0] == pytest.approx(0.15, abs=0.15 * pitch + 0.001)


@pytest.mark.long
def test_the_known_lobe_is_found(problem):
    found = searched(problem, Schedule(), {})
    assert found.shape[0] == pytest.approx(0.15, rel=0.03)
    assert found.shape[2] * found.k[0] == pytest.approx(0.042, rel=0.1)


def test_finished_levels_survive_an_interruption(problem):
    finished = []

    def stop_at_level_3(done, total, what):
        if done >= 2:
            raise KeyboardInterrupt

    box = box_of("reflection", 0, True, 1, {}, {})
    with pytest.raises(KeyboardInterrupt):
        search(problem, Mixture(np.array([0.2])), box, stop_at_level_3, finished, 0, Schedule())
    assert len(finished) == 2
    assert np.abs(finished[-1].coordinates - to_search(np.array([0.15, 0.15, 0.06, 0.3])))[0] < 0.5


@pytest.mark.parametrize("lobes", [1, 2])
def test_least_squares_are_no_worse(lobes):
    paint = grey(PAINT, FEW)
    grid = fit(paint, lobes=lobes, search=partial(fit_lobes, schedule=Schedule(5, 4)))
    assert fit(paint, lobes=lobes).errors["cuberoot"] <= grid.errors["cuberoot"]
    if lobes == 1:
        assert grid.material.kd[0] == diffuse_mode(paint.f[:, 0], paint.weight * np.abs(paint.wo[:, 2]))
