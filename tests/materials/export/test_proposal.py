"""Directions drawn where a table scatters: about the light, too, for one that is retro-reflective."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.bench.scenes.retro_tapes import TAPES, Tape
from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.export.matching.match import without_retro
from lambent.materials.export.matching.proposal import proposal_of
from lambent.materials.measured.inspecting.synthetic import ISOTROPIC, synthesise
from lambent.materials.measured.protocol import MeasuredTable
from tests.tools.chi_square import LEVEL, sampler_test

GLOSS = Lobe(mx=0.1, my=0.1, r0=(0.6,) * 3, k=(0.8,) * 3)
THROUGH = Lobe(side="transmission", mx=0.1, my=0.1, k=(0.3,) * 3)
COARSE = replace(ISOTROPIC, step_deg=10.0, fine_deg=2.0)


def variances(table: MeasuredTable, drawn: MaterialBSDF, other: MaterialBSDF, theta_deg: float) -> tuple[float, float]:
    """Of one sample of the reflectivity over the square of its mean, where `drawn` or `other` draws it.

    Both are estimated with the samples of `drawn`: samples of a proposal that misses a peak do not show what it misses.
    """
    u = np.random.default_rng(0).random((20_000, 3))
    wi = np.broadcast_to(direction(np.radians(theta_deg), 0.0), u.shape)
    wo = drawn.sample(wi, u)
    wi, wo = wi[wo[:, 2] > 0], wo[wo[:, 2] > 0]
    light = table.eval(wi, wo).mean(axis=-1) * wo[:, 2]
    density, others = drawn.pdf(wo, wi), other.pdf(wo, wi)
    mean = (light / density).sum() / len(u)
    first, second = ((light**2 / (density * one)).sum() / len(u) / mean**2 - 1 for one in (density, others))
    return float(first), float(second)


@pytest.mark.parametrize("tape", TAPES, ids=lambda tape: tape.name)
def test_peaks_about_the_light_are_sampled_well(tape: Tape) -> None:
    """Before, the variance was 8 (paint, 8 degrees wide) to tens of thousands (prisms, half a degree wide)."""
    table = tape.measured()
    found = proposal_of(table)
    mirroring = MaterialBSDF(without_retro(found.material))
    for theta_deg in (20.0, 45.0, 60.0):
        now, before = variances(table, found, mirroring, theta_deg)
        assert now < 5 and before > 1.5 * now


def test_other_tables_draw_no_direction_about_the_light() -> None:
    glossy = synthesise(Material(name="gloss", kd=(0.1,) * 3, lobes=(GLOSS,)), COARSE)
    assert [lobe.kind for lobe in proposal_of(glossy).material.lobes] == ["reflection"] * 4
    sheet = synthesise(Material(name="sheet", kd=(0.1,) * 3, lobes=(GLOSS, THROUGH)), COARSE)
    kinds = [lobe.kind for lobe in proposal_of(sheet).material.lobes]
    assert kinds == ["reflection"] * 4 + ["transmission"] * 4


def test_a_retro_reflective_sheet_transmits_by_mirrored_lobes_alone() -> None:
    retro = Lobe(retro=True, mx=0.05, my=0.05, r0=(1.0,) * 3, k=(0.4,) * 3)
    setup = replace(COARSE, about_lamp=True, sector_deg=0.0)
    table = synthesise(Material(name="net", kd=(0.1,) * 3, lobes=(retro, THROUGH)), setup)
    kinds = [lobe.kind for lobe in proposal_of(table).material.lobes]
    assert kinds == ["reflection"] * 4 + ["retro"] * 4 + ["transmission"] * 4


def test_samples_follow_their_density() -> None:
    assert sampler_test(proposal_of(TAPES[1].measured(10.0)), 50.0, 20.0, samples=200_000).p_value > LEVEL
