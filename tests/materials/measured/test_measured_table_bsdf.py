"""A table is a BSDF that can be checked."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.checking import check
from lambent.materials.document import Lobe, Material
from lambent.materials.measured.protocol import TableInfo
from lambent.materials.measured.tables.half_vector_grid import GridShape
from lambent.materials.measured.tables.table_bsdf import TableBSDF

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
