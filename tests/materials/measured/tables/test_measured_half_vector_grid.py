"""Look-ups for path tracing agree with the table, their samplers with their densities: grids, retro grids, patches."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.bench.scenes.retro_tapes import TAPES, Tape
from lambent.core.errors import UserError
from lambent.core.geometry.directions import FLIP_Z, direction, normalize
from lambent.materials.bsdf import MaterialBSDF, components
from lambent.materials.checking.check import check_sampler
from lambent.materials.checking.chi_square import chi_square, combined
from lambent.materials.document import Lobe, Material
from lambent.materials.export import gonio_text, lbnl_xml
from lambent.materials.measured import load
from lambent.materials.measured.inspecting.synthetic import ISOTROPIC, synthesise
from lambent.materials.measured.lbnl_xml import LbnlTable
from lambent.materials.measured.parts.klems import KLEMS_FULL, KLEMS_HALF, AngleBasis, PatchMatrix
from lambent.materials.measured.tables import half_vector_resampling
from lambent.materials.measured.tables.half_vector_grid import GridShape
from lambent.materials.measured.tables.half_vector_resampling import RetroGrid, grid_of, retro_grid_of
from lambent.materials.measured.tables.patch_sheet import TableBSDF, lookup_of, patch_sheet_of
from tests.materials.export.formula_table import FormulaTable
from tests.materials.measured.measured_files import about_n
from tests.tools.checks import assert_sampler


@pytest.fixture(scope="module", params=TAPES, ids=lambda tape: tape.name)
def tape(request):
    return request.param


@pytest.fixture(scope="module")
def tape_table(tape):
    return tape.measured()


def test_the_way_about_the_light_is_chosen(tape_table):
    choice = tape_table.choice
    assert choice.way == "back_vector"
    assert choice.errors["back_vector"] < 0.5 * min(choice.errors["half_vector"], choice.errors["quadrilinear"])


def about(w, reach_deg, count=400, seed=0):
    """Directions (N, 3) within about `reach_deg` of w (3,)."""
    off = np.random.default_rng(seed).normal(0, np.radians(reach_deg), (count, 3))
    return normalize(w + off)


@pytest.mark.parametrize("theta_deg", [15.0, 25.0, 45.0])
def test_peaks_between_incident_directions(tape, tape_table, theta_deg):
    """Both peaks are where they belong, as high as they are; half vectors lose that about the light."""
    wi = direction(np.radians(theta_deg), 0.3)
    for centre, width in ((wi, tape.width_deg), (wi * (-1, -1, 1), 4.0)):
        wo = about(centre, width / 2)
        truth, got = tape.eval(np.broadcast_to(wi, wo.shape), wo), tape_table.eval(np.broadcast_to(wi, wo.shape), wo)
        assert np.abs(got - truth).sum() < 0.12 * truth.sum()
    peak = tape.eval(wi, wi)
    assert tape_table.eval(wi, wi) == pytest.approx(peak, rel=0.15)
    assert replace(tape_table, reconstruction="half_vector").eval(wi, wi) < 0.7 * peak


def test_albedo_counts_the_peak(tape, tape_table):
    theta, phi = np.meshgrid((np.arange(900) + 0.5) / 10, np.arange(0.5, 360), indexing="ij")
    for at in (0.0, 30.0):
        wi = direction(np.radians(at), 0.0)
        frame = np.stack([direction(np.radians(at + 90), 0.0), np.array([0.0, 1.0, 0.0]), wi])
        wo = direction(*np.radians([theta, phi])) @ frame
        f = tape.eval(np.broadcast_to(wi, wo.shape), wo)[..., 0] * np.maximum(wo[..., 2], 0)
        expected = (f * np.sin(np.radians(theta))).sum() * np.radians(0.1) * np.radians(1)
        assert tape_table.albedo(wi)[0] == pytest.approx(expected, rel=0.06)


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


@pytest.mark.long
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


@pytest.mark.long
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


FOIL = Material(
    kd=(0.1,) * 3,
    lobes=(
        Lobe(retro=True, mx=0.04, my=0.1, r0=(1.0,) * 3, k=(0.4, 0.3, 0.2), alpha=-1.0),
        Lobe(side="transmission", mx=0.1, my=0.2, r0=(0.1,) * 3, k=(0.4,) * 3),
    ),
)


def test_transmission_and_brushing_direction():
    foil = exact_table(FOIL)
    grid = retro_grid_of(foil, GridShape(16, 16, 64, 64))
    wo = direction(np.radians(35), 1.0)

    def draw(u):
        return np.stack(grid.sample(components(np.broadcast_to(wo, u.shape)), *components(u)), axis=-1)

    wi = draw(np.random.default_rng(2).random((20_000, 3)))
    kept = np.abs(wi[:, 2]) > 0.1
    wi, given = wi[kept], np.broadcast_to(wo, wi[kept].shape)
    exact, pdf = foil.eval(wi, given), grid.pdf(components(wi), components(given))
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
def test_patches_agree_with_the_table(table, reverse):
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


SMALL = GridShape(12, 8, 64, 32)


def exact_table(material, isotropic=False, turn_deg=0.0, channels=3):
    """A table without gaps; `turn_deg` turns its brushing direction away from the axes."""

    def f(wi, wo):
        return MaterialBSDF(material).eval(about_n(wi, turn_deg), about_n(wo, turn_deg))[..., :channels]

    return FormulaTable(f, channels=channels, isotropic=isotropic, transmits=material.transmits)


LOBE = Lobe(mx=0.3, my=0.1, k=0.8, r0=(0.6, 0.7, 0.8), alpha=0.3)
SHEET = Material(kd=(0.3, 0.2, 0.1), kt_d=0.1, lobes=(LOBE, LOBE.model_copy(update={"side": "transmission"})))


def drawn(grid, n=40_000, seed=0, lowest_cosine=0.1):
    """(wi, wo) with wo anywhere and wi as the grid samples it, off the horizon, and the density."""
    rng = np.random.default_rng(seed)
    wo = direction(np.arccos(rng.uniform(lowest_cosine, 1, n) * rng.choice([-1, 1], n)), rng.uniform(0, 2 * np.pi, n))
    wi = np.stack(grid.sample(components(wo), *rng.random((3, n))), axis=-1)
    kept = np.abs(wi[:, 2]) > lowest_cosine
    wi, wo = wi[kept], wo[kept]
    return wi, wo, grid.pdf(components(wi), components(wo))


def looked_up(grid, wi, wo):
    return np.stack(grid.evaluate(components(wi), components(wo)), axis=-1)


@pytest.mark.parametrize(
    ("material", "isotropic", "turn_deg", "share"),
    [
        (Material(kd=0.5), True, 0.0, 1e-6),
        (Material(lobes=(Lobe(mx=0.02, my=0.02, r0=0.9, alpha=0.4),)), True, 0.0, 0.03),
        (SHEET, False, 0.0, 0.05),
        (SHEET, False, 17.0, 0.05),
    ],
)
def test_look_ups_agree_with_the_table(material, isotropic, turn_deg, share):
    """Mean deviation as a share of the scattered light; the coarse grid here, not the default one, costs the most."""
    table = exact_table(material, isotropic, turn_deg)
    grid = grid_of(table, GridShape(32, 1, 128, 32) if isotropic else GridShape(24, 8, 64, 32))
    wi, wo, pdf = drawn(grid, lowest_cosine=0.25)
    expected, gain = table.eval(wi, wo), (np.abs(wi[:, 2]) / pdf)[:, None]
    assert (np.abs(looked_up(grid, wi, wo) - expected) * gain).sum() <= share * (expected * gain).sum()


def test_symmetric_viewers_share_their_values(monkeypatch):
    for turn_deg in (0.0, 17.0):
        table = exact_table(SHEET, turn_deg=turn_deg)
        shared = grid_of(table, SMALL)
        assert any(other != k for k, (other, _) in enumerate(half_vector_resampling._symmetric_viewers(table, SMALL)))
        with monkeypatch.context() as patch:
            patch.setattr(half_vector_resampling, "_symmetric_viewers", lambda *_: [(k, slice(None)) for k in range(8)])
            alone = grid_of(table, SMALL)
        for name in ("values", "density", "across"):
            np.testing.assert_allclose(getattr(shared, name), getattr(alone, name), rtol=1e-5, atol=1e-7)


def test_grey_becomes_rgb_and_an_opaque_sheet_transmits_nothing():
    grid = grid_of(exact_table(Material(kd=0.5), True, channels=1), GridShape(4, 1, 16, 8))
    n = direction(0.0, 0.0)
    np.testing.assert_allclose(looked_up(grid, n, n), [0.5 / np.pi] * 3, rtol=1e-6)
    assert grid.kinds == 1 and not looked_up(grid, -n, n).any()
    assert grid.pdf(components(-n), components(n)) == 0


def test_a_back_that_differs_is_kept():
    table = FormulaTable(
        lambda wi, wo: MaterialBSDF(SHEET).eval(wi, wo) * (wo[..., 2:] > 0), channels=3, transmits=True
    )
    grid = grid_of(table, SMALL)
    wi, wo, _ = drawn(grid)
    assert grid.faces == 2
    below = wo[:, 2] < 0
    assert not looked_up(grid, wi, wo)[below].any() and looked_up(grid, wi, wo)[~below].all()


@pytest.mark.parametrize("theta_deg", [0.0, 40.0, 85.0])
def test_the_albedo_by_sampling_is_the_models(theta_deg):
    table = exact_table(SHEET)
    grid = grid_of(table, SMALL)
    wo = np.broadcast_to(direction(np.radians(theta_deg), 0.3), (200_000, 3))
    wi = np.stack(grid.sample(components(wo), *np.random.default_rng(1).random((3, len(wo)))), -1)
    pdf = grid.pdf(components(wi), components(wo))
    gain = np.divide(np.abs(wi[:, 2]), pdf, out=np.zeros_like(pdf), where=pdf > 0)
    expected = MaterialBSDF(SHEET).albedo(wo[0], samples=200_000)
    np.testing.assert_allclose((table.eval(wi, wo) * gain[:, None]).mean(axis=0), expected, rtol=0.01)


COATED = MaterialBSDF(
    Material(
        kd=(0.1, 0.2, 0.3),
        lobes=(
            Lobe(mx=0.3, my=0.3, k=0.5, r0=(0.8, 0.6, 0.4), alpha=0.2),
            Lobe(side="transmission", mx=0.4, my=0.4, k=0.4, r0=0.1),
        ),
    )
)


@pytest.fixture(scope="module")
def lit_from_above():
    """The BSDF of a table without gaps, measured with light from above."""
    table = FormulaTable(
        lambda wi, wo: np.where(wi[..., 2:] > 0, COATED.eval(wi, wo), 0.0), channels=3, isotropic=True, transmits=True
    )
    return TableBSDF(table, GridShape(24, 1, 64, 32))


@pytest.mark.parametrize("theta_deg", [0.0, 60.0, 120.0])
def test_a_table_as_bsdf_passes_the_check_of_samplers(lit_from_above, theta_deg):
    assert_sampler(lit_from_above, theta_deg, 20.0, samples=200_000)


def test_light_from_below_is_the_mirrored_pair(lit_from_above):
    wi, wo, down = direction(np.radians(40), 0.7), direction(np.radians([20, 70, 110]), [0.1, 2, 4]), (1, 1, -1)
    np.testing.assert_array_equal(lit_from_above.eval(wi, wo), lit_from_above.eval(wi * down, wo * down))
    assert lit_from_above.eval(wi, wo).min() > 0
