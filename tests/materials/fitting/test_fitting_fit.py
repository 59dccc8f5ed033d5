"""Fits of tables with known answers: lobes, a retro-reflective one where the table shows it, and the albedo."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from lambent.bench.scenes.retro_tapes import TAPES
from lambent.core.errors import UserError
from lambent.core.geometry.directions import FLIP_Z, direction, normalize
from lambent.core.plain import plain
from lambent.core.progress import Cancelled
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.fitting import account
from lambent.materials.fitting.fit import fit
from lambent.materials.fitting.gradient import Bounds, _add_albedos, _moved, _unknowns
from lambent.materials.fitting.parameters import box_of, check, to_search
from lambent.materials.fitting.problem import Candidate, Mixture, problem_of
from lambent.materials.measured.inspecting.inspection import towards_light
from lambent.materials.measured.inspecting.metrics import METRICS, errors_of
from lambent.materials.measured.inspecting.synthetic import synthesise
from lambent.materials.measured.protocol import MeasuredTable, TableInfo, collect
from tests.materials.fitting.known_answers import FEW, FOIL, ISOTROPIC, KNOWN, PAINT, TWO_LOBES, grey, setup_of

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


@pytest.mark.long
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


COAT = Lobe(k=(0.8,) * 3, r0=(0.04,) * 3, mx=0.05, my=0.05, alpha=0.7)
CAR = Material(name="dark red paint", kd=(0.01, 0.002, 0.002), lobes=(COAT,))
DENSE_DEG = 20  # up to this theta_i the highlight is measured


class CarPaint(MeasuredTable):
    """A clear coat, whose Fresnel rise no tuple shows: beyond 20 degrees the highlight was not measured."""

    def __init__(self, material=CAR):
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


@pytest.fixture(scope="module")
def paint():
    return grey(PAINT, FEW)


def true_errors(samples, material):
    return errors_of(samples, MaterialBSDF(material).eval(samples.wi, samples.wo)[:, : samples.f.shape[1]])


SHAPES = ("mx", "my", "alpha", "r0")


@pytest.mark.long
@pytest.mark.parametrize("name", ["white foil", "miro 5, two lobes"])
def test_the_thesis_materials_are_recovered(name):
    material = KNOWN[name]
    samples = grey(material, setup_of(material))
    result = fit(samples, lobes=len(material.reflection_lobes), metric="l1")
    assert result.errors["l1"] <= true_errors(samples, material)["l1"]
    assert result.material.kd[0] == pytest.approx(material.kd[0], rel=0.01)
    tolerance = 0.1 if name.startswith("miro") else 0.05
    for found, true in zip(result.material.lobes, material.lobes, strict=True):
        assert found.side == true.side
        for shape in SHAPES[: 4 if true.side == "reflection" else 3]:
            assert np.mean(getattr(found, shape)) == pytest.approx(np.mean(getattr(true, shape)), rel=tolerance)
        if true.side == "transmission":
            assert found.k[0] * (1 - found.r0[0]) == pytest.approx(true.k[0] * (1 - true.r0[0]), rel=0.02)


@pytest.mark.long
def test_only_the_product_of_a_transmission_is_measured():
    result = fit(grey(FOIL, replace(ISOTROPIC, step_deg=8)))
    assert any("kt (1 - r0)" in line for line in result.warnings)


@pytest.mark.parametrize("metric", METRICS)
def test_every_metric_finds_the_lobe(paint, metric):
    result = fit(paint, metric=metric)
    (lobe,) = result.material.lobes
    assert lobe.mx == lobe.my == pytest.approx(0.15, rel=0.03)
    assert lobe.k[0] * lobe.r0[0] == pytest.approx(0.042, rel=0.1)
    assert result.errors[metric] < 0.1 * result.lambertian_errors[metric]
    assert set(result.errors) == set(METRICS) == set(result.lambertian_errors)


def test_provenance_accounts_for_the_fit(paint, tmp_path):
    source = tmp_path / "table"
    source.write_bytes(b"measured")
    result = fit(paint, source=source, fix={"alpha": 0.3})
    provenance = result.material.provenance
    assert provenance.errors == result.errors
    assert provenance.metric == "cuberoot"
    assert len(provenance.source_sha256) == 64
    assert provenance.samples["used"] == len(paint)
    assert provenance.samples["shadowed"] == paint.left_out.shadowed > 0
    assert "alpha fixed at 0.3" in provenance.notes


def test_fixed_parameters_stay_fixed_and_ranges_are_respected(paint):
    result = fit(paint, fix={"mx": 0.3, "ks": 0.5, "kd": 0.1}, ranges={"alpha": (0.6, 0.9), "r0": (0.2, 0.4)})
    (lobe,) = result.material.lobes
    assert (lobe.mx, lobe.my, lobe.k, result.material.kd) == (0.3, 0.3, (0.5,) * 3, (0.1,) * 3)
    assert 0.6 <= lobe.alpha <= 0.9
    assert 0.2 - 1e-9 <= lobe.r0[0] <= 0.4 + 1e-9
    assert any("bound" in line for line in result.warnings)


@pytest.mark.parametrize("stop", [Cancelled, KeyboardInterrupt])
def test_cancelled_fit_gives_the_best_so_far(paint, stop):
    calls = []

    def progress(done, total, what):
        calls.append(what)
        if len(calls) == 6:
            raise stop

    result = fit(paint, progress=progress)
    assert result.partial
    assert "cancelled" in result.warnings[0]
    assert result.errors["cuberoot"] < 0.3 * result.lambertian_errors["cuberoot"]


def test_progress_rises_to_its_end(paint):
    seen = []
    fit(paint, distribution="best", progress=lambda done, total, what: seen.append(done / total))
    assert seen == sorted(seen) and seen[0] == 0 and seen[-1] == 1


@pytest.mark.long
def test_the_number_of_lobes_is_found(paint):
    assert len(fit(paint, lobes="auto").material.lobes) == 1
    assert len(fit(grey(TWO_LOBES, FEW), lobes="auto").material.lobes) == 2


@pytest.mark.long
def test_lobes_that_explain_nothing_are_not_added():
    flat = fit(grey(PAINT.model_copy(update={"lobes": ()}), replace(FEW, noise=0, floor=0)), lobes=4)
    assert len(flat.material.lobes) < 4
    assert any("reduces the error no further" in line for line in flat.warnings)
    assert flat.errors["cuberoot"] < 1e-3


def test_the_better_distribution_is_found():
    ggx = PAINT.model_copy(update={"lobes": (PAINT.lobes[0].model_copy(update={"distribution": "ggx"}),)})
    for material, name in ((PAINT, "beckmann"), (ggx, "ggx")):
        result = fit(grey(material, FEW), distribution="best")
        assert [lobe.distribution for lobe in result.material.lobes] == [name]


@pytest.mark.parametrize("metric", ["l1", "cuberoot"])
@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize("value", [0.0, 0.3])
def test_degenerate_tables_give_a_finite_material(paint, metric, count, value):
    few = replace(
        paint,
        wi=paint.wi[:count],
        wo=paint.wo[:count],
        weight=paint.weight[:count] + 1e-3,
        f=np.full((count, 1), value),
    )
    result = fit(few, metric=metric)
    assert all(np.isfinite(list(result.errors.values())))
    assert result.errors[metric] < 1e-3


def test_lost_light_is_reported(paint):
    lines = fit(paint, fix={"kd": 0.1, "ks": 0.7, "mx": 0.15, "r0": 0.06, "alpha": 0.3}).warnings
    assert any("reflects 0." in line and "times the light that was measured" in line for line in lines)
    assert not any("times the light" in line for line in fit(paint).warnings)


def test_a_peak_that_is_missed_is_reported(paint):
    lines = fit(paint, fix={"mx": 0.5}).warnings
    assert any("of the measured peak" in line and "l2_ngan" in line for line in lines)
    assert not any("of the measured peak" in line for line in fit(paint).warnings)


def test_a_coupled_diffuse_term_is_recovered():
    coupled = PAINT.model_copy(update={"kd_coupled": True, "kd": (0.5,) * 3})
    samples = grey(coupled, FEW)
    with_it, without = fit(samples, coupled=True), fit(samples)
    assert with_it.material.kd_coupled
    assert with_it.material.kd[0] == pytest.approx(0.5, rel=0.01)
    assert with_it.errors["cuberoot"] < 0.8 * without.errors["cuberoot"]


def test_impossible_requests(paint):
    impossible = [{"metric": "l3"}, {"distribution": "ggxx"}, {"lobes": 0}, {"lobes": 5}]
    impossible += [{"gain": 0.0}, {"gain": 1.0}, {"fix": {"mxx": 1.0}}, {"fix": {"t_mx": 0.1}}]
    for options in impossible:
        with pytest.raises(UserError):
            fit(paint, **options)
