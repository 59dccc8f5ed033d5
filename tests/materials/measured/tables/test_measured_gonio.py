"""Gonio tables: text round trip, quantities, symmetries, half-vector reconstruction, the software device."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.measured import load
from lambent.materials.measured.inspecting.synthetic import ANISOTROPIC, ISOTROPIC, synthesise
from lambent.materials.measured.parts.gonio_text import write_gonio
from tests.materials.measured.measured_files import GLOSSY, Loaded

WHITE = (1.0, 1.0, 1.0)
BRUSHED = Material(
    name="brushed", kd=(0.05,) * 3, lobes=(Lobe(mx=0.2, my=0.1, r0=WHITE, k=(0.8, 0.7, 0.6), alpha=0.5),)
)
FOIL = Material(
    name="foil",
    kd=(0.3,) * 3,
    lobes=(Lobe(side="transmission", mx=0.25, my=0.25, k=(0.6, 0.6, 0.6), r0=(0.1,) * 3, alpha=0.5),),
)
CLEAN = {"noise": 0.0, "floor": 0.0}


def test_text_round_trip(tmp_path: Path) -> None:
    for material, setup in ((BRUSHED, ANISOTROPIC), (FOIL, ISOTROPIC)):
        table = synthesise(material, replace(setup, step_deg=10, fine_deg=5))
        for quantity in ("f", "f_cos", "p"):
            path = tmp_path / "table.txt"
            write_gonio(path, table, quantity)
            back = load(path)
            assert back.info.stored == quantity and back.info.file == "table.txt"
            assert (back.symmetry, back.name) == (table.symmetry, material.name)
            ours, theirs = table.samples(), back.samples()
            assert ours.left_out == theirs.left_out and ours.left_out.shadowed > 0
            np.testing.assert_allclose(theirs.f, ours.f, rtol=2e-5)
            np.testing.assert_allclose(theirs.wo, ours.wo, atol=1e-7)
            np.testing.assert_allclose(theirs.weight, ours.weight, rtol=1e-3)


def test_not_measured_negative_and_separators(tmp_path: Path) -> None:
    path = tmp_path / "a"
    values = iter(["nan", "-1", "-0.001", "inf", "0.2", "0.3", "0.4", "0.5"])
    rows = "".join(f"0, 0, {t}, {p}, {next(values)}\n" for t in (0, 40) for p in (0, 90, 180, 270))
    path.write_text(f"# comment\n\ntheta_i, phi_i, theta_o, phi_o, f\n{rows}")
    samples = load(path).samples()
    assert (samples.left_out.shadowed, samples.below_zero) == (3, 1) and samples.f.min() == -0.001
    assert "symmetry not stated" in load(path).info.notes[0]


def test_transmission_is_beyond_90_degrees() -> None:
    table = synthesise(FOIL, replace(ISOTROPIC, **CLEAN))
    samples = table.samples()
    assert table.info.transmits and samples.transmitted.any() and (samples.wi[:, 2] > 0).all()
    truth = MaterialBSDF(FOIL)
    np.testing.assert_allclose(truth.eval(samples.wi, samples.wo), samples.f, rtol=1e-9)
    wi = direction(np.radians([0, 20, 45]), 0.0)
    np.testing.assert_allclose(table.albedo(wi), truth.albedo(wi, samples=16384), rtol=0.03)
    np.testing.assert_allclose(table.reflectivity(wi), 0.3, rtol=0.02)
    np.testing.assert_allclose(table.eval(wi * (1, 1, -1), wi * (-1, -1, 1)), table.eval(wi, wi * (-1, -1, -1)))


def test_weights_tile_the_hemisphere() -> None:
    samples = synthesise(GLOSSY, replace(ISOTROPIC, sector_deg=0, grazing_deg=84, **CLEAN)).samples()
    one = samples.wi[:, 2] == samples.wi[0, 2]
    last_edge = np.radians(82.5 + 1.25)
    assert samples.weight[one].sum() == pytest.approx(2 * np.pi * (1 - np.cos(last_edge)), rel=1e-6)


def test_isotropic_table_turns_with_the_pair(hemisphere) -> None:
    table = synthesise(GLOSSY, replace(ISOTROPIC, step_deg=5, fine_deg=5))
    wi, wo = hemisphere(100, 1), hemisphere(100, 2)
    c, s = np.cos(1.1), np.sin(1.1)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    np.testing.assert_allclose(table.eval(wi @ turn.T, wo @ turn.T), table.eval(wi, wo), rtol=1e-6, atol=1e-9)


def test_half_a_turn_of_an_isotropic_table_is_mirrored(loaded: Loaded) -> None:
    rows = "".join(f"20 0 {t} {p} {0.1 + p / 1000}\n" for t in (0, 30, 60) for p in (0, 60, 120, 180))
    table = loaded(f"# symmetry: isotropic\ntheta_i phi_i theta_o phi_o f\n{rows}")
    wi, wo = direction(np.radians(20), 0.0), direction(np.radians(30), np.radians(np.array([60.0, 300.0])))
    quadrilinear = replace(table, reconstruction="quadrilinear")
    np.testing.assert_allclose(quadrilinear.eval(np.broadcast_to(wi, (2, 3)), wo)[:, 0], 0.16)


def test_impossible_setups() -> None:
    for change in ({"theta_i_deg": (0, 95)}, {"fine_deg": 9.0}, {"phi_i_deg": (0.0, 90.0)}, {"theta_i_deg": (20, 10)}):
        with pytest.raises(UserError):
            replace(ISOTROPIC, **change)
