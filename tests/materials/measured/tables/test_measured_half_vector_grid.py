"""The dense grid agrees with the table, its sampler with its density, and a table on it is a BSDF."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF, components
from lambent.materials.checking import check
from lambent.materials.document import Lobe, Material
from lambent.materials.measured.protocol import TableInfo
from lambent.materials.measured.tables import half_vector_resampling
from lambent.materials.measured.tables.half_vector_grid import GridShape
from lambent.materials.measured.tables.half_vector_resampling import grid_of
from lambent.materials.measured.tables.table_bsdf import TableBSDF
from tests.materials.export.formula_table import FormulaTable

SMALL = GridShape(12, 8, 64, 32)


class Exact:
    """A table without gaps; `turn_rad` turns its brushing direction away from the axes."""

    def __init__(self, material, isotropic=False, turn_rad=0.0, channels=3):
        self.bsdf = MaterialBSDF(material)
        c, s = np.cos(turn_rad), np.sin(turn_rad)
        self.turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        self.info = TableInfo("exact", "exact", isotropic, material.transmits, channels, "f")

    def eval(self, wi, wo):
        return self.bsdf.eval(wi @ self.turn.T, wo @ self.turn.T)[..., : self.info.channels]


class WithABack(Exact):
    """Black where the viewer is below."""

    def eval(self, wi, wo):
        return super().eval(wi, wo) * (wo[..., 2:] > 0)


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
    ("material", "isotropic", "turn_rad", "share"),
    [
        (Material(kd=0.5), True, 0.0, 1e-6),
        (Material(lobes=(Lobe(mx=0.02, my=0.02, r0=0.9, alpha=0.4),)), True, 0.0, 0.03),
        (SHEET, False, 0.0, 0.05),
        (SHEET, False, 0.3, 0.05),
    ],
)
def test_look_ups_agree_with_the_table(material, isotropic, turn_rad, share):
    """Mean deviation as a share of the scattered light; the coarse grid here, not the default one, costs the most."""
    table = Exact(material, isotropic, turn_rad)
    grid = grid_of(table, GridShape(32, 1, 128, 32) if isotropic else GridShape(24, 8, 64, 32))
    wi, wo, pdf = drawn(grid, lowest_cosine=0.25)
    expected, gain = table.eval(wi, wo), (np.abs(wi[:, 2]) / pdf)[:, None]
    assert (np.abs(looked_up(grid, wi, wo) - expected) * gain).sum() <= share * (expected * gain).sum()


def test_symmetric_viewers_share_their_values(monkeypatch):
    for turn_rad in (0.0, 0.3):
        table = Exact(SHEET, turn_rad=turn_rad)
        shared = grid_of(table, SMALL)
        assert any(other != k for k, (other, _) in enumerate(half_vector_resampling._symmetric_viewers(table, SMALL)))
        with monkeypatch.context() as patch:
            patch.setattr(half_vector_resampling, "_symmetric_viewers", lambda *_: [(k, slice(None)) for k in range(8)])
            alone = grid_of(table, SMALL)
        for name in ("values", "density", "across"):
            np.testing.assert_allclose(getattr(shared, name), getattr(alone, name), rtol=1e-5, atol=1e-7)


def test_grey_becomes_rgb_and_an_opaque_sheet_transmits_nothing():
    grid = grid_of(Exact(Material(kd=0.5), True, channels=1), GridShape(4, 1, 16, 8))
    n = direction(0.0, 0.0)
    np.testing.assert_allclose(looked_up(grid, n, n), [0.5 / np.pi] * 3, rtol=1e-6)
    assert grid.kinds == 1 and not looked_up(grid, -n, n).any()
    assert grid.pdf(components(-n), components(n)) == 0


def test_a_back_that_differs_is_kept():
    grid = grid_of(WithABack(SHEET), SMALL)
    wi, wo, _ = drawn(grid)
    assert grid.faces == 2
    below = wo[:, 2] < 0
    assert not looked_up(grid, wi, wo)[below].any() and looked_up(grid, wi, wo)[~below].all()


@pytest.mark.parametrize("theta_deg", [0.0, 40.0, 85.0])
def test_the_albedo_by_sampling_is_the_models(theta_deg):
    table = Exact(SHEET)
    grid = grid_of(table, SMALL)
    wo = np.broadcast_to(direction(np.radians(theta_deg), 0.3), (200_000, 3))
    wi = np.stack(grid.sample(components(wo), *np.random.default_rng(1).random((3, len(wo)))), -1)
    pdf = grid.pdf(components(wi), components(wo))
    gain = np.divide(np.abs(wi[:, 2]), pdf, out=np.zeros_like(pdf), where=pdf > 0)
    expected = table.bsdf.albedo(wo[0], samples=200_000)
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
    one = check.check_sampler(lit_from_above, theta_deg, 20.0, samples=200_000)
    assert one.p_value > 1e-4
    assert abs(one.pdf_integral + one.rejected_share - 1) < check.INTEGRAL_LIMIT
    assert abs(one.albedo_sampled - one.albedo_quadrature) < 5 * one.albedo_error + 2e-3 * one.albedo_quadrature


def test_light_from_below_is_the_mirrored_pair(lit_from_above):
    wi, wo, down = direction(np.radians(40), 0.7), direction(np.radians([20, 70, 110]), [0.1, 2, 4]), (1, 1, -1)
    np.testing.assert_array_equal(lit_from_above.eval(wi, wo), lit_from_above.eval(wi * down, wo * down))
    assert lit_from_above.eval(wi, wo).min() > 0
