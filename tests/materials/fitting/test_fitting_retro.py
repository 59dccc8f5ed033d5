"""A retro-reflective lobe is fitted where the table shows one, and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.bench.scenes.retro_tapes import TAPES
from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.fitting.fit import fit
from lambent.materials.fitting.parameters import box_of, check, to_search
from lambent.materials.fitting.problem import Candidate, Mixture, problem_of
from lambent.materials.measured.inspecting.faults import towards_light
from lambent.materials.measured.inspecting.metrics import METRICS
from lambent.materials.measured.inspecting.synthetic import ISOTROPIC, synthesise

SETUP = replace(ISOTROPIC, about_lamp=True, sector_deg=0.0, step_deg=5.0, fine_deg=1.0)
BEADS = Material(
    name="beads",
    kd=(0.2,) * 3,
    lobes=(
        Lobe(mx=0.08, my=0.08, r0=(0.05,) * 3),
        Lobe(retro=True, distribution="beckmann", mx=0.03, my=0.03, r0=(1.0,) * 3, k=(0.3,) * 3, alpha=-1.2),
    ),
)


@pytest.fixture(scope="module")
def beads():
    return synthesise(BEADS, SETUP).samples()


@pytest.fixture(scope="module", params=TAPES, ids=lambda tape: tape.name)
def tape(request):
    return request.param, request.param.measured().samples(40_000)


def test_known_answers_are_found(beads):
    result = fit(beads)
    mirror, retro = result.material.lobes
    assert mirror.mirrors and retro.retro and retro.r0[0] == 1
    assert result.material.kd[0] == pytest.approx(0.2, rel=0.01)
    for name, true in (("mx", 0.03), ("alpha", -1.2)):
        assert getattr(retro, name) == pytest.approx(true, rel=0.01)
    assert retro.k[0] == pytest.approx(0.3, rel=0.01)
    assert mirror.mx == pytest.approx(0.08, rel=0.02)


@pytest.mark.parametrize("metric", ["l1", "l2_ngan", "log"])
def test_every_metric_finds_it(beads, metric):
    retro = fit(beads, metric=metric).material.lobes[-1]
    assert retro.retro and retro.k[0] == pytest.approx(0.3, rel=0.03) and retro.mx == pytest.approx(0.03, rel=0.03)


def test_tapes_of_other_shape_keep_their_peak(tape):
    tape, samples = tape
    without, with_it = fit(samples, retro=False), fit(samples)
    assert not any(lobe.retro for lobe in without.material.lobes)
    assert with_it.errors["cuberoot"] < 0.3 * without.errors["cuberoot"]
    for theta, tolerance in ((0.0, 0.2), (25.0, 0.2), (45.0, 0.4)):  # the lobe narrows across the plane as cos theta
        wi = direction(np.radians(theta), 0.0)
        assert MaterialBSDF(with_it.material).eval(wi, wi)[0] == pytest.approx(tape.eval(wi, wi)[0], rel=tolerance)
    assert any("removes" in note and "(added)" in note for note in with_it.material.provenance.notes)


def test_it_is_not_tried_where_nothing_is_brighter_near_the_light():
    plain = synthesise(BEADS.model_copy(update={"lobes": BEADS.lobes[:1]}), SETUP).samples()
    assert towards_light(plain) < 1.1
    result = fit(plain)
    assert len(result.material.lobes) == 1
    assert not any("retro" in note for note in result.material.provenance.notes)


def test_its_parameters_have_names(beads):
    check({"r_mx": 0.002, "r_alpha": -3.0, "kr": 0.2}, {}, lobes=1)
    with pytest.raises(UserError, match="out of bounds"):
        check({"r_alpha": -5.0}, {}, lobes=1)
    fix = {"r_alpha": -1.0, "kr": 0.25, "r_r0": 0.35}  # exp(log(0.35)) is another number
    retro = fit(beads, fix=fix, ranges={"r_mx": (0.02, 0.025)}).material.lobes[-1]
    assert (retro.alpha, retro.k[0], retro.r0[0]) == (-1.0, 0.25, 0.35) and 0.02 <= retro.mx <= 0.025


def test_derivatives_are_those_of_the_model(beads):
    problem = problem_of(beads, "reflection", METRICS["log"], "ggx", False, retro=True)
    shape = np.array([0.03, 0.05, 0.6, -1.2])
    exact = problem.log_derivatives(shape, False, retro=True)
    for axis, derivative in enumerate(exact):
        steps = np.zeros(4)
        steps[axis] = 1e-5
        ends = [np.exp(np.log(np.abs(shape)) + sign * steps) * np.sign(shape) for sign in (1, -1)]
        if axis == 3:
            ends = [shape + sign * steps for sign in (1, -1)]
        up, down = (np.log(problem.basis(end, retro=True)) for end in ends)
        np.testing.assert_allclose((up - down) / 2e-5, derivative, rtol=1e-4, atol=1e-4)


def test_the_problem_evaluates_as_the_document_does(beads):
    problem = problem_of(beads, "reflection", METRICS["l1"], "beckmann", False, retro=True)
    lobes = [
        Candidate(to_search(np.array([lobe.mx, lobe.my, lobe.r0[0], lobe.alpha])), np.array(lobe.k), lobe.retro)
        for lobe in BEADS.lobes
    ]
    found = problem.evaluate(Mixture(np.array(BEADS.kd), tuple(lobes)))
    np.testing.assert_allclose(found.T, MaterialBSDF(BEADS).eval(beads.wi, beads.wo), rtol=1e-6)
    assert box_of("retro", 0, True, 1, {}, {}).retro
