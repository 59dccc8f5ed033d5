"""Directions drawn where a table scatters: about the light, too, for one that is retro-reflective."""

from __future__ import annotations

from dataclasses import replace

from lambent.bench.scenes.retro_tapes import TAPES
from lambent.materials.document import Lobe, Material
from lambent.materials.export.resampling.resampled import proposal_of
from lambent.materials.measured.inspecting.synthetic import ISOTROPIC, synthesise
from tests.tools.chi_square import LEVEL, sampler_test

GLOSS = Lobe(mx=0.1, my=0.1, r0=(0.6,) * 3, k=(0.8,) * 3)
THROUGH = Lobe(side="transmission", mx=0.1, my=0.1, k=(0.3,) * 3)
COARSE = replace(ISOTROPIC, step_deg=10.0, fine_deg=2.0)


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
