"""Photons scatter as the table does, by either sampler; a table is a BSDF that can be checked."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.directions import direction
from lambent.core.errors import UserError
from lambent.materials import check
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.chi_square import chi_square
from lambent.materials.document import Lobe, Material
from lambent.materials.measured import sampling
from lambent.materials.measured.half_vector_grid import GridShape
from lambent.materials.measured.protocol import TableInfo
from lambent.materials.measured.sampling import REFLECTED, TRANSMITTED, Rejection, TableBSDF, Tabulated

SMALL = GridShape(24, 1, 64, 32)


class Exact:
    """A table without gaps, from a material document; light comes from above."""

    def __init__(self, material):
        self.bsdf = MaterialBSDF(material)
        self.info = TableInfo("exact", "exact", True, material.transmits, 3, "f")

    def eval(self, wi, wo):
        return np.where(wi[..., 2:] > 0, self.bsdf.eval(wi, wo), 0.0)


def glossy(m):
    return Lobe(mx=m, my=m, k=0.5, r0=(0.8, 0.6, 0.4), alpha=0.2)


SHEET = Exact(
    Material(kd=(0.1, 0.2, 0.3), lobes=(glossy(0.3), Lobe(side="transmission", mx=0.4, my=0.4, k=0.4, r0=0.1)))
)
WI = direction(np.radians(40), 0.7)


@pytest.fixture(scope="module")
def samplers():
    return {kind: kind(SHEET, SMALL) for kind in (Rejection, Tabulated)}


@pytest.mark.parametrize("kind", [Rejection, Tabulated])
@pytest.mark.parametrize("below", [False, True])
def test_energy_and_fates_are_the_tables(samplers, kind, below):
    n = 60_000
    got = samplers[kind].scatter(np.broadcast_to(WI * [1, 1, -1 if below else 1], (n, 3)), seed=1)
    np.testing.assert_allclose(got.weight.mean(axis=0), SHEET.bsdf.albedo(WI, samples=200_000), rtol=0.015)
    side = np.where(got.wo[:, 2] == 0, 0, np.where((got.wo[:, 2] > 0) != below, REFLECTED, TRANSMITTED))
    assert (side == got.fate).all() and got.exceeded == 0
    assert not got.weight[got.fate == 0].any() and not got.wo[got.fate == 0].any()
    far = SHEET.bsdf.material.transmission_lobes
    t = MaterialBSDF(Material(lobes=far)).albedo(WI, samples=200_000).mean()
    assert (got.fate == TRANSMITTED).mean() == pytest.approx(t, rel=0.03)


def test_rejected_candidates_leave_the_tables_own_distribution(samplers):
    """Chi-square against p itself. Even candidates make p-values near 1, never small."""
    rejection = samplers[Rejection]
    survive = float(np.sum(rejection.albedo(WI[None])))
    whole = SHEET.bsdf.albedo(WI, samples=400_000).mean()
    calls = []

    def draw(u):
        calls.append(len(u))
        return rejection.scatter(np.broadcast_to(WI, u.shape), seed=len(calls)).wo

    def density(w):
        return SHEET.eval(np.broadcast_to(WI, w.shape), w).mean(axis=-1) * np.abs(w[:, 2]) * (survive / whole)

    assert chi_square(draw, density, samples=100_000).p_value > 1e-3


def test_narrow_lobes_cost_rejection_dearly_and_the_cdf_nothing():
    proposals = {}
    for m in (0.3, 0.03):
        table = Exact(Material(lobes=(glossy(m),)))
        for kind in (Rejection, Tabulated):
            got = kind(table, SMALL).scatter(np.broadcast_to(WI, (3000, 3)))
            proposals[kind, m] = got.proposals / (got.fate > 0).sum()
    assert proposals[Rejection, 0.03] > 30 * proposals[Rejection, 0.3]
    assert proposals[Tabulated, 0.03] < 1.5 * proposals[Tabulated, 0.3]


def test_rejection_gives_up_on_a_mirror(monkeypatch):
    monkeypatch.setattr(sampling, "CANDIDATES_LIMIT", 100)
    with pytest.raises(UserError, match="too narrow"):
        Rejection(Exact(Material(lobes=(glossy(0.002),))), SMALL).scatter(np.broadcast_to(WI, (10, 3)))


def test_the_same_seed_scatters_alike(samplers):
    wi = np.broadcast_to(WI, (500, 3))
    for sampler in samplers.values():
        assert np.array_equal(sampler.scatter(wi, seed=3).wo, sampler.scatter(wi, seed=3).wo)
        assert not np.array_equal(sampler.scatter(wi, seed=3).wo, sampler.scatter(wi, seed=4).wo)


@pytest.mark.parametrize("theta_deg", [0.0, 60.0, 120.0])
def test_a_table_as_bsdf_passes_the_check_of_samplers(theta_deg):
    bsdf = TableBSDF(SHEET, SMALL)
    one = check.check_sampler(bsdf, theta_deg, 20.0, samples=300_000)
    assert one.p_value > 1e-4
    assert abs(one.pdf_integral + one.rejected_share - 1) < check.INTEGRAL_LIMIT
    assert abs(one.albedo_sampled - one.albedo_quadrature) < 5 * one.albedo_error + 2e-3 * one.albedo_quadrature


def test_light_from_below_is_the_mirrored_pair():
    bsdf, down = TableBSDF(SHEET, SMALL), np.array([1, 1, -1])
    wo = direction(np.radians([20, 70, 110]), [0.1, 2.0, 4.0])
    np.testing.assert_array_equal(bsdf.eval(WI, wo), bsdf.eval(WI * down, wo * down))
    assert bsdf.eval(WI, wo).min() > 0


class OneSideTooOften(TableBSDF):
    """Its density is 3 % too high towards +x."""

    def pdf(self, wi, wo):
        return super().pdf(wi, wo) * np.where(wi[..., 0] > 0, 1.03, 0.97)


def test_a_wrong_density_is_found():
    assert check.check_sampler(OneSideTooOften(SHEET, SMALL), 20.0, 20.0, samples=300_000).p_value < 1e-6
