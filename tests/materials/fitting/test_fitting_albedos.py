"""Albedo over the angle of incidence: compared with the whole table, said, and kept where it is asked for."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import FLIP_Z, direction, normalize
from lambent.core.plain import plain
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.fitting import account
from lambent.materials.fitting.fit import fit
from lambent.materials.fitting.gradient import Bounds, _add_albedos, _moved, _unknowns
from lambent.materials.fitting.parameters import box_of
from lambent.materials.fitting.problem import Candidate, Mixture, problem_of
from lambent.materials.measured.inspecting.metrics import METRICS
from lambent.materials.measured.protocol import MeasuredTable, TableInfo, collect

COAT = Lobe(k=(0.8,) * 3, r0=(0.04,) * 3, mx=0.05, my=0.05, alpha=0.7)
PAINT = Material(name="dark red paint", kd=(0.01, 0.002, 0.002), lobes=(COAT,))
DENSE_DEG = 20  # up to this theta_i the highlight is measured


class CarPaint(MeasuredTable):
    """A clear coat, whose Fresnel rise no tuple shows: beyond 20 degrees the highlight was not measured."""

    def __init__(self, material=PAINT):
        self.bsdf = MaterialBSDF(material)
        self.info = TableInfo("paint", "test", True, False, 3, "f")

    def eval(self, wi, wo):
        return np.where((wi[..., 2:] > 0) & (wo[..., 2:] > 0), self.bsdf.eval(wi, wo), 0.0)

    def samples(self, max_count=None):
        random, wi, wo = np.random.default_rng(0), [], []
        theta, phi = np.meshgrid(np.radians(np.arange(0, 84, 6)), np.radians(np.arange(0, 360, 15)))
        for theta_i in (0, 10, 20, 30, 45, 60, 70):
            light = direction(np.radians(theta_i), 0.0)
            mirror, seen = light * (-1, -1, 1), direction(theta, phi).reshape(-1, 3)
            if theta_i > DENSE_DEG:
                seen = seen[seen @ mirror < np.cos(np.radians(25))][::20]
            else:
                seen = np.concatenate([seen, normalize(mirror + random.normal(0, 0.06, (80, 3)))])
            wo.append(seen)
            wi.append(np.broadcast_to(light, seen.shape))
        wi, wo = np.concatenate(wi), np.concatenate(wo)
        f = self.eval(wi, wo)
        f = f * (1 + 0.02 * random.standard_normal(f.shape))
        return collect(wi, wo, f, np.ones(len(f)), self.info, np.zeros(len(f), dtype=bool), max_count)


@pytest.mark.parametrize("metric", ["log", "cuberoot"])
def test_a_small_error_with_a_wrong_albedo_is_flagged_and_keeping_it_mends_it(metric):
    plain_fit = fit(CarPaint(), metric=metric)
    (one,) = plain_fit.albedos
    row, _ = one.worst
    assert plain_fit.errors[metric] < 0.03 * plain_fit.lambertian_errors[metric]
    assert one.doubtful and not 0.6 < one.ratio[one.worst] < 1.6 and one.theta_deg[row] >= 60
    assert any(str(one) in line and "--keep-albedo" in line for line in plain_fit.warnings)
    assert "albedo in reflection at worst" in str(one) and "at theta_i 70 degrees" in str(one)

    kept = fit(CarPaint(), metric=metric, keep_albedo=True)
    assert kept.errors[metric] < 1.02 * plain_fit.errors[metric]
    np.testing.assert_allclose(kept.albedos[0].fit, kept.albedos[0].table, rtol=0.02)
    assert kept.material.lobes[0].r0[0] == pytest.approx(0.04, rel=0.05)
    assert not any("albedo in" in line for line in kept.warnings)
    assert "albedo kept" in kept.material.provenance.method


def test_a_good_fit_says_so_and_the_comparison_is_json():
    dense = Material(kd=0.4, lobes=(COAT.model_copy(update={"mx": 0.3, "my": 0.3}),))
    result = fit(CarPaint(dense), fix={"r0": 0.04, "alpha": 0.7})
    assert not result.albedos[0].doubtful
    facts = json.loads(json.dumps(plain(result.albedos[0].to_json())))
    assert facts["theta_i_deg"][0] == 0 and len(facts["table"]) == len(facts["fit"]) == len(facts["theta_i_deg"])


def test_the_albedos_are_the_whole_tables_at_measured_angles():
    table = CarPaint()
    curve = account.curves_of(table, table.samples())["reflection"]
    assert curve.theta_deg.tolist() == [0, 15, 30, 45, 60, 70]
    wi = direction(np.radians(curve.theta_deg), 0.0)
    np.testing.assert_allclose(curve.albedo, table.reflectivity(wi))
    np.testing.assert_allclose(curve.of(table.eval(curve.pairs.wi, curve.pairs.wo)), curve.albedo, rtol=0.01)


def test_where_much_was_not_measured_is_said_and_does_not_count():
    class Short(CarPaint):
        def samples(self, max_count=None):
            whole = super().samples()
            near = whole.wo[:, 2] > np.cos(np.radians(70))
            return replace(whole, **{name: getattr(whole, name)[near] for name in ("wi", "wo", "f", "weight")})

    (one,) = fit(Short(), metric="log").albedos
    assert one.theta_deg[one.guessed].tolist() == [70]
    assert one.theta_deg[one.worst[0]] == 60
    assert "times at 70 degrees, where much was not measured" in str(one)


def test_the_sheet_of_a_file_with_light_from_behind_alone_is_turned_over():
    class Behind(CarPaint):
        def reflectivity(self, wi):
            return np.where(wi[..., 2:] < 0, super().reflectivity(wi * FLIP_Z), 0.0)

    table = Behind()
    np.testing.assert_allclose(
        account.curves_of(table, table.samples())["reflection"].albedo,
        account.curves_of(CarPaint(), table.samples())["reflection"].albedo,
    )


def test_what_cannot_be_kept_is_refused():
    with pytest.raises(UserError, match="needs a whole table"):
        fit(CarPaint().samples(), keep_albedo=True)


@pytest.mark.parametrize("metric", METRICS)
@pytest.mark.parametrize("distribution", ["beckmann", "ggx"])
def test_the_derivatives_of_the_kept_albedos_are_those_of_their_error(metric, distribution):
    table = CarPaint()
    samples = table.samples(500)
    problem = problem_of(samples, "reflection", METRICS[metric], distribution, False)
    kept = account.keep(account.curves_of(table, samples)["reflection"], problem, False).kept
    bounds = Bounds((box_of("reflection", 0, True, 3, {}, {}),), True)
    shape = np.array([np.log(0.1), np.log(0.1), np.log(0.2), 0.4])
    start = Mixture(np.array([0.1, 0.2, 0.3]), (Candidate(shape, np.array([0.3, 0.2, 0.1])),))
    unknowns = _unknowns(bounds, start)
    gradient = np.zeros(len(unknowns))
    _add_albedos(kept, bounds, start, unknowns, np.zeros((len(unknowns),) * 2), gradient)
    x, step = np.array([u.start for u in unknowns]), 1e-5
    for i in range(len(unknowns)):
        ends = [
            kept.remaining(_moved(bounds, start, unknowns, x + sign * step * np.eye(len(x))[i])) for sign in (-1, 1)
        ]
        slope = (ends[1] - ends[0]) / (2 * step) * 3  # the error is a mean over channels, the gradient a sum
        assert -gradient[i] * METRICS[metric].power == pytest.approx(slope, rel=1e-3, abs=1e-7)
