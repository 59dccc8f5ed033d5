from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from lambent.materials.fitting.scale import Channel, solve_scale, weighted_median
from lambent.materials.measured.inspecting.metrics import METRICS

VALUES = arrays(float, 9, elements=st.floats(-10, 10, width=32))
WEIGHTS = arrays(float, 9, elements=st.floats(0, 5, width=32))


@given(VALUES, WEIGHTS)
def test_weighted_median_minimises_the_weighted_distance(values, weights):
    median = weighted_median(values, weights)

    def cost(m):
        return np.sum(weights * np.abs(values - m))

    assert cost(median) <= min(cost(v) for v in values) + 1e-9 * max(weights.sum(), 1)


def test_weighted_median_by_hand():
    assert weighted_median(np.array([3.0, 1.0, 2.0]), np.array([1.0, 1.0, 1.0])) == 2
    assert weighted_median(np.array([3.0, 1.0, 2.0]), np.array([5.0, 1.0, 1.0])) == 3
    assert weighted_median(np.array([3.0, 1.0]), np.zeros(2)) == 0
    assert weighted_median(np.zeros((2, 0)), np.zeros((2, 0))).tolist() == [0, 0]


def noisy(k: float) -> tuple[Channel, np.ndarray]:
    rng = np.random.default_rng(5)
    basis, background = rng.exponential(1.0, 400), rng.random(400) * 0.2
    measured = (background + k * basis) * (1 + 0.05 * rng.standard_normal(400))
    return Channel(measured, background, rng.random(400), rng.random(400)), basis


@pytest.mark.parametrize("name", METRICS)
def test_scale_is_the_minimum_of_its_metric(name):
    metric = METRICS[name]
    channel, basis = noisy(0.7)
    k, total = solve_scale(metric, channel, basis[None], steps=40)
    assert k[0] == pytest.approx(0.7, rel=0.03)
    for other in (0.98, 0.995, 1.005, 1.02):
        at = float(k[0] * other)
        assert solve_scale(metric, channel, basis[None], (at, at))[1][0] >= total[0] * (1 - 1e-9)


def test_scale_respects_its_limits():
    channel, basis = noisy(0.7)
    assert solve_scale(METRICS["l1"], channel, basis[None], (0.0, 0.5))[0][0] == 0.5
    assert solve_scale(METRICS["cuberoot"], channel, basis[None], (0.9, 2.0))[0][0] == 0.9
