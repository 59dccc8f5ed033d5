"""The checks name faults and pass sound materials and tables; normalised materials return no more than arrives."""

from __future__ import annotations

import json
from functools import partial

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.checking import check as module
from lambent.materials.checking import check_table as table_module
from lambent.materials.checking.check import check, check_sampler, furnace
from lambent.materials.checking.check_table import check_table
from lambent.materials.checking.normalise import NOTE, change, normalisation, normalised, with_less_alpha, with_less_k
from lambent.materials.document import Lobe, Material, Provenance
from lambent.materials.export import lbnl_xml
from lambent.materials.fitting.fit import fit
from lambent.materials.measured import load
from lambent.materials.measured.protocol import TableInfo
from lambent.materials.measured.tables.half_vector_grid import GridShape
from lambent.materials.measured.tables.scattered import ScatteredTable
from tests.materials.export.formula_table import FormulaTable
from tests.materials.fitting.known_answers import FEW, PAINT, grey

SMALL = GridShape(24, 1, 64, 32)
GLOSSY = Material(kd=(0.1, 0.2, 0.3), lobes=(Lobe(mx=0.2, my=0.2, k=0.5, r0=0.5, alpha=0.2),))


def exact(material=GLOSSY, strength=0.0):
    """A table without gaps, from a material document, made brighter by `strength` where the light is higher."""

    def f(wi, wo):
        above = (wi[..., 2:] > 0) & (wo[..., 2:] > 0)
        return np.where(above, MaterialBSDF(material).eval(wi, wo) * (1 + strength * (wi[..., 2:] - wo[..., 2:])), 0.0)

    return FormulaTable(f, channels=3, isotropic=True)


@pytest.fixture
def quick_table(monkeypatch):
    monkeypatch.setattr(module, "SAMPLER_THETA_DEG", (45.0,))
    monkeypatch.setattr(module, "check_sampler", partial(module.check_sampler, samples=1 << 18))
    monkeypatch.setattr(table_module, "INTEGRAL_THETA_DEG", (40.0,))
    monkeypatch.setattr(table_module, "PAIRS", 20_000)
    for place in (module, table_module):
        monkeypatch.setattr(place, "THETA_DEG", (0, 30, 60, 75, 84, 89))


@pytest.mark.long
def test_a_sound_table_passes_and_the_report_is_json(quick_table):
    report = check_table(exact(), shape=SMALL)
    assert report.passed and not report.warnings, report
    assert report.reciprocity_share < 1e-12 and 0 < report.resampling_share < 0.03
    assert report.integrals[0].deviation < 0.01
    expected = MaterialBSDF(GLOSSY).albedo(np.array([0, 0, 1.0]), samples=200_000)
    np.testing.assert_allclose(report.furnace.albedo[0, 0], expected, rtol=0.01)
    data = json.loads(json.dumps(report.to_json()))
    assert data["passed"] and np.shape(data["furnace"]["albedo"]) == (6, 1, 3) and len(data["sampler"]) == 1


@pytest.mark.parametrize(("strength", "passes"), [(0.1, True), (1.0, False)])
def test_asymmetry_is_reported_and_only_much_of_it_fails(quick_table, strength, passes):
    """For a matt surface |f - f'| = 2 s |cos_i - cos_o| f, whose mean over both cosine-weighted hemispheres is 4/15."""
    report = check_table(exact(Material(kd=0.5), strength), shape=SMALL)
    assert report.reciprocity_share == pytest.approx(2 * strength * 4 / 15, rel=0.05)  # but for the last 6 degrees
    assert report.passed == passes and any("swapping" in text for text in report.failures) != passes


def test_a_table_that_returns_more_than_arrives_fails(quick_table):
    report = check_table(exact(Material(kd=1.1)), shape=SMALL)
    assert "without bound" in report.failures[0] and "1.1" in report.warnings[0]


@pytest.mark.long
def test_an_albedo_that_is_not_the_integral_fails(quick_table):
    """Its eval lacks a cosine that its albedo has."""
    table = FormulaTable(lambda wi, wo: exact().eval(wi, wo) * np.abs(wo[..., 2:]), channels=3, isotropic=True)
    table.albedo = exact().albedo
    report = check_table(table, shape=SMALL)
    assert any("its quadrature" in text for text in report.failures), report


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    """A BSDF file of a diffusing film, with transmission alone; the same with any number of directions."""
    path = tmp_path_factory.mktemp("film") / "film.xml"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lbnl_xml, "LOBES_LOG2", 5)
        lbnl_xml.write(Material(name="film", kt_d=0.6), path)
    return path


def test_a_file_of_transmission_alone_passes(quick_table, film):
    """No pair of directions is left to be swapped."""
    report = check_table(load(film))
    assert report.passed and not report.warnings, report
    assert report.reciprocity_share == 0 and report.integrals[0].from_table == pytest.approx(0.6, rel=0.01)


