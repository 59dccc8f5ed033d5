"""Patch matrices are looked up and sampled exactly, up to rounding at the borders of patches."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import components
from lambent.materials.checking.check import check_sampler
from lambent.materials.measured import load
from lambent.materials.measured.lbnl_xml import LbnlTable
from lambent.materials.measured.parts.klems import KLEMS_FULL, KLEMS_HALF, AngleBasis, PatchMatrix
from lambent.materials.measured.tables.patch_sheet import lookup_of, patch_sheet_of
from lambent.materials.measured.tables.table_bsdf import TableBSDF

ODD = AngleBasis("odd", (0.0, 11.0, 40.0, 62.0), (1, 5, 7))  # ends above the horizon; turns do not map it on itself
DOWN = np.array([1, 1, -1])
KLEMS_FILES = ("SingleClear", "blinds_20deg_noGlazing_Klems", "sawtooth", "simple_klems_through_refl_trans")


def matrix(incident, outgoing, seed, channels=1, dark=0.7):
    """f at random, most of it zero, an outgoing patch dark, without reciprocity; at most .4 of light returns."""
    random = np.random.default_rng(seed)
    f = random.random((outgoing.count, incident.count, channels)) * (
        random.random((outgoing.count, incident.count, 1)) > dark
    )
    f[2], f[3] = 0.0, 0.1
    return PatchMatrix(incident, outgoing, 0.4 * f / np.tensordot(outgoing.projected_sr, f.mean(axis=-1), 1).max())


TABLES = {
    "full": {("reflection", side): matrix(KLEMS_FULL, KLEMS_FULL, side + 1) for side in (1, -1)},
    "half in colour, transmission one way": {
        ("reflection", 1): matrix(KLEMS_HALF, KLEMS_HALF, 2, channels=3),
        ("transmission", 1): matrix(KLEMS_HALF, KLEMS_FULL, 3, channels=3),
    },
    "custom": {
        ("reflection", -1): matrix(ODD, KLEMS_HALF, 4),
        ("transmission", -1): matrix(ODD, ODD, 5),
        ("transmission", 1): matrix(KLEMS_HALF, ODD, 6),
    },
    "one side": {("reflection", 1): matrix(KLEMS_HALF, ODD, 7)},
}


@pytest.fixture(params=[*TABLES])
def table(request):
    return LbnlTable(request.param, TABLES[request.param])


def anywhere(n, seed, lowest_cosine=0.001):
    random = np.random.default_rng(seed)
    cosine = random.uniform(lowest_cosine, 1, n) * random.choice([-1, 1], n)
    return direction(np.arccos(cosine), random.uniform(0, 2 * np.pi, n))


def two_sided(table, wi, wo):
    """f of the table, or of the mirrored pair if it has no data of light from below."""
    below = (wi[:, 2:] < 0) & (not table.has_a_back)
    return table.eval(np.where(below, wi * DOWN, wi), np.where(below, wo * DOWN, wo))


@pytest.mark.parametrize("reverse", [False, True])
def test_look_ups_agree_with_the_table(table, reverse):
    wi, wo = anywhere(40_000, 1), anywhere(40_000, 2)
    sheet = patch_sheet_of(table, reverse=reverse)
    given = (wo, wi) if reverse else (wi, wo)
    got = np.stack(sheet.evaluate(*map(components, given)), axis=-1)
    expected = np.broadcast_to(two_sided(table, wi, wo), got.shape)
    assert expected.any() and not (~np.isclose(got, expected, rtol=1e-6, atol=0)).any(axis=-1).sum() > 2


@pytest.mark.parametrize("border_deg", KLEMS_FULL.edges_deg[1:-1])
def test_a_direction_on_a_border_is_in_one_patch_everywhere(border_deg):
    mirror = np.diag(1 / KLEMS_FULL.projected_sr)[..., None] * 0.4
    table = LbnlTable("pane", {("reflection", 1): PatchMatrix(KLEMS_FULL, KLEMS_FULL, mirror)})
    bsdf, u = TableBSDF(table), np.random.default_rng(0).random((16, 3))
    for phi in np.radians(np.arange(0, 360, 2.5)):  # with borders between the patches of every ring
        wo = np.broadcast_to(direction(np.radians(border_deg), phi), u.shape)
        wi = bsdf.sample(wo, u)
        np.testing.assert_allclose(bsdf.eval(wi, wo)[:, 0] * wi[:, 2] / bsdf.pdf(wi, wo), 0.4, rtol=1e-5)
        assert (bsdf.eval(wo * (-1, -1, 1), wo) > 0).all()


@pytest.mark.parametrize("reverse", [False, True])
def test_every_sample_has_the_albedo_as_its_weight(table, reverse):
    """f cos / pdf is the same for every sample of a row: the table's exact sum over patches."""
    sheet = patch_sheet_of(table, reverse=reverse)
    wo, u = anywhere(40_000, 3), np.random.default_rng(4).random((3, 40_000))
    wi = np.stack(sheet.sample(components(wo), *u), axis=-1)
    pdf = sheet.pdf(components(wi), components(wo))
    near, far = (sheet.albedo_of(components(wo), np.full(len(wo), across)) for across in (False, True))
    assert ((pdf > 0) | (wi[:, 2] == 0) | (near + far == 0)).mean() > 0.9999
    f = two_sided(table, wo, wi) if reverse else two_sided(table, wi, wo)
    kept = pdf > 0
    weight = (f.mean(axis=-1) * np.abs(wi[:, 2]))[kept] / pdf[kept]
    assert kept.mean() > 0.3 and np.isclose(weight, (near + far)[kept], rtol=1e-3).mean() > 0.9999
    if reverse:
        mirrored = np.where((wo[:, 2:] < 0) & (not table.has_a_back), wo * DOWN, wo)
        expected = table.reflectivity(mirrored).mean(axis=-1), table.transmissivity(mirrored).mean(axis=-1)
        np.testing.assert_allclose(near, expected[0], rtol=1e-5, atol=1e-9)
        np.testing.assert_allclose(far, expected[1], rtol=1e-5, atol=1e-9)


