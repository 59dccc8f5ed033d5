"""A retro-reflector on two grids: what is looked up is the table, and the sampler follows its density."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.bench.scenes.retro_tapes import TAPES
from lambent.core.geometry.directions import FLIP_Z, direction
from lambent.materials.bsdf import MaterialBSDF, components
from lambent.materials.checking.chi_square import chi_square, combined
from lambent.materials.document import Lobe, Material
from lambent.materials.measured.protocol import TableInfo
from lambent.materials.measured.tables.half_vector_grid import GridShape
from lambent.materials.measured.tables.retro_grid import RetroGrid, retro_grid_of
from lambent.materials.measured.tables.table_bsdf import TableBSDF

SHAPE = GridShape(24, 1, 128, 32)


@pytest.fixture(scope="module", params=TAPES[:2], ids=lambda tape: tape.name)
def bsdf(request):
    return TableBSDF(request.param.measured(), SHAPE)


@pytest.mark.parametrize("theta_deg", [40.0, *(pytest.param(theta, marks=pytest.mark.slow) for theta in (0.0, 85.0))])
def test_sampler_follows_its_density(bsdf, theta_deg):
    assert isinstance(bsdf.lookup, RetroGrid)
    test = bsdf.chi_square(direction(np.radians(theta_deg), 0.4))
    assert test.p_value > 1e-3 and test.samples == pytest.approx(1_000_000, abs=2)
    assert test.pdf_integral + test.rejected_share == pytest.approx(1, abs=1e-3)


def test_shares_of_both_peaks_are_those_of_the_density(bsdf):
    """The parts are tested apart; here the mixture: samples near the light against the density's integral there."""
    wo = direction(np.radians(30), 0.0)
    rng = np.random.default_rng(0)
    wi = bsdf.sample(np.broadcast_to(wo, (200_000, 3)), rng.random((200_000, 3)))
    cosine = np.cos(np.radians(12))
    frame = np.stack([direction(np.radians(120), 0.0), np.array([0.0, 1.0, 0.0]), wo])
    u = (np.arange(400) + 0.5) / 400
    z, phi = np.meshgrid(1 - (1 - cosine) * u**4, 2 * np.pi * u, indexing="ij")  # closer towards wo
    near = direction(np.arccos(z), phi) @ frame
    width = (1 - cosine) * 4 * u[:, None] ** 3 / 400 * 2 * np.pi / 400
    expected = (bsdf.pdf(near, np.broadcast_to(wo, near.shape)) * width).sum()
    assert (wi @ wo > cosine).mean() == pytest.approx(expected, abs=0.006)


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
