"""Retro-reflectors between measured incident directions, and on two grids for sampling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.bench.scenes.retro_tapes import TAPES, Tape
from lambent.core.errors import UserError
from lambent.core.geometry.directions import FLIP_Z, direction, normalize
from lambent.materials.bsdf import MaterialBSDF, components
from lambent.materials.checking.chi_square import chi_square, combined
from lambent.materials.document import Lobe, Material
from lambent.materials.export import gonio_text, lbnl_xml
from lambent.materials.measured import load
from lambent.materials.measured.inspecting.synthetic import ISOTROPIC, synthesise
from lambent.materials.measured.protocol import TableInfo
from lambent.materials.measured.tables.half_vector_grid import GridShape
from lambent.materials.measured.tables.half_vector_resampling import RetroGrid, retro_grid_of
from lambent.materials.measured.tables.table_bsdf import TableBSDF


@pytest.fixture(scope="module", params=TAPES, ids=lambda tape: tape.name)
def tape(request):
    return request.param


@pytest.fixture(scope="module")
def table(tape):
    return tape.measured()


def test_the_way_about_the_light_is_chosen(table):
    choice = table.choice
    assert choice.way == "back_vector"
    assert choice.errors["back_vector"] < 0.5 * min(choice.errors["half_vector"], choice.errors["quadrilinear"])


def about(w, reach_deg, count=400, seed=0):
    """Directions (N, 3) within about `reach_deg` of w (3,)."""
    off = np.random.default_rng(seed).normal(0, np.radians(reach_deg), (count, 3))
    return normalize(w + off)


@pytest.mark.parametrize("theta_deg", [15.0, 25.0, 45.0])
def test_peaks_between_incident_directions(tape, table, theta_deg):
    """Both peaks are where they belong, as high as they are; half vectors lose that about the light."""
    wi = direction(np.radians(theta_deg), 0.3)
    for centre, width in ((wi, tape.width_deg), (wi * (-1, -1, 1), 4.0)):
        wo = about(centre, width / 2)
        truth, got = tape.eval(np.broadcast_to(wi, wo.shape), wo), table.eval(np.broadcast_to(wi, wo.shape), wo)
        assert np.abs(got - truth).sum() < 0.12 * truth.sum()
    peak = tape.eval(wi, wi)
    assert table.eval(wi, wi) == pytest.approx(peak, rel=0.15)
    assert replace(table, reconstruction="half_vector").eval(wi, wi) < 0.7 * peak


def test_albedo_counts_the_peak(tape, table):
    theta, phi = np.meshgrid((np.arange(900) + 0.5) / 10, np.arange(0.5, 360), indexing="ij")
    for at in (0.0, 30.0):
        wi = direction(np.radians(at), 0.0)
        frame = np.stack([direction(np.radians(at + 90), 0.0), np.array([0.0, 1.0, 0.0]), wi])
        wo = direction(*np.radians([theta, phi])) @ frame
        f = tape.eval(np.broadcast_to(wi, wo.shape), wo)[..., 0] * np.maximum(wo[..., 2], 0)
        expected = (f * np.sin(np.radians(theta))).sum() * np.radians(0.1) * np.radians(1)
        assert table.albedo(wi)[0] == pytest.approx(expected, rel=0.06)


def test_a_scan_in_the_plane_of_incidence_keeps_the_peak_round():
    """Seen beside the plane, the peak about the light is as narrow as within it."""
    from pathlib import Path

    from lambent.materials.measured.parts.gonio_rows import table_of

    tape = Tape("scan", 2.0, 0.3, 1.0, 0.1)
    rows = [
        (theta_i, 0.0, abs(theta_o), 0.0 if theta_o > 0 else 180.0)
        for theta_i in (20.0, 30.0, 40.0, 50.0)
        for theta_o in np.arange(-80, 80.1, 0.5)
    ]
    angles = np.array(rows)
    wi, wo = (direction(*np.radians(angles[:, k : k + 2].T)) for k in (0, 2))
    table = table_of(angles, tape.eval(wi, wo), Path("scan.txt"), "gonio text", "scan")
    assert table.choice.way == "back_vector"
    light = direction(np.radians(35), 0.0)
    wo = about(light, 1.5)
    truth, got = (eval(np.broadcast_to(light, wo.shape), wo) for eval in (tape.eval, table.eval))
    assert np.abs(got - truth).sum() < 0.1 * truth.sum()


def test_peaks_about_the_mirror_direction_keep_their_way():
    lobe = Material(name="lobe", kd=0.1, lobes=(Lobe(mx=0.05, my=0.05, r0=0.9, alpha=0.5),))
    table = synthesise(lobe, replace(ISOTROPIC, step_deg=5))
    assert table.choice.way == "half_vector"


def test_the_way_is_given_where_a_file_is_read(tmp_path):
    file = tmp_path / "tape.txt"
    gonio_text.write(TAPES[2].measured(10.0), file)
    assert load(file).choice.way == "back_vector"
    assert load(file, "quadrilinear").choice.way == "quadrilinear"
    patches = tmp_path / "patches.xml"
    lbnl_xml.write(Material(name="grey", kd=0.5), patches)
    with pytest.raises(UserError, match="does not apply to"):
        load(patches, "back_vector")


SHAPE = GridShape(24, 1, 128, 32)


@pytest.fixture(scope="module", params=TAPES[:2], ids=lambda tape: tape.name)
def bsdf(request):
    return TableBSDF(request.param.measured(), SHAPE)


@pytest.mark.parametrize("theta_deg", [40.0, *(pytest.param(theta, marks=pytest.mark.slow) for theta in (0.0, 85.0))])
def test_sampler_follows_its_density(bsdf, theta_deg):
    assert isinstance(bsdf.lookup, RetroGrid)
    test = bsdf.chi_square(direction(np.radians(theta_deg), 0.4), samples=1_000_000)
    assert test.p_value > 1e-3 and test.samples == pytest.approx(1_000_000, abs=2)
    assert test.pdf_integral + test.rejected_share == pytest.approx(1, abs=1e-3)


def test_what_is_looked_up_is_the_table(bsdf):
    rng = np.random.default_rng(1)
    wo = direction(rng.uniform(0.05, 1.2, 4000), rng.uniform(0, 2 * np.pi, 4000))
    wi = bsdf.sample(wo, rng.random((4000, 3)))
    kept = wi[:, 2] > 0.1
    wi, wo = wi[kept], wo[kept]
    gain = (wi[:, 2] / bsdf.pdf(wi, wo))[:, None]
    exact, found = bsdf.eval(wi, wo) * gain, bsdf.looked_up(wi, wo) * gain
    assert np.abs(exact - found).sum() < 0.04 * exact.sum()


class Foil:
    """Anisotropic, retro-reflective and transmitting."""

    material = Material(
        kd=(0.1,) * 3,
        lobes=(
            Lobe(retro=True, mx=0.04, my=0.1, r0=(1.0,) * 3, k=(0.4, 0.3, 0.2), alpha=-1.0),
            Lobe(side="transmission", mx=0.1, my=0.2, r0=(0.1,) * 3, k=(0.4,) * 3),
        ),
    )
    info = TableInfo("foil", "exact", False, True, 3, "f")

    def eval(self, wi, wo):
        return MaterialBSDF(self.material).eval(wi, wo)


def test_transmission_and_brushing_direction():
    grid = retro_grid_of(Foil(), GridShape(16, 16, 64, 64))
    wo = direction(np.radians(35), 1.0)

    def draw(u):
        return np.stack(grid.sample(components(np.broadcast_to(wo, u.shape)), *components(u)), axis=-1)

    wi = draw(np.random.default_rng(2).random((20_000, 3)))
    kept = np.abs(wi[:, 2]) > 0.1
    wi, given = wi[kept], np.broadcast_to(wo, wi[kept].shape)
    exact, pdf = Foil().eval(wi, given), grid.pdf(components(wi), components(given))
    found = np.stack(grid.evaluate(components(wi), components(given)), axis=-1)
    gain = (np.abs(wi[:, 2]) / pdf)[:, None]
    assert (np.abs(exact - found) * gain).sum() < 0.06 * (exact * gain).sum()
    across = wi[:, 2] < 0
    assert across.mean() == pytest.approx(float(grid.transmitted_share(components(wo))), abs=0.02)
    assert 0.2 < across.mean() < 0.8
    below = np.stack(grid.evaluate(components(wi * FLIP_Z), components(given * FLIP_Z)), axis=-1)
    np.testing.assert_allclose(below, found)


def test_tests_of_parts_are_one_test():
    def draw(u):
        return direction(np.arccos(1 - 2 * u[:, 0]), 2 * np.pi * u[:, 1])

    def even(w):
        return np.full(len(w), 1 / (4 * np.pi))

    tests = [chi_square(draw, even, samples=50_000, seed=seed) for seed in (0, 1)]
    both = combined(tests)
    assert both.degrees == tests[0].degrees + tests[1].degrees and both.samples == 100_000
    assert both.observed.sum() == 100_000 and len(both.observed) == len(both.cells) + 1
    wrong = chi_square(draw, lambda w: (1 + 0.1 * w[:, 2]) / (4 * np.pi), samples=50_000)
    assert combined([tests[0], wrong]).p_value < 1e-6 < both.p_value
