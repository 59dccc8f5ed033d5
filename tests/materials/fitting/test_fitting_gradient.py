from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.core.progress import silent
from lambent.materials.fitting import gradient
from lambent.materials.fitting.gradient import Bounds, _normal_equations, _unknowns, minimise
from lambent.materials.fitting.parameters import box_of, to_search
from lambent.materials.fitting.problem import Candidate, Mixture, problem_of
from lambent.materials.measured.inspecting.metrics import METRICS
from tests.materials.fitting.known_answers import FEW, FOIL, ISOTROPIC, PAINT, grey

TWO = Mixture(
    np.array([0.2]),
    (
        Candidate(to_search(np.array([0.12, 0.2, 0.09, 0.3])), np.array([0.5])),
        Candidate(to_search(np.array([0.4, 0.3, 0.5, 0.7])), np.array([0.2])),
    ),
)


def free_boxes(side, lobes):
    return [box_of(side, i, False, 1, {}, {"t_r0": (0.1, 0.9)} if side == "transmission" else {}) for i in range(lobes)]


@pytest.mark.parametrize("metric", ["cuberoot", "log", "l2_ngan"])
@pytest.mark.parametrize("distribution", ["beckmann", "ggx"])
@pytest.mark.parametrize("side", ["reflection", "transmission"])
def test_gradient_is_the_derivative_of_the_error(metric, distribution, side):
    problem = problem_of(grey(FOIL, replace(ISOTROPIC, step_deg=8)), side, METRICS[metric], distribution, False)
    bounds = Bounds(free_boxes(side, 2), True)
    unknowns = _unknowns(bounds, TWO)
    _, gradient_ = _normal_equations(problem, bounds, TWO, unknowns)
    step = 1e-5
    for unknown, slope in zip(unknowns, gradient_, strict=True):
        moved = [problem.remaining(_shifted(unknown, sign * step)) for sign in (1, -1)]
        assert -2 * slope == pytest.approx((moved[0] - moved[1]) / (2 * step), rel=1e-4, abs=1e-9)


def _shifted(unknown, by):
    if unknown.lobe < 0:
        return replace(TWO, diffuse=TWO.diffuse * np.exp(by))
    lobes = list(TWO.lobes)
    lobe = lobes[unknown.lobe]
    if unknown.axis == 4:
        lobes[unknown.lobe] = replace(lobe, k=lobe.k * np.exp(by))
    else:
        coordinates = lobe.coordinates.copy()
        coordinates[unknown.axis] += by
        lobes[unknown.lobe] = replace(lobe, coordinates=coordinates)
    return replace(TWO, lobes=tuple(lobes))


@pytest.mark.parametrize("number", range(10))
def test_every_start_finds_the_same_optimum(number):
    problem = problem_of(grey(PAINT, FEW), "reflection", METRICS["cuberoot"], "beckmann", False)
    bounds = Bounds([box_of("reflection", 0, True, 1, {}, {})], True)
    (few,) = problem.thinned([4000], 0, [np.float32])
    starts = list(gradient._starts(few, bounds, Mixture(np.array([0.2]))))
    assert len(starts) == 10
    found, error = minimise(problem, bounds, starts[number], 200, 1e-7)
    assert found.lobes[0].shape[0] == pytest.approx(0.15, rel=0.02)
    assert error == pytest.approx(_noise_floor(problem), rel=0.05)


def _noise_floor(problem):
    (lobe,) = PAINT.lobes
    shape = np.array([lobe.mx, lobe.my, lobe.r0[0], lobe.alpha])
    return problem.remaining(Mixture(np.array([0.2]), (Candidate(to_search(shape), np.array([lobe.k[0]])),)))


def test_more_lobes_never_explain_less():
    problem = problem_of(grey(PAINT, FEW), "reflection", METRICS["cuberoot"], "ggx", False)
    bounds = Bounds([box_of("reflection", i, True, 1, {}, {}) for i in range(3)], True)
    found = list(gradient.fit_lobes(problem, bounds, np.array([0.2]), silent, 0))
    errors = [problem.remaining(model) for model in found]
    assert len(errors) > 1
    assert errors == sorted(errors, reverse=True)


def test_thinned_tuples_estimate_the_metric():
    problem = problem_of(grey(PAINT), "reflection", METRICS["l1"], "beckmann", False)
    model = Mixture(np.array([0.25]))
    (few,) = problem.thinned([3000], 1, [np.float32])
    assert len(few) <= 3000 < len(problem)
    assert few.remaining(model) == pytest.approx(problem.remaining(model), rel=0.02)