def test_a_table_answers_no_question_with_no_values(film):
    table, none = load(film), np.zeros((0, 3))
    assert table.eval(none, none).shape == (0, 1)
    assert all(look_up(none).shape == (0, 1) for look_up in (table.reflectivity, table.transmissivity, table.albedo))


def test_a_scattered_table_warns_where_nothing_was_measured(quick_table, monkeypatch):
    monkeypatch.setattr(table_module, "PAIRS", 2000)
    monkeypatch.setattr(table_module, "INTEGRAL_THETA_DEG", ())
    monkeypatch.setattr(module, "check_samplers", lambda *_: ())
    monkeypatch.setattr(module, "sampler_failures", lambda _: [])
    random = np.random.default_rng(0)
    wi, wo = (direction(np.arccos(random.uniform(0.5, 1, 800)), random.uniform(0, 2 * np.pi, 800)) for _ in range(2))
    table = ScatteredTable(wi, wo, MaterialBSDF(GLOSSY).eval(wi, wo), TableInfo("a", "test", True, False, 3, "f"))
    report = check_table(table, shape=GridShape(8, 1, 24, 12))
    assert any("nothing was measured near" in line and "beyond theta 60 degrees" in line for line in report.warnings)


@pytest.fixture
def few_directions(monkeypatch):
    """Of the furnace: the axes, and above all near grazing."""
    monkeypatch.setattr(module, "THETA_DEG", (0, 45, 75, 82, 85, 87, 89))
    monkeypatch.setattr(module, "PHI_DEG", (0.0, 90.0))


STEEP = Material(lobes=(Lobe(mx=0.5, my=0.5, r0=1, alpha=1),))
BRIGHT = Material(kd=0.2, lobes=(Lobe(k=2, mx=0.2, my=0.2, r0=0.7, alpha=0.0),))


@pytest.mark.long
def test_normalised_does_not_exceed_one(few_directions):
    material, tame = FOIL, normalised(FOIL)
    assert furnace(material).highest[0] > 1 >= furnace(tame).highest[0]
    assert all(now.alpha < before.alpha for now, before in zip(tame.lobes, material.lobes, strict=True))
    assert tame.kd == material.kd and [o.mx for o in tame.lobes] == [o.mx for o in material.lobes]
    _, theta, phi = furnace(material).highest
    assert check_sampler(MaterialBSDF(tame), theta, phi, samples=200_000).albedo_quadrature <= 1.002


@pytest.mark.long
def test_alpha_or_k_is_lowered_whichever_is_the_cause(few_directions):
    less_alpha, less_k = with_less_alpha(STEEP), with_less_k(STEEP)
    assert less_alpha.lobes[0].k == STEEP.lobes[0].k and 0 < less_alpha.lobes[0].alpha < 1
    assert change(STEEP, less_alpha) < 0.7 * change(STEEP, less_k)
    assert normalised(BRIGHT).lobes[0].alpha == 0 and normalised(BRIGHT).lobes[0].k[0] < 1.3
    assert change(STEEP, STEEP) == 0


def test_normalised_keeps_a_passive_material(few_directions):
    assert normalised(BRUSHED) is BRUSHED


def test_normalised_refuses_diffuse_terms_over_one(few_directions):
    with pytest.raises(UserError, match="kd"):
        normalised(Material(kd=0.8, kt_d=0.3))


def test_the_report_names_the_changes(few_directions):
    provenance = Provenance(source="steep.txt", notes=("first",))
    done = normalisation(STEEP.model_copy(update={"provenance": provenance}))
    assert done.needed and done.highest[0][0] > 1 >= done.highest[1][0]
    was, now = done.changed["lobes[0].alpha"]
    assert was == 1 and now == done.after.lobes[0].alpha
    assert "lobes[0].mx" not in done.changed
    assert set(done.errors) == set(done.share) and all(0 < share < 1 for share in done.share.values())
    assert done.after.provenance.notes == ("first", NOTE)


def test_scaling_k_is_an_error_of_its_share(few_directions):
    """k alone is scaled where alpha is 0: f of the lobe by one factor, so L1 is that share of a lobe without kd."""
    done = normalisation(Material(lobes=(Lobe(k=1.6, mx=0.2, my=0.2, r0=1),)))
    was, now = done.changed["lobes[0].k"]
    assert list(done.changed) == ["lobes[0].k"] and was == (1.6, 1.6, 1.6)
    assert done.share["l1"] == pytest.approx(1 - now[0] / 1.6, rel=1e-6)


def test_the_report_of_a_passive_material(few_directions):
    done = normalisation(BRUSHED)
    assert not done.needed and done.after is BRUSHED and not done.changed and not done.errors


FOIL = Material(
    kd=0.76,
    lobes=(
        Lobe(k=0.78, mx=0.124, my=0.136, r0=0.029, alpha=0.5),
        Lobe(side="transmission", k=0.67, mx=0.25, my=0.17, r0=0.75, alpha=0.6),
    ),
)
BRUSHED = Material(lobes=(Lobe(k=0.98, mx=0.0068, my=0.0297, r0=0.84, alpha=0.49),))


