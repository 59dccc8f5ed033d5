"""`lambent convert`: what is written, what is said, and one clear line for what cannot be done."""

from __future__ import annotations

from pathlib import Path

import pytest

from lambent.materials.document import Lobe, Material
from lambent.materials.measured import load
from lambent.materials.measured.inspecting.metrics import METRICS
from tests.materials.measured.measured_files import zemax_text


@pytest.fixture
def measured(tmp_path: Path) -> Path:
    path = tmp_path / "vinyl.bsdf"
    path.write_text(zemax_text(lambda wi, wo: 0.1 + 0.2 * wo[..., 2:], "PlaneSymmetrical"))
    return path


@pytest.fixture
def material(tmp_path: Path) -> Path:
    Material(name="brass", kd=0.1, lobes=(Lobe(k=0.5, mx=0.2, my=0.2),)).save(tmp_path / "brass.json")
    return tmp_path / "brass.json"


def test_the_ending_says_the_format(lambent, measured, tmp_path):
    outcome = lambent("convert", measured, tmp_path / "out.txt", "--json")
    assert outcome.code == 0 and outcome.json["format"] == "gonio text" and outcome.json["lost"] == []
    assert set(outcome.json["errors"]) == set(outcome.json["share"]) == set(METRICS)
    assert outcome.json["share"]["l1"] < 1e-5
    assert load(tmp_path / "out.txt").info.format == "gonio text"


def test_a_person_is_told_the_loss_and_the_error(lambent, material, tmp_path):
    outcome = lambent("convert", material, tmp_path / "out.bsdf", "--as", "rgl")
    assert outcome.code == 0 and load(tmp_path / "out.bsdf").info.format == "RGL tensor file"
    assert "lost: nothing beyond the errors below" in outcome.out and "relative" in outcome.out
    assert all(name in outcome.out for name in METRICS)
