"""`lambent check`, `fit`, `convert` and `inspect` of materials and measurements: what they write and what they say."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.bench.scenes.retro_tapes import TAPES
from lambent.cli.materials.check import describe
from lambent.materials.checking import check, check_table
from lambent.materials.document import Lobe, Material, load_material
from lambent.materials.export import gonio_text
from lambent.materials.measured import load
from lambent.materials.measured.inspecting.metrics import METRICS
from lambent.materials.measured.inspecting.synthetic import ISOTROPIC, Setup, synthesise
from lambent.materials.measured.parts.gonio_text import write_gonio
from lambent.materials.measured.tables import half_vector_resampling
from lambent.materials.measured.tables.half_vector_grid import GridShape
from tests.materials.measured.lbnl_files import lbnl_xml, words
from tests.materials.measured.measured_files import rgl_fields, tensor_bytes, zemax_text


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(check, "SAMPLER_THETA_DEG", (45.0,))
    monkeypatch.setattr(check_table, "INTEGRAL_THETA_DEG", (40.0,))


@pytest.mark.long
def test_a_model_by_name(lambent):
    outcome = lambent("check", "ward", "--set", "mx=0.1", "--set", "ks=0.2,0.4,0.9", "--json")
    assert outcome.code == 0
    mean = outcome.json["furnace"]["mean_albedo"]
    assert mean[1] / mean[0] == pytest.approx(2) and mean[2] / mean[0] == pytest.approx(4.5)


def test_a_model_that_fails(lambent):
    outcome = lambent("check", "kurt", "--set", "k=4", "--set", "r0=1", "--set", "alpha=1")
    assert outcome.code == 1 and "without bound" in outcome.out


@pytest.mark.long
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


@pytest.mark.long
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


PAINT = Material(name="paint", kd=0.2, lobes=(Lobe(k=(0.7,) * 3, mx=0.15, my=0.15, r0=(0.06,) * 3, alpha=0.3),))


@pytest.fixture
def paint(tmp_path):
    path = tmp_path / "paint.txt"
    few = replace(ISOTROPIC, theta_i_deg=(0.0, 30.0, 60.0, 86.0), step_deg=10.0, fine_deg=5.0, grazing_deg=88.0)
    write_gonio(path, synthesise(PAINT, few))
    return path


def test_everything_left_out_is_printed_with_its_count(lambent, paint):
    left_out = load(paint).samples().left_out
    assert min(left_out.shadowed, left_out.grazing) > 0
    text = " ".join(lambent("fit", paint).out.split())
    assert f"{left_out.shadowed} left out: marked as not measured, or hidden by the device" in text
    assert f"{left_out.grazing} left out: theta_i or theta_o beyond 84" in text
    facts = lambent("fit", paint, "--json").json["tuples"]
    assert sum(facts["left_out"].values()) == left_out.total
    assert f"{facts['used']} tuples fitted" in text


@pytest.mark.long
def test_the_other_side_of_a_sheet_is_left_out_and_counted(lambent, tmp_path):
    path = tmp_path / "sheet.xml"
    values, quarter = words(np.full((41, 41), 0.1)), "LBNL/Klems Quarter"
    blocks = [("Visible", f"Reflection {side}", values) for side in ("Front", "Back")]
    path.write_text(lbnl_xml("Columns", blocks, column=quarter))
    both = lambent("fit", path, "--json").json["tuples"]
    behind = both["left_out"]["light from -z, the other side of the sheet"]
    assert (
        behind == both["used"] + both["left_out"]["theta_i or theta_o beyond 84°, where devices see their own errors"]
    )
    path.write_text(lbnl_xml("Columns", blocks[1:], column=quarter))
    assert "light from -z" not in lambent("fit", path).out


@pytest.mark.long
def test_the_albedo_is_in_the_summary_and_can_be_kept(lambent, paint):
    for options in ((), ("--keep-albedo",)):
        outcome = lambent("fit", paint, *options)
        assert outcome.code == 0
        assert "albedo in reflection at worst" in outcome.out
    facts = lambent("fit", paint, "--keep-albedo", "--json").json
    assert facts["albedos"][0]["side"] == "reflection"
    assert "albedo kept" in facts["material"]["provenance"]["method"]


@pytest.fixture
def spoilt(tmp_path: Path) -> Path:
    """An RGL file with blue below zero over half of each incident direction."""
    fields = rgl_fields(np.zeros(1))
    fields["rgb"][:, :, 2, ::2] = -0.005
    (tmp_path / "spoilt.bsdf").write_bytes(tensor_bytes(fields))
    return tmp_path / "spoilt.bsdf"


def test_inspect_and_fit_count_alike(lambent, spoilt):
    samples = load(spoilt).samples()
    words = f"{samples.below_zero} of {len(samples)} tuples"
    assert samples.below_zero > 0.3 * len(samples)
    inspected = lambent("inspect", spoilt)
    assert words in inspected.out and "below zero: blue in" in inspected.out and "a fit keeps them" in inspected.out
    fitted = lambent("fit", spoilt)
    assert words in fitted.err and "a fit keeps them, and the cuberoot metric counts them as 0" in fitted.err


@pytest.mark.long
def test_check_finds_them_and_no_fault_in_them(spoilt):
    samples = load(spoilt).samples()
    report = check_table.check_table(load(spoilt), shape=GridShape(24, 1, 64, 32))
    facts = report.to_json()
    words = f"{samples.below_zero} of {len(samples)} tuples"
    assert facts["tuples"]["below_zero"] == samples.below_zero and words in facts["negative_readings"]
    assert not any("zero" in text for text in (*report.warnings, *report.failures))
    (line,) = (line for line in describe(report).splitlines() if words in line)
    assert line.startswith("readings below zero") and line.endswith("drawn as 0")


@pytest.fixture(scope="module")
def tape(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("tapes") / "tape.txt"
    gonio_text.write(TAPES[1].measured(10.0), path)
    return path


@pytest.mark.long
def test_inspect_says_how_a_table_is_looked_up(lambent, tape):
    facts = lambent("inspect", tape, "--json").json
    assert facts["reconstruction"]["way"] == "back_vector"
    assert facts["reconstruction"]["back_vector_percent"] < 20 < facts["reconstruction"]["half_vector_percent"]
    given = lambent("inspect", tape, "--reconstruction", "quadrilinear", "--json").json
    assert given["reconstruction"] == {"way": "quadrilinear"}


@pytest.mark.long
def test_fit_takes_a_retro_lobe_or_leaves_it(lambent, tape, tmp_path):
    outcome = lambent("fit", tape, "-o", tmp_path / "tape.json")
    assert "a retro-reflective lobe removes" in outcome.err and "retro" in outcome.out
    assert [lobe.kind for lobe in load_material(tmp_path / "tape.json").lobes] == ["reflection", "retro"]
    lambent("fit", tape, "--no-retro", "-o", tmp_path / "plain.json")
    assert [lobe.kind for lobe in load_material(tmp_path / "plain.json").lobes] == ["reflection"]


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


@pytest.mark.long
def test_a_person_is_told_the_loss_and_the_error(lambent, material, tmp_path):
    outcome = lambent("convert", material, tmp_path / "out.bsdf", "--as", "rgl")
    assert outcome.code == 0 and load(tmp_path / "out.bsdf").info.format == "RGL tensor file"
    assert "lost: nothing beyond the errors below" in outcome.out and "relative" in outcome.out
    assert all(name in outcome.out for name in METRICS)