@pytest.mark.parametrize("theta_deg", [3.0, 50.0, 120.0])
def test_the_sampler_draws_its_density_and_the_albedo_is_a_quadrature(table, theta_deg):
    """The quadrature of the table's own f over the light, given the viewer, is independent of the sampler."""
    one = check_sampler(TableBSDF(table), theta_deg, 200.0, samples=100_000)
    assert not one.p_value < 1e-3
    assert one.pdf_integral + one.rejected_share == pytest.approx(1, abs=1e-4)
    assert one.albedo_sampled == pytest.approx(one.albedo_quadrature, abs=5 * one.albedo_error + 1e-4)


def test_other_tables_have_no_patches(files):
    assert patch_sheet_of(load(files["merl"])) is None


@pytest.mark.parametrize("name", KLEMS_FILES)
def test_real_files(shared_data: Path, name: str) -> None:
    table = load(shared_data / "measured" / "lbnl" / f"{name}.xml")
    wi, wo = anywhere(20_000, 1), anywhere(20_000, 2)
    wi[::2] = wo[::2] * np.where(np.random.default_rng(3).random((10_000, 1)) < 0.5, [-1, -1, 1], -1)
    got = np.stack(lookup_of(table).evaluate(components(wi), components(wo)), axis=-1)
    expected = np.broadcast_to(two_sided(table, wi, wo), got.shape)
    assert (expected > 0).any() and not (~np.isclose(got, expected, rtol=1e-6, atol=0)).any(axis=-1).sum() > 2
    test = TableBSDF(table).chi_square(direction(0.7, 1.2), samples=100_000)
    assert test.p_value > 1e-3 and test.pdf_integral == pytest.approx(1, abs=1e-4)
