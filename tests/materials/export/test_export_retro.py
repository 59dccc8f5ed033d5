"""Retro-reflection in other formats: kept where it fits, stated with figures where it does not."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from lambent.bench.scenes.retro_tapes import TAPES
from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material, material_from
from lambent.materials.export import gltf, gonio_text, lbnl_xml, materialx, merl, mitsuba
from lambent.materials.export.contract import verdict_of
from lambent.materials.export.matching.match import without_retro
from lambent.materials.export.resampling import patch_mean
from lambent.materials.export.resampling.resampled import read_back
from lambent.materials.measured import load

RETRO = Lobe(retro=True, mx=0.03, my=0.03, r0=(1.0,) * 3, k=(0.4, 0.3, 0.2), alpha=-1.0)
TAPE = Material(name="tape", kd=(0.3,) * 3, lobes=(Lobe(mx=0.2, my=0.2, r0=(0.05,) * 3), RETRO))
ONLY = Material(name="only", lobes=(RETRO,))


@pytest.mark.parametrize("writer", [materialx, mitsuba, gltf], ids=lambda writer: writer.NAME)
@pytest.mark.parametrize("material", [TAPE, ONLY], ids=lambda material: material.name)
def test_tools_without_it_say_so(writer, material, tmp_path: Path):
    """The other terms are matched as if it were not there, and the errors count it."""
    path = tmp_path / f"tape{writer.ENDINGS[0]}"
    cost = writer.write(material, path)
    (line,) = (line for line in cost.lost if line.startswith("retro-reflection"))
    wi = direction(np.radians(30), 0.0)
    whole, lost = (MaterialBSDF(one).albedo(wi).mean() for one in (material, ONLY))
    assert f"{lost / whole:.0%} of the reflected light is lost" in line
    assert f"in place of {MaterialBSDF(material).eval(wi, wi).mean():.3g} /sr" in line
    rest = writer.write(without_retro(material), tmp_path / f"rest{writer.ENDINGS[0]}")
    assert cost.share["l2_ngan"] > 0.5 > rest.share["l2_ngan"]
    assert cost.verdict.word == "unusable" and "f towards the light" in cost.verdict.reason
    assert rest.towards_light == 1


def test_a_tape_that_returns_nothing_is_unusable_however_little_light_that_is(tmp_path: Path):
    """A peak of 5 % of the light, a hundred and more times as bright as the sheet about it."""
    sheet = TAPE.model_copy(update={"lobes": (RETRO.model_copy(update={"k": (0.02,) * 3, "mx": 0.005, "my": 0.005}),)})
    cost = gltf.write(sheet, tmp_path / "tape.gltf")
    wi = direction(np.radians(30), 0.0)
    least, most = (MaterialBSDF(one).eval(wi, wi).mean() for one in (without_retro(sheet), sheet))
    assert cost.towards_light == pytest.approx(least / most) and least < 0.01 * most
    assert verdict_of(cost.share, cost.light).word == "approximate" and cost.verdict.word == "unusable"
    faint = sheet.model_copy(update={"lobes": (sheet.lobes[0].model_copy(update={"mx": 0.5, "my": 0.5}),)})
    assert gltf.write(faint, tmp_path / "faint.gltf").verdict.word != "unusable"


def test_exact_documents_are_kept_beside(tmp_path: Path):
    gltf.write(TAPE, tmp_path / "tape.gltf")
    extras = json.loads((tmp_path / "tape.gltf").read_text())["materials"][0]["extras"]
    assert material_from(extras["lambent_material"], "tape").lobes[1].retro
    mitsuba.write(TAPE, tmp_path / "tape.xml")
    assert "retro&quot;:true" in (tmp_path / "tape.xml").read_text()


def test_gonio_text_keeps_the_peak(tmp_path: Path):
    cost = gonio_text.write(TAPE, tmp_path / "tape.txt")
    assert any("of the light" in line for line in cost.lost)
    assert not any(line.startswith("the retro-reflective peak") for line in cost.lost)
    table = load(tmp_path / "tape.txt")
    assert table.choice.way == "back_vector"
    for theta in (30.0, 42.5):
        wi = direction(np.radians(theta), 0.0)
        np.testing.assert_allclose(table.eval(wi, wi), MaterialBSDF(TAPE).eval(wi, wi), rtol=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("writer", [merl, lbnl_xml], ids=lambda writer: writer.NAME)
def test_coarser_formats_say_what_becomes_of_the_peak(writer, tmp_path: Path, monkeypatch):
    monkeypatch.setattr(merl, "SHAPE", (60, 30, 60))
    monkeypatch.setattr(patch_mean, "LOBES_LOG2", 7)
    table, path = TAPES[0].measured(10.0), tmp_path / f"tape{writer.ENDINGS[0]}"
    cost = writer.write(table, path)
    if not cost.errors:
        cost = read_back(table, path, cost.lost)
    (line,) = (line for line in cost.lost if line.startswith("the retro-reflective peak"))
    assert "misplaced" in line and "times as much" in line
