"""Rejection draws a table's own distribution with its energy, at a cost that grows with the sharpness of a lobe."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.checking.chi_square import chi_square
from lambent.materials.document import Lobe, Material
from lambent.materials.measured.protocol import MeasuredTable, TableInfo
from lambent.published import rejection
from lambent.published.rejection import scatter

WI = direction(np.radians(40), 0.7)


class Exact(MeasuredTable):
    """A table without gaps, from a material document."""

    def __init__(self, material):
        self.bsdf = MaterialBSDF(material)
        self.info = TableInfo("exact", "exact", True, material.transmits, 3, "f")

    def eval(self, wi, wo):
        return self.bsdf.eval(np.broadcast_to(wi, wo.shape), wo)

    def samples(self, max_count=None):
        raise NotImplementedError


def glossy(m):
    return Lobe(mx=m, my=m, k=0.5, r0=(0.8, 0.6, 0.4), alpha=0.2)


FAR = Lobe(side="transmission", mx=0.4, my=0.4, k=0.4, r0=0.1)
SHEET = Exact(Material(kd=(0.1, 0.2, 0.3), lobes=(glossy(0.3), FAR)))


def test_energy_and_sides_are_the_tables():
    got = scatter(SHEET, WI, 60_000, seed=1)
    np.testing.assert_allclose(got.weight.mean(axis=0), SHEET.bsdf.albedo(WI, samples=200_000), rtol=0.015)
    t = MaterialBSDF(Material(lobes=(FAR,))).albedo(WI, samples=200_000).mean()
    assert (got.wo[:, 2] < 0).mean() == pytest.approx(t, rel=0.03)
    assert np.array_equal(got.weight.any(axis=1), got.wo.any(axis=1))


def test_rejected_candidates_leave_the_tables_own_distribution():
    """Chi-square against p itself. Even candidates make p-values near 1, never small."""
    calls = []

    def draw(u):
        calls.append(len(u))
        return scatter(SHEET, WI, len(u), seed=len(calls)).wo

    def density(w):
        return SHEET.eval(WI, w).mean(axis=-1) * np.abs(w[:, 2])

    assert chi_square(draw, density, samples=100_000).p_value > 1e-3


def test_narrow_lobes_cost_many_candidates():
    wide, narrow = (scatter(Exact(Material(lobes=(glossy(m),))), WI, 10_000).candidates for m in (0.3, 0.03))
    assert narrow > 30 * wide


def test_it_gives_up_on_a_mirror(monkeypatch):
    monkeypatch.setattr(rejection, "CANDIDATES_LIMIT", 100)
    with pytest.raises(UserError, match="too narrow"):
        scatter(Exact(Material(lobes=(glossy(0.002),))), WI, 100)
