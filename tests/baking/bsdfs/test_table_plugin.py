"""A table in the path tracer says what the table says, samples what its density says, and agrees with Mitsuba's own."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from lambent.baking.bsdfs.table_plugin import table_dict
from lambent.core.geometry.directions import direction, normalize
from lambent.materials.bsdf import MaterialBSDF, components
from lambent.materials.checking.chi_square import chi_square
from lambent.materials.document import Lobe, Material
from lambent.materials.measured import load
from lambent.materials.measured.lbnl_xml import LbnlTable
from lambent.materials.measured.parts.klems import KLEMS_HALF, AngleBasis, PatchMatrix
from lambent.materials.measured.protocol import TableInfo
from lambent.materials.measured.tables.half_vector_grid import GridShape
from lambent.materials.measured.tables.half_vector_resampling import grid_of
from lambent.materials.measured.tables.patch_sheet import lookup_of
from tests.tools.in_mitsuba import InMitsuba, furnace_box, interaction, random_directions, square, vectors

SMALL = GridShape(8, 8, 64, 32)
N = normalize(np.array([0.3, -0.5, 0.8]))  # a surface that leans, its tangent 130 degrees from any axis in it
E = normalize(np.cross([0.0, 1.0, 0.0], N))
T = np.cos(np.radians(130)) * E + np.sin(np.radians(130)) * np.cross(N, E)
FRAME = np.stack([T, np.cross(N, T), N])
WO = direction(np.radians(50), 0.7)  # the viewer in the frame of the brushing


class Exact:
    """A table without gaps: a material document that offers what measured tables offer."""

    def __init__(self, material: Material, isotropic: bool) -> None:
        self.bsdf = MaterialBSDF(material)
        self.info = TableInfo(material.name, "exact", isotropic, material.transmits, 3, "f")

    def eval(self, wi, wo):
        return self.bsdf.eval(wi, wo)


SHEET = Material(
    kd=(0.1, 0.2, 0.3),
    lobes=(
        Lobe(mx=0.3, my=0.1, k=(0.5, 0.6, 0.7), r0=0.6, alpha=0.3),
        Lobe(side="transmission", mx=0.2, my=0.4, k=0.5, r0=0.1, alpha=0.2),
    ),
)


@pytest.fixture(scope="module")
def sheet(mi):
    grid = grid_of(Exact(SHEET, isotropic=False), SMALL)
    return grid, mi.load_dict(table_dict(grid))


ODD = AngleBasis("odd", (0.0, 11.0, 40.0, 62.0), (1, 5, 7))


def blind(side):
    """Patches of two bases, without reciprocity, colourful, most of them dark."""
    random = np.random.default_rng(side + 1)
    f = random.random((ODD.count, KLEMS_HALF.count, 3)) * (random.random((ODD.count, KLEMS_HALF.count, 1)) > 0.6)
    return PatchMatrix(KLEMS_HALF, ODD, f / 20)


@pytest.fixture(scope="module")
def patches(mi):
    """A table of patch matrices, black for reflection from below, and its plugin."""
    parts = {("reflection", 1): blind(1), ("transmission", 1): blind(0), ("transmission", -1): blind(-1)}
    table = LbnlTable("blind", parts)
    return table, mi.load_dict(table_dict(table))


def test_eval_and_pdf_equal_numpy(mi, sheet):
    grid, plugin = sheet
    wi, wo = random_directions(10_000, 1), random_directions(10_000, 2)
    value, density = plugin.eval_pdf(mi.BSDFContext(), interaction(wo), mi.Vector3f(np.ascontiguousarray(wi.T)))
    pair = components(wi), components(wo)
    expected = np.stack(grid.evaluate(*pair), axis=-1) * np.abs(wi[:, 2:])
    np.testing.assert_allclose(np.array(value).T, expected, rtol=2e-4, atol=1e-6)
    differs = np.abs(np.array(density) - grid.pdf(*pair)) > 1e-4 * np.array(density)
    assert differs.mean() < 1e-3  # float32 may see a half vector on the border of a cell in the next one


def test_sample_agrees_with_eval_pdf_and_numpy(mi, sheet):
    grid, plugin = sheet
    wo, u = random_directions(10_000, 3), np.random.default_rng(4).random((10_000, 3)).astype(np.float32)
    si, context = interaction(wo), mi.BSDFContext()
    bs, weight = plugin.sample(context, si, mi.Float(u[:, 0]), mi.Point2f(np.ascontiguousarray(u[:, 1:].T)))
    value, density = (np.array(a).T for a in plugin.eval_pdf(context, si, bs.wo))
    kept = np.array(bs.pdf) > 0
    assert kept.mean() > 0.9
    agrees = np.abs(np.array(weight).T * density[:, None] - value).max(axis=1) < 1e-3 * value.max(axis=1)
    assert agrees[kept].mean() > 0.998
    expected = np.stack(grid.sample(components(wo), *u.T.astype(float)), axis=-1)
    assert (np.linalg.norm(np.array(bs.wo).T - expected, axis=1)[kept] < 1e-3).mean() > 0.998


def test_patch_matrices_are_looked_up_as_they_are(mi, patches):
    table, plugin = patches
    wi, wo = random_directions(20_000, 1, 0.01), random_directions(20_000, 2, 0.01)
    value, density = plugin.eval_pdf(mi.BSDFContext(), interaction(wo), mi.Vector3f(np.ascontiguousarray(wi.T)))
    expected = table.eval(wi, wo) * np.abs(wi[:, 2:])
    differs = ~np.isclose(np.array(value).T, expected, rtol=1e-4, atol=0).all(axis=-1)
    assert differs.sum() < 10 and (expected > 0).any(axis=-1).mean() > 0.1  # float32 on the border of a patch
    differs = ~np.isclose(np.array(density), lookup_of(table).pdf(components(wi), components(wo)), rtol=1e-4)
    assert differs.sum() < 10


def test_samples_of_patches_weigh_the_albedo(mi, patches):
    table, plugin = patches
    wo, u = random_directions(20_000, 3), np.random.default_rng(4).random((20_000, 3)).astype(np.float32)
    bs, weight = plugin.sample(mi.BSDFContext(), interaction(wo), mi.Float(u[:, 0]), mi.Point2f(u[:, 1:].T))
    lookup, kept = lookup_of(table), np.array(bs.pdf) > 0
    near, far = (lookup.albedo_of(components(wo), np.full(len(wo), across)) for across in (False, True))
    assert (kept | (near + far == 0)).mean() > 0.999 and kept.mean() > 0.5
    agrees = np.isclose(np.array(weight).T.mean(axis=-1), near + far, rtol=2e-3)
    assert agrees[kept].mean() > 0.999
    f = table.eval(np.array(bs.wo).T, wo).mean(axis=-1)
    assert (f > 0)[kept].mean() > 0.999


@pytest.mark.long
@pytest.mark.parametrize(("lookup", "theta_deg"), [("sheet", 50), ("sheet", 120), ("patches", 3), ("patches", 120)])
def test_samples_follow_the_density(request, lookup, theta_deg):
    """Patches in cells along their borders."""
    table, plugin = request.getfixturevalue(lookup)
    wo = direction(np.radians(theta_deg), 0.4)
    cells = lookup_of(table).cell_borders(wo) if lookup == "patches" else None
    bsdf, wo_of = InMitsuba(plugin), partial(np.broadcast_to, wo)
    sample, density = lambda u: bsdf.sample(wo_of(u.shape), u), lambda w: bsdf.pdf(w, wo_of(w.shape))
    test = chi_square(sample, density, samples=300_000, cells=cells)
    assert test.p_value > 1e-3
    assert test.pdf_integral + test.rejected_share == pytest.approx(1, abs=2e-3 if cells is None else 2e-4)


@pytest.fixture(scope="module")
def turned(mi, sheet, tmp_path_factory):
    """What the viewer sees of a brushed square whose tangent is turned, for any number of rays."""
    import drjit as dr

    scene = square(tmp_path_factory.mktemp("turned"), table_dict(sheet[0]), np.stack([E, np.cross(N, E)]), T)
    viewer = mi.Vector3f(*(WO @ FRAME).tolist())

    def interaction(count):
        origin = 2 * viewer + mi.Vector3f(*(0.1 * E).tolist()) + dr.zeros(mi.Vector3f, count)
        return scene.ray_intersect(mi.Ray3f(mi.Point3f(origin), -viewer))

    return interaction


@pytest.mark.long
def test_on_a_turned_surface_samples_values_and_densities_agree_in_world_space(mi, sheet, turned):
    """Samples and density that ignored the tangent alike would agree with each other, but not with the grid."""

    def sampled(u):
        si, u = turned(len(u)), u.astype(np.float32)
        bs, weight = si.bsdf().sample(mi.BSDFContext(), si, mi.Float(u[:, 0]), mi.Point2f(u[:, 1:].T))
        return si, bs, weight

    def density(w):
        si = turned(len(w))
        return np.array(si.bsdf().pdf(mi.BSDFContext(), si, si.to_local(vectors(w))), float)

    def draw(u):
        si, bs, _ = sampled(u)
        return np.array(si.to_world(bs.wo), float).T

    test = chi_square(draw, density, samples=200_000)
    assert test.p_value > 1e-4 and test.pdf_integral == pytest.approx(1, abs=0.02)
    wi = random_directions(4000, 2)
    expected = sheet[0].pdf(components(wi), components(np.broadcast_to(WO, wi.shape)))
    np.testing.assert_allclose(density(wi @ FRAME), expected, rtol=5e-3, atol=1e-3)
    si, bs, weight = sampled(np.random.default_rng(3).random((4000, 3)))
    value, pdf = si.bsdf().eval_pdf(mi.BSDFContext(), si, bs.wo)
    some = np.array(bs.pdf) > 1e-3
    np.testing.assert_allclose(np.array(bs.pdf)[some], np.array(pdf)[some], rtol=2e-2)
    np.testing.assert_allclose(np.array(weight)[:, some], np.array(value / pdf)[:, some], rtol=2e-2, atol=1e-3)


@pytest.mark.long
def test_closed_box_of_albedo_and_emission_one_half_has_radiance_one(mi):
    """White furnace of a Lambertian table: sum of .5 (1/2)^n."""
    table = table_dict(Exact(Material(kd=0.5), isotropic=True), shape=GridShape(8, 1, 32, 16))
    assert np.array(mi.render(furnace_box(table), spp=256)).mean() == pytest.approx(1.0, abs=0.003)


@pytest.mark.long
def test_an_rgl_file_is_mitsubas_own_measured(mi, shared_data):
    """To the .5 % of the resampling. Mitsuba gives the file the viewer where we give it the light."""
    file = shared_data / "measured" / "rgl" / "satin_rosaline_rgb.bsdf"
    ours = mi.load_dict(table_dict(load(file)))
    theirs = mi.load_dict({"type": "measured", "filename": str(file)})
    wi, wo = random_directions(50_000, 7, 0.1, both=False), random_directions(50_000, 8, 0.1, both=False)
    context = mi.BSDFContext()
    got = np.array(ours.eval(context, interaction(wo), mi.Vector3f(wi.T))).T / wi[:, 2:]
    expected = np.array(theirs.eval(context, interaction(wi), mi.Vector3f(wo.T))).T / wo[:, 2:]
    assert np.abs(got - expected).sum() < 0.01 * expected.sum()


def test_a_retro_reflector_in_the_path_tracer(mi):
    """Value, density and samples of the two grids are the same in numpy and in Mitsuba."""
    from lambent.bench.scenes.retro_tapes import TAPES

    lookup = lookup_of(TAPES[1].measured(10.0), GridShape(12, 1, 64, 16))
    bsdf = mi.load_dict(table_dict(lookup))
    rng = np.random.default_rng(0)
    wo = direction(rng.uniform(0.1, 1.3, 2000), rng.uniform(0, 2 * np.pi, 2000)).astype(np.float32)
    u = rng.random((2000, 3)).astype(np.float32)
    wi = np.stack(lookup.sample(components(wo), *components(u)), axis=-1).astype(np.float32)
    si = interaction(wo)
    value, density = bsdf.eval_pdf(mi.BSDFContext(), si, mi.Vector3f(np.ascontiguousarray(wi.T)))
    seen = wi[:, 2] > 0.05
    expected = np.stack(lookup.evaluate(components(wi), components(wo)), axis=-1) * wi[:, 2:]
    close = np.isclose(np.array(value).T, expected, rtol=0.02, atol=1e-4 * expected.max()).all(axis=1)
    assert close[seen].mean() > 0.99
    near = np.isclose(np.array(density), lookup.pdf(components(wi), components(wo)), rtol=0.02)
    assert near[seen].mean() > 0.98  # a cell's border moves by rounding
    sample, _ = bsdf.sample(mi.BSDFContext(), si, mi.Float(u[:, 0]), mi.Point2f(np.ascontiguousarray(u[:, 1:].T)))
    same = np.isclose(np.array(sample.wo).T, wi, atol=1e-3).all(axis=1)
    assert same[seen].mean() > 0.98
