"""The search and its derivatives, restrictions of parameters, coefficients that are solved for, readings below zero."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from lambent.core.errors import UserError
from lambent.core.geometry.directions import Floats, direction
from lambent.core.progress import silent
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.export import rgl
from lambent.materials.fitting import gradient
from lambent.materials.fitting.fit import fit
from lambent.materials.fitting.gradient import Bounds, _normal_equations, _unknowns, minimise
from lambent.materials.fitting.parameters import box_of, check, parse_fix, parse_ranges, to_search
from lambent.materials.fitting.problem import Candidate, Mixture, problem_of
from lambent.materials.fitting.scale import Channel, diffuse_mode, solve_scale, weighted_median
from lambent.materials.measured import load
from lambent.materials.measured.inspecting.metrics import METRICS
from lambent.materials.measured.inspecting.synthetic import synthesise
from lambent.materials.measured.parts.tensor_file import read_tensors, tensor_bytes
from lambent.materials.measured.protocol import MeasuredTable
from tests.materials.fitting.known_answers import FEW, FOIL, ISOTROPIC, PAINT, grey


def test_options_are_read():
    assert parse_fix(["mx=.1", "kd=.1,.2,.3"]) == {"mx": 0.1, "kd": (0.1, 0.2, 0.3)}
    assert parse_ranges(["alpha=0:.5"]) == {"alpha": (0.0, 0.5)}


BAD = {parse_fix: ["mx", "=1", "mx=", "mx=rough", "kd=1,2"], parse_ranges: ["mx=.1", "mx=.1:.2:.3", "mx=a:b"]}


@pytest.mark.parametrize(("parse", "option"), [(parse, option) for parse, options in BAD.items() for option in options])
def test_bad_options(parse, option):
    with pytest.raises(UserError):
        parse([option])


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


FAINT = Lobe(k=(0.6, 0.5, 0.1), mx=0.15, my=0.15, r0=(0.04,) * 3, alpha=0.3)
YELLOW = Material(name="yellow", kd=(0.8, 0.55, 0.0), lobes=(FAINT,))  # blue is the faint lobe alone
GOLD = Material(name="gold", kd=(0.02, 0.01, 0.0), lobes=(Lobe(k=(0.9, 0.7, 0.1), mx=0.2, my=0.2, r0=(0.6,) * 3),))
BLUE, DEFICIT = 2, 0.005
WI = direction(np.radians([10.0, 30.0, 50.0, 70.0]), 0.0)
SEEN = "cuberoot"  # takes a reading below zero as 0, the other metrics take it as measured


def changed(file: Path, folder: Path, channel: int = 0, deficit: float = 0.0, noise: float = 0.0) -> MeasuredTable:
    """The table of an RGL file with a channel lowered, and noise about zero added."""
    tensors = dict(read_tensors(file))
    values = tensors["rgb"] + noise * np.random.default_rng(0).standard_normal(tensors["rgb"].shape)
    values[:, :, channel] -= deficit
    path = folder / "changed.bsdf"
    path.write_bytes(tensor_bytes(tensors | {"rgb": values.astype(np.float32)}))
    return load(path)


@pytest.fixture(scope="module", params=[YELLOW, GOLD], ids=lambda material: material.name)
def clean(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The RGL file of a saturated material, small."""
    path = tmp_path_factory.mktemp("clean") / "clean.bsdf"
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(rgl, "THETA_I_DEG", rgl.THETA_I_DEG[::4])
        patched.setitem(rgl.NODES, "isotropic", 24)
        rgl.write(request.param, path)
    return path


def light(table: MeasuredTable, metric: str) -> tuple[Floats, Floats]:
    """Albedo (3,) of the fit and of the whole table, means over theta_i."""
    bsdf = MaterialBSDF(fit(table, metric=metric).material)
    return bsdf.albedo(WI).mean(axis=0), table.reflectivity(WI).mean(axis=0)


@pytest.mark.long
@pytest.mark.parametrize("metric", [SEEN, "l1"])
def test_other_channels_do_not_notice_a_negative_one(clean: Path, tmp_path: Path, metric: str) -> None:
    before, table = load(clean), changed(clean, tmp_path, BLUE, DEFICIT)
    samples = table.samples()
    assert samples.below_zero > 0.15 * len(samples) and len(samples) == len(before.samples())
    (one, _), (other, _) = light(table, metric), light(before, metric)
    # The lobe's shape is shared, and the cube root sees that the blue lobe is cut off.
    np.testing.assert_allclose(one[:BLUE], other[:BLUE], rtol=0.025 if metric == SEEN else 0.02)
    assert 0 <= other[BLUE] - one[BLUE] < np.pi * DEFICIT


@pytest.mark.long
@pytest.mark.parametrize("metric", [SEEN, "l1"])
def test_noise_about_zero_leaves_the_albedo(clean: Path, tmp_path: Path, metric: str) -> None:
    table = changed(clean, tmp_path, noise=DEFICIT)
    assert table.samples().below_zero > 0.1 * len(table.samples())
    (one, _), (other, _) = light(table, metric), light(load(clean), metric)
    np.testing.assert_allclose(one, other, rtol=0.02, atol=0.003 if metric == SEEN else 0.001)


@pytest.mark.parametrize(("metric", "taken"), [("cuberoot", "as 0"), ("l1", "as measured"), ("log", "as measured")])
def test_what_was_done_is_said(metric: str, taken: str) -> None:
    samples = synthesise(YELLOW, replace(FEW, floor=0.01)).samples()
    provenance = fit(samples, metric=metric).material.provenance
    assert provenance is not None and provenance.samples["below_zero"] == samples.below_zero > 0
    assert provenance.samples["used"] == len(samples) and "negative" not in provenance.samples
    (line,) = (note for note in provenance.notes if "below zero" in note)
    assert line.startswith(f"{samples.below_zero} of {len(samples)} tuples") and "a fit keeps them" in line
    assert f"the {metric} metric counts them {taken}" in line
    clean = fit(synthesise(YELLOW, replace(FEW, floor=0.0)).samples(), metric=metric).material.provenance
    assert clean is not None and not any("below zero" in note for note in clean.notes)


@pytest.mark.parametrize("name", METRICS)
def test_transforms_of_negative_values(name: str) -> None:
    """Finite for any; noise about zero keeps no mean but under the cube root, whose slope at 0 would magnify it."""
    metric, x = METRICS[name], np.array([-30.0, -1.0, -0.1, -1e-3, 0.0])
    assert np.isfinite(metric.transform(x)).all() and metric.clamps == (name == SEEN)
    expected = np.full(5, metric.transform(0.0)) if metric.clamps else -metric.transform(-x)
    np.testing.assert_allclose(metric.transform(x), expected)


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
