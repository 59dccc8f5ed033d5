"""The check of tables fails on faults that no device explains, and reports the usual errors of devices."""

from __future__ import annotations

import json
from functools import partial

import numpy as np
import pytest

from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.checking import check
from lambent.materials.checking import check_table as module
from lambent.materials.checking.check_table import check_table
from lambent.materials.document import Lobe, Material
from lambent.materials.export import lbnl_xml
from lambent.materials.export.resampling import patch_mean
from lambent.materials.measured import load
from lambent.materials.measured.protocol import TableInfo
from lambent.materials.measured.tables.half_vector_grid import GridShape
from lambent.materials.measured.tables.scattered import ScatteredTable
from tests.materials.export.formula_table import FormulaTable

SMALL = GridShape(24, 1, 64, 32)
GLOSSY = Material(kd=(0.1, 0.2, 0.3), lobes=(Lobe(mx=0.2, my=0.2, k=0.5, r0=0.5, alpha=0.2),))


def exact(material=GLOSSY, strength=0.0):
    """A table without gaps, from a material document, made brighter by `strength` where the light is higher."""

    def f(wi, wo):
        above = (wi[..., 2:] > 0) & (wo[..., 2:] > 0)
        return np.where(above, MaterialBSDF(material).eval(wi, wo) * (1 + strength * (wi[..., 2:] - wo[..., 2:])), 0.0)

    return FormulaTable(f, channels=3, isotropic=True)


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(check, "SAMPLER_THETA_DEG", (45.0,))
    monkeypatch.setattr(check, "check_sampler", partial(check.check_sampler, samples=1 << 18))
    monkeypatch.setattr(module, "INTEGRAL_THETA_DEG", (40.0,))
    monkeypatch.setattr(module, "PAIRS", 20_000)
    for place in (check, module):
        monkeypatch.setattr(place, "THETA_DEG", (0, 30, 60, 75, 84, 89))


def test_a_sound_table_passes_and_the_report_is_json():
    report = check_table(exact(), shape=SMALL)
    assert report.passed and not report.warnings, report
    assert report.reciprocity_share < 1e-12 and 0 < report.resampling_share < 0.03
    assert report.integrals[0].deviation < 0.01
    expected = MaterialBSDF(GLOSSY).albedo(np.array([0, 0, 1.0]), samples=200_000)
    np.testing.assert_allclose(report.furnace.albedo[0, 0], expected, rtol=0.01)
    data = json.loads(json.dumps(report.to_json()))
    assert data["passed"] and np.shape(data["furnace"]["albedo"]) == (6, 1, 3) and len(data["sampler"]) == 1


@pytest.mark.parametrize(("strength", "passes"), [(0.1, True), (1.0, False)])
def test_asymmetry_is_reported_and_only_much_of_it_fails(strength, passes):
    """For a matt surface |f - f'| = 2 s |cos_i - cos_o| f, whose mean over both cosine-weighted hemispheres is 4/15."""
    report = check_table(exact(Material(kd=0.5), strength), shape=SMALL)
    assert report.reciprocity_share == pytest.approx(2 * strength * 4 / 15, rel=0.05)  # but for the last 6 degrees
    assert report.passed == passes and any("swapping" in text for text in report.failures) != passes


def test_a_table_that_returns_more_than_arrives_fails():
    report = check_table(exact(Material(kd=1.1)), shape=SMALL)
    assert "without bound" in report.failures[0] and "1.1" in report.warnings[0]


def test_an_albedo_that_is_not_the_integral_fails():
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
        patch.setattr(patch_mean, "LOBES_LOG2", 5)
        lbnl_xml.write(Material(name="film", kt_d=0.6), path)
    return path


def test_a_file_of_transmission_alone_passes(film):
    """No pair of directions is left to be swapped."""
    report = check_table(load(film))
    assert report.passed and not report.warnings, report
    assert report.reciprocity_share == 0 and report.integrals[0].from_table == pytest.approx(0.6, rel=0.01)


def test_a_table_answers_no_question_with_no_values(film):
    table, none = load(film), np.zeros((0, 3))
    assert table.eval(none, none).shape == (0, 1)
    assert all(look_up(none).shape == (0, 1) for look_up in (table.reflectivity, table.transmissivity, table.albedo))


def test_a_scattered_table_warns_where_nothing_was_measured(monkeypatch):
    monkeypatch.setattr(module, "PAIRS", 2000)
    monkeypatch.setattr(module, "INTEGRAL_THETA_DEG", ())
    monkeypatch.setattr(check, "check_samplers", lambda *_: ())
    monkeypatch.setattr(check, "sampler_failures", lambda _: [])
    random = np.random.default_rng(0)
    wi, wo = (direction(np.arccos(random.uniform(0.5, 1, 800)), random.uniform(0, 2 * np.pi, 800)) for _ in range(2))
    table = ScatteredTable(wi, wo, MaterialBSDF(GLOSSY).eval(wi, wo), TableInfo("a", "test", True, False, 3, "f"))
    report = check_table(table, shape=GridShape(8, 1, 24, 12))
    assert any("nothing was measured near" in line and "beyond theta 60 degrees" in line for line in report.warnings)
