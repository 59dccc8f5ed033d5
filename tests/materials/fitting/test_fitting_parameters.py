"""Restrictions of parameters, and the coefficients that are solved for: of lobes and of the diffuse term."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from lambent.core.errors import UserError
from lambent.materials.document import Lobe, Material
from lambent.materials.fitting.parameters import check, parse_fix, parse_ranges
from lambent.materials.fitting.scale import Channel, diffuse_mode, solve_scale, weighted_median
from lambent.materials.measured.inspecting.metrics import METRICS
from tests.materials.fitting.known_answers import FEW, grey


def test_options_are_read():
    assert parse_fix(["mx=.1", "kd=.1,.2,.3"]) == {"mx": 0.1, "kd": (0.1, 0.2, 0.3)}
    assert parse_ranges(["alpha=0:.5"]) == {"alpha": (0.0, 0.5)}


@pytest.mark.parametrize("option", ["mx", "=1", "mx=", "mx=rough", "kd=1,2"])
def test_bad_fix_options(option):
    with pytest.raises(UserError):
        parse_fix([option])


@pytest.mark.parametrize("option", ["mx=.1", "mx=.1:.2:.3", "mx=a:b"])
def test_bad_range_options(option):
    with pytest.raises(UserError):
        parse_ranges([option])


@pytest.mark.parametrize(
    ("fix", "ranges", "says"),
    [
        ({"alhpa": 0.5}, {}, "did you mean 'alpha'"),
        ({"mx_2": 0.5}, {}, "unknown parameter"),
        ({"alpha": 1.5}, {}, "out of bounds"),
        ({"mx": float("nan")}, {}, "out of bounds"),
        ({}, {"r0": (0.5, 0.5)}, "empty range"),
        ({}, {"kd": (0.0, 0.5)}, "no range"),
        ({"mx": 0.1}, {"mx": (0.1, 0.2)}, "both fixed"),
    ],
)
def test_impossible_restrictions(fix, ranges, says):
    with pytest.raises(UserError, match=says):
        check(fix, ranges, lobes=1)


def test_numbered_lobes_are_known():
    check({"mx_2": 0.1, "t_alpha_2": 0.3}, {"ks_2": (0.0, 0.5)}, lobes=2)


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


def mode_of(material: Material) -> float:
    samples = grey(material, FEW)
    return diffuse_mode(samples.f[:, 0], samples.weight * samples.wo[:, 2])


@pytest.mark.parametrize("m", [0.05, 0.1, 0.2])
@pytest.mark.parametrize("kd", [0.01, 0.1, 0.76])
def test_diffuse_under_a_lobe_and_noise(kd, m):
    assert mode_of(Material(kd=kd, lobes=(Lobe(k=0.5, mx=m, my=m, r0=0.1, alpha=0.4),))) == pytest.approx(kd, rel=0.03)


@pytest.mark.parametrize("m", [0.05, 0.2, 0.5])
def test_a_lobe_alone_has_no_diffuse_term(m):
    assert mode_of(Material(lobes=(Lobe(k=0.9, mx=m, my=m, r0=0.9, alpha=0.4),))) < 1e-3


def test_clipped_zeros_do_not_hide_the_mode():
    f = np.where(np.arange(1000) % 10 == 0, 0.0, 0.1 * (1 + 0.02 * np.sin(np.arange(1000))))
    assert diffuse_mode(f, np.ones(1000)) == pytest.approx(0.1 * np.pi, rel=0.02)
    assert diffuse_mode(np.where(np.arange(1000) % 2 == 0, 0.0, f), np.ones(1000)) == 0
    assert diffuse_mode(np.zeros(0), np.zeros(0)) == 0
