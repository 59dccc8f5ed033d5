"""`lambent check` takes documents, models and measured files, and nothing else."""

from __future__ import annotations

import pytest

from lambent.materials.checking import check, check_table
from lambent.materials.document import Lobe, Material, load_material
from lambent.materials.measured.inspecting.synthetic import Setup, synthesise
from lambent.materials.measured.parts.gonio_text import write_gonio
from lambent.materials.measured.tables import half_vector_resampling
from lambent.materials.measured.tables.half_vector_grid import GridShape


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(check, "SAMPLER_THETA_DEG", (45.0,))
    monkeypatch.setattr(check_table, "INTEGRAL_THETA_DEG", (40.0,))


def test_a_model_by_name(lambent):
    outcome = lambent("check", "ward", "--set", "mx=0.1", "--set", "ks=0.2,0.4,0.9", "--json")
    assert outcome.code == 0
    mean = outcome.json["furnace"]["mean_albedo"]
    assert mean[1] / mean[0] == pytest.approx(2) and mean[2] / mean[0] == pytest.approx(4.5)


def test_a_model_that_fails(lambent):
    outcome = lambent("check", "kurt", "--set", "k=4", "--set", "r0=1", "--set", "alpha=1")
    assert outcome.code == 1 and "without bound" in outcome.out


def test_a_measured_file(lambent, tmp_path, monkeypatch):
    monkeypatch.setattr(half_vector_resampling, "ISOTROPIC", GridShape(16, 1, 64, 32))
    setup = Setup((0.0, 30.0, 60.0), step_deg=10, fine_deg=5, noise=0.0, floor=0.0)
    material = Material(name="m", kd=0.3, lobes=(Lobe(mx=0.3, my=0.3, k=0.3),))
    write_gonio(tmp_path / "m.txt", synthesise(material, setup))
    outcome = lambent("check", tmp_path / "m.txt")
    assert outcome.code == 0 and "swapping wi and wo changes" in outcome.out and outcome.out.endswith("passed\n")


STEEP = Material(kd=0.1, lobes=(Lobe(mx=0.4, my=0.4, k=0.8, r0=1, alpha=1),))


@pytest.fixture
def one_azimuth(monkeypatch):
    """Isotropic materials need no more."""
    monkeypatch.setattr(check, "PHI_DEG", (0.0,))


@pytest.mark.usefixtures("one_azimuth")
def test_normalise_writes_the_safe_version(lambent, tmp_path):
    STEEP.save(tmp_path / "m.json")
    outcome = lambent("check", tmp_path / "m.json", "--normalise", "-o", tmp_path / "safe.json", "--json")
    assert outcome.code == 0 and outcome.json["written"] == str(tmp_path / "safe.json")
    before, after = outcome.json["highest"]
    assert before["albedo"] > 1 >= after["albedo"] and outcome.json["share"]["cuberoot"] > 0
    safe = load_material(tmp_path / "safe.json")
    assert 0 < safe.lobes[0].alpha < 1 and outcome.json["changed"]["lobes[0].alpha"] == [1, safe.lobes[0].alpha]
    again = lambent("check", tmp_path / "safe.json", "--normalise", "-o", tmp_path / "again.json")
    assert again.code == 0 and "nothing written" in again.out and not (tmp_path / "again.json").exists()
