"""Every export ends with a verdict in words, by limits in one place; retro-reflection that is lost counts."""

from __future__ import annotations

import inspect
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.bench.scenes.retro_tapes import TAPES
from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material, material_from
from lambent.materials.export import gltf, gonio_text, lbnl_xml, materialx, merl, mitsuba
from lambent.materials.export.contract import LIGHT_LIMITS, LIMITS, RETRO_LIMITS, Cost, verdict_of, writers
from lambent.materials.export.matching import without_retro
from lambent.materials.export.resampling.resampled import proposal_of, read_back
from lambent.materials.measured import load
from lambent.materials.measured.inspecting.metrics import METRICS
from lambent.materials.measured.inspecting.synthetic import ISOTROPIC, synthesise
from tests.materials.export.export_materials import ALL
from tests.tools.checks import assert_sampler

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


@pytest.mark.long
def test_gonio_text_keeps_the_peak(tmp_path: Path):
    cost = gonio_text.write(TAPE, tmp_path / "tape.txt")
    assert any("of the light" in line for line in cost.lost)
    assert not any(line.startswith("the retro-reflective peak") for line in cost.lost)
    table = load(tmp_path / "tape.txt")
    assert table.choice.way == "back_vector"
    for theta in (30.0, 42.5):
        wi = direction(np.radians(theta), 0.0)
        np.testing.assert_allclose(table.eval(wi, wi), MaterialBSDF(TAPE).eval(wi, wi), rtol=0.05)


@pytest.mark.long
@pytest.mark.parametrize("writer", [merl, lbnl_xml], ids=lambda writer: writer.NAME)
def test_coarser_formats_say_what_becomes_of_the_peak(writer, tmp_path: Path, monkeypatch):
    monkeypatch.setattr(merl, "SHAPE", (60, 30, 60))
    monkeypatch.setattr(lbnl_xml, "LOBES_LOG2", 7)
    table, path = TAPES[0].measured(10.0), tmp_path / f"tape{writer.ENDINGS[0]}"
    cost = writer.write(table, path)
    if not cost.errors:
        cost = read_back(table, path, cost.lost)
    (line,) = (line for line in cost.lost if line.startswith("the retro-reflective peak"))
    assert "misplaced" in line and "times as much" in line


GLOSS = Lobe(mx=0.1, my=0.1, r0=(0.6,) * 3, k=(0.8,) * 3)
THROUGH = Lobe(side="transmission", mx=0.1, my=0.1, k=(0.3,) * 3)
COARSE = replace(ISOTROPIC, step_deg=10.0, fine_deg=2.0)


RETRO_NET = Lobe(retro=True, mx=0.05, my=0.05, r0=(1.0,) * 3, k=(0.4,) * 3)


@pytest.mark.parametrize(
    ("lobes", "kinds"),
    [
        ((GLOSS,), ["reflection"]),
        ((GLOSS, THROUGH), ["reflection", "transmission"]),
        ((RETRO_NET, THROUGH), ["reflection", "retro", "transmission"]),
    ],
)
def test_directions_are_drawn_about_the_light_for_retro_reflectors_alone(lobes, kinds) -> None:
    setup = replace(COARSE, about_lamp=True, sector_deg=0.0)
    proposal = proposal_of(synthesise(Material(name="sheet", kd=(0.1,) * 3, lobes=lobes), setup)).material
    assert [lobe.kind for lobe in proposal.lobes] == [kind for kind in kinds for _ in range(4)]


@pytest.mark.long
def test_samples_follow_their_density() -> None:
    assert_sampler(proposal_of(TAPES[1].measured(10.0)), 50.0, 20.0, samples=200_000)


PERFECT = dict.fromkeys(METRICS, 0.0)


def test_each_metric_has_limits_and_each_limit_decides() -> None:
    assert set(LIMITS) == set(METRICS)
    assert verdict_of(PERFECT, {"reflection": 1.0}).word == "faithful"
    for name, (faithful, usable) in LIMITS.items():
        assert verdict_of(PERFECT | {name: faithful}, {}).word == "faithful"
        found = verdict_of(PERFECT | {name: 1.01 * faithful}, {})
        assert found.word == "approximate" and found.reason.startswith(name)
        found = verdict_of(PERFECT | {name: 1.01 * usable}, {})
        assert found.word == "unusable" and f"limit {usable:.0%}" in found.reason
    assert verdict_of(PERFECT | {"l1": float("nan")}, {}).word == "unusable"


def test_the_page_states_the_limits() -> None:
    page = (Path(__file__).parents[3] / "docs" / "exporting.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ([^|]+) \| (?:within )?(\d+) %[^|]* \| (?:within )?(\d+) % \|$", page, re.MULTILINE)
    stated = {name.split(":")[0].strip(): (int(low) / 100, int(high) / 100) for name, low, high in rows}
    names = {"l1": "L1", "l2_ngan": "L2 (Ngan)", "cuberoot": "cube root", "log": "log"}
    assert stated == {names[name]: limits for name, limits in LIMITS.items()} | {
        "reflected and transmitted light, each": LIGHT_LIMITS,
        "f back towards the light, where retro lobes were left out": RETRO_LIMITS,
    }


@pytest.mark.parametrize("side", ["reflection", "transmission"])
def test_light_that_is_lost_or_made_decides_too(side) -> None:
    faithful, usable = LIGHT_LIMITS
    for sign in (-1, 1):
        assert verdict_of(PERFECT, {side: 1 + sign * (faithful + 0.01)}).word == "approximate"
        found = verdict_of(PERFECT, {side: 1 + sign * (usable + 0.01)})
        assert found.word == "unusable" and "light" in found.reason


def test_no_comparison_is_no_praise() -> None:
    assert Cost().verdict.word == "not compared"


def test_different_lobes_in_one_are_unusable() -> None:
    """Three Beckmann lobes from mirror-like to matt: glTF has one, with other tails."""
    lobes = tuple(Lobe(k=0.3, mx=m, my=m, r0=0.9) for m in (0.01, 0.08, 0.5))
    cost = gltf.likeness(Material(name="three", lobes=lobes))[1]
    assert cost.verdict.word == "unusable" and "limit" in cost.verdict.reason
    assert gltf.likeness(ALL["-- paper"])[1].verdict.word == "faithful"


@pytest.mark.parametrize("name", writers())
def test_every_writer_compares_its_file(name: str, tmp_path: Path) -> None:
    """A Lambert surface, which every format holds."""
    writer = writers()[name]
    assert "material" in writer.TAKES and inspect.isfunction(writer.write)
    cost = writer.write(Material(name="matt", kd=0.5), tmp_path / f"a{writer.ENDINGS[0]}", lambda *_: None)
    assert cost.verdict.word == "faithful" and cost.light["reflection"] == pytest.approx(1, abs=0.05)
