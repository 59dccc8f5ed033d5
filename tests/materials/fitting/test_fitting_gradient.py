from __future__ import annotations

import numpy as np
import pytest

from lambent.materials.fitting.gradient import polish
from lambent.materials.fitting.grid import Candidate
from lambent.materials.fitting.metrics import METRICS
from lambent.materials.fitting.parameters import box_of, to_search
from lambent.materials.fitting.problem import problem_of
from tests.materials.fitting.known_answers import FEW, PAINT, grey


@pytest.mark.parametrize("metric", METRICS)
def test_polish_walks_to_the_known_lobe(metric):
    samples = grey(PAINT, FEW)
    problem = problem_of(samples, "reflection", METRICS[metric], np.full_like(samples.f, 0.2 / np.pi))
    box = box_of("reflection", 0, True, 1, {"alpha": 0.3}, {})
    start = Candidate(to_search(np.array([0.12, 0.12, 0.09, 0.3])), np.array([0.5]), 0.0)
    (found,) = polish(problem, [box], [start], seed=0)
    mx, my, r0, alpha = found.shape
    assert mx == my == pytest.approx(0.15, rel=0.01)
    assert r0 * found.k[0] == pytest.approx(0.042, rel=0.02)
    assert alpha == 0.3