@pytest.fixture
def quick(monkeypatch):
    """One wo for the sampler, and two azimuths of the furnace, for speed."""
    monkeypatch.setattr(module, "SAMPLER_THETA_DEG", (45.0,))
    monkeypatch.setattr(module, "PHI_DEG", (0.0, 90.0))


@pytest.mark.long
def test_a_published_metal_passes_and_the_report_is_json():
    report = check(BRUSHED)
    assert report.passed and not report.warnings and report.reciprocity_error < 1e-9
    data = json.loads(json.dumps(report.to_json()))
    assert data["passed"] and np.shape(data["furnace"]["albedo"]) == (24, 4, 3) and len(data["sampler"]) == 3


def test_more_light_than_arrives_is_a_warning_with_its_angle(few_samples):
    report = check(FOIL)
    assert report.passed and "theta 89" in report.warnings[0] and report.furnace.highest[0] > 1.5


def test_a_material_that_would_light_up_a_room_fails(few_samples):
    report = check(Material(lobes=(Lobe(mx=0.5, my=0.5, r0=1, alpha=1),)))
    assert not report.passed and "without bound" in report.failures[0]


@pytest.fixture
def few_samples(quick, monkeypatch):
    monkeypatch.setattr(module, "check_sampler", partial(check_sampler, samples=1 << 16))


class NotReciprocal(MaterialBSDF):
    def eval(self, wi, wo):
        return super().eval(wi, wo) * (1 + 1e-3 * wi[..., 2:])


class WrongPdf(MaterialBSDF):
    def pdf(self, wi, wo):
        return 1.02 * super().pdf(wi, wo)


class LeavesAPartUnsampled(MaterialBSDF):
    """Sampler and pdf agree with each other, but never go to the far side, where f is not 0."""

    def __init__(self, material):
        super().__init__(material)
        self.near_side = MaterialBSDF(material.model_copy(update={"kt_d": (0.0, 0.0, 0.0)}))

    def pdf(self, wi, wo):
        return self.near_side.pdf(wi, wo)

    def sample(self, wo, u):
        return self.near_side.sample(wo, u)


@pytest.mark.long
@pytest.mark.parametrize(
    ("kind", "complaints"),
    [(NotReciprocal, ["not reciprocal"]), (WrongPdf, ["do not follow the density", "by quadrature"])],
)
def test_faults_are_named(quick, kind, complaints):
    said = "; ".join(check(kind(Material(kd=0.5, lobes=(Lobe(mx=0.3, my=0.2),)))).failures)
    assert all(complaint in said for complaint in complaints), said


def test_an_unsampled_part_shows_in_the_two_albedos(quick):
    report = check(LeavesAPartUnsampled(Material(kd=0.5, kt_d=0.2)))
    assert any("by sampling" in failure for failure in report.failures), report.failures
    assert not any("follow the density" in failure for failure in report.failures)


@pytest.mark.parametrize("theta_deg", [0.0, 60.0, 88.0])
def test_albedo_of_lambert_is_exact(theta_deg):
    one = check_sampler(MaterialBSDF(Material(kd=0.5, kt_d=0.25)), theta_deg, 10.0, samples=100_000)
    assert one.albedo_quadrature == pytest.approx(0.75, rel=1e-4) and one.pdf_integral == pytest.approx(1, abs=1e-4)


def test_furnace_of_a_tight_mirror():
    """A narrow lobe with alpha = 1/2 and r0 = 1 is a mirror: albedo 1 wherever the horizon cuts nothing off."""
    result = furnace(Material(lobes=(Lobe(mx=0.005, my=0.005, r0=1, alpha=0.5),)))
    below_85 = np.array(result.theta_deg) < 85
    np.testing.assert_allclose(result.albedo[below_85], 1, atol=2e-3)


@pytest.mark.long
def test_the_check_is_deterministic_and_shows_progress(few_samples):
    seen = []
    first = check(FOIL, seed=3, progress=lambda done, total, what: seen.append((done, total, what)))
    assert first.to_json() == check(FOIL, seed=3).to_json()
    assert seen[0][0] == 0 and seen[-1][0] == seen[-1][1]


@pytest.mark.parametrize(("kd", "warned"), [(0.5, False), (1.0, True)])
def test_a_fit_says_that_it_returns_more_than_arrives(kd: float, warned: bool) -> None:
    result = fit(grey(PAINT, FEW), fix={"kd": kd, "ks": 0.7, "mx": 0.15, "r0": 0.06, "alpha": 0.0})
    theta = np.radians([0.0, 45.0, 80.0])
    highest = MaterialBSDF(result.material).albedo(direction(theta, 0.0)).max()
    assert 1.02 < highest < 1.5 if warned else highest < 0.99
    assert any("scatters more light than it receives" in line for line in result.warnings) is warned
