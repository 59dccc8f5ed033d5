"""Writers of tables: files read back as the same table, by our readers and by Mitsuba; losses are reported."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.export import merl, rgl
from lambent.materials.measured import load
from lambent.materials.measured.inspecting.metrics import METRICS
from lambent.materials.measured.inspecting.synthetic import ISOTROPIC, record
from tests.tools.in_mitsuba import f_cos

GLOSSY = Material(name="glossy", kd=(0.3, 0.2, 0.1), lobes=(Lobe(k=(0.4,) * 3, mx=0.2, my=0.2, r0=(0.3,) * 3),))
BRUSHED = Material(name="brushed", kd=(0.05,) * 3, lobes=(Lobe(mx=0.25, my=0.12, r0=(0.9,) * 3, k=(0.8, 0.7, 0.6)),))
FOIL = Material(name="foil", kd=(0.3,) * 3, kt_d=(0.2,) * 3)
COARSE = replace(ISOTROPIC, noise=0.0, floor=0.0, step_deg=10, fine_deg=5, sector_deg=0)


@pytest.fixture(autouse=True)
def small_rgl(monkeypatch: pytest.MonkeyPatch) -> None:
    """A quarter of the nodes, for speed."""
    monkeypatch.setattr(rgl, "NODES", {"isotropic": 32, "other": 32})
    monkeypatch.setattr(rgl, "THETA_I_DEG", np.array([0, 7, 14, 22, 30, 38, 46, 53, 60, 66, 71, 76, 80, 83, 86.0]))


@pytest.fixture
def small_merl(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fewer bins, for a fortieth of the time."""
    monkeypatch.setattr(merl, "SHAPE", (40, 20, 30))
    monkeypatch.setattr(merl, "TURNS", 8)


def test_merl_is_written_once_more_as_it_was(tmp_path: Path, small_merl: None) -> None:
    cost = merl.write(GLOSSY, tmp_path / "a.binary")
    assert cost.lost == () and set(cost.errors) == set(METRICS) and 0 < cost.share["cuberoot"] < 0.02
    assert merl.write(load(tmp_path / "a.binary"), tmp_path / "b.binary").share["l1"] < 1e-9


def test_merl_reports_its_losses(tmp_path: Path, small_merl: None) -> None:
    """An anisotropic material becomes the mean over its azimuths, a non-reciprocal one the mean of both orders."""
    cost = merl.write(BRUSHED, tmp_path / "a.binary")
    assert any("anisotropy" in line for line in cost.lost) and cost.share["cuberoot"] > 0.05
    table, wi = load(tmp_path / "a.binary"), direction(0.4, 0.0)
    turns = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    wi, wo = direction(0.4, turns), direction(0.5, turns + 2.8)
    np.testing.assert_allclose(table.eval(wi[0], wo[0]), MaterialBSDF(BRUSHED).eval(wi, wo).mean(axis=0), rtol=0.02)
    assert any("transmission" in line for line in merl.write(FOIL, tmp_path / "a.binary").lost)

    def lopsided(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return (0.2 + wi[:, 2:]) * np.ones(1)

    cost = merl.write(record(lopsided, "lopsided", COARSE), tmp_path / "a.binary")
    assert any("order of wi and wo" in line for line in cost.lost)
    wi, wo = direction(np.array([0.2, 1.0]), 0.0), direction(np.array([1.0, 0.2]), 2.0)
    f = load(tmp_path / "a.binary").eval(wi, wo)[:, 0]
    assert f == pytest.approx(0.2 + (np.cos(0.2) + np.cos(1.0)) / 2, rel=0.03)


@pytest.mark.parametrize("material", [GLOSSY, BRUSHED], ids=["isotropic", "anisotropic"])
def test_rgl_is_what_mitsuba_reads(tmp_path: Path, mi: Any, material: Material) -> None:
    """The written file in our reader and in Mitsuba's `measured` plugin: the same, and close to the material."""
    path = tmp_path / "a.bsdf"
    cost = rgl.write(material, path)
    assert cost.lost == () and cost.share["l1"] < 0.03 and cost.share["cuberoot"] < 0.06
    table = load(path)
    assert table.info.isotropic == (material is GLOSSY) and table.info.format == "RGL tensor file"
    u = np.random.default_rng(1).random((4000, 4))
    wi, wo = (direction(np.arccos(1 - 0.85 * u[:, k]), 2 * np.pi * u[:, k + 1]) for k in (0, 2))
    plugin = f_cos({"type": "measured", "filename": str(path)}, wo, wi)
    mine = table.eval(wi, wo) * wo[:, 2:]
    off = np.abs(mine - plugin) / (np.abs(plugin) + 1e-3)
    assert np.quantile(off, 0.99) < 5e-3 and np.median(off) < 1e-4


def test_rgl_keeps_a_narrow_lobe_and_reports_lost_transmission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(rgl.NODES, "isotropic", 64)
    mirrorlike = Material(name="mirror", lobes=(Lobe(mx=0.01, my=0.01, r0=(0.9,) * 3, k=(1.0,) * 3),))
    cost = rgl.write(mirrorlike, tmp_path / "a.bsdf")
    wi = direction(np.radians([0.0, 33.0, 61.0]), 0.0)
    np.testing.assert_allclose(
        load(tmp_path / "a.bsdf").reflectivity(wi), MaterialBSDF(mirrorlike).albedo(wi), rtol=0.03
    )
    assert cost.share["l1"] < 0.1
    assert any("transmission" in line for line in rgl.write(FOIL, tmp_path / "a.bsdf").lost)
