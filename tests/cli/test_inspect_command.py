"""`lambent inspect` of measurements, scenes and photometric files: facts, faults in words, curves."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from lambent.core.pictures.images import read_image
from tests.materials.measured.measured_files import zemax_text
from tests.scenes.loaders.test_meshes import shared_box
from tests.scenes.loaders.test_toml import MATERIALS, written
from tests.scenes.photometry.written_files import ies, ies_of, ldt, ldt_of, lobe


@pytest.fixture
def bright(tmp_path: Path) -> Path:
    path = tmp_path / "bright.bsdf"
    path.write_text(zemax_text(lambda wi, wo: 0.1 / wi[..., 2:] + 0.3 + 0 * wo[..., :1], "PlaneSymmetrical"))
    return path


def test_faults_are_sentences_below_the_facts(lambent, bright):
    outcome = lambent("inspect", bright)
    assert outcome.code == 0
    facts, findings = outcome.out.split("\nfindings\n")
    assert "Zemax BSDF text" in facts and "below the horizon" in facts
    assert any("more than arrives" in line for line in findings.splitlines())
    assert max(map(len, facts.split("\nnotes\n")[0].splitlines())) < 100
    assert lambent("inspect", bright, "--json").json["faults"]["energy_above_one"] is True


@pytest.mark.long
def test_the_picture_shows_curves_and_disks(lambent, bright, tmp_path):
    """Curves above, disks below; in the disks the source is a dot and what was not measured is blue."""
    assert lambent("inspect", bright, "--plot", tmp_path / "a.png").code == 0
    image = read_image(tmp_path / "a.png")
    below = image[int(0.65 * len(image)) :]
    grey = np.abs(below - below.mean(axis=-1, keepdims=True)).max(axis=-1) < 0.01
    assert (grey & (below[..., 0] < 0.9)).mean() > 0.05  # disks
    assert (np.abs(below - np.array([1.0, 0.451, 0.0])).max(axis=-1) < 0.05).sum() > 20  # sources
    assert (image[: int(0.6 * len(image)), :, 0] < 0.2).any()  # curves


def test_daylight_is_said_in_a_line(lambent, tmp_path):
    """The sun's height, both illuminances, and the ground that the scene does not have."""
    sky = '[environment]\nkind = "sunsky"\nsun_direction = [0.0, 1.0, 1.0]\nalbedo = 0.4\n'
    for more, ground in (("", "a diffuse ground of albedo 0.4"), ('ground = "black"\n', "nothing")):
        said = lambent("inspect", written(tmp_path, MATERIALS + sky + more), "--json").json["daylight"]
        assert said == f"sun 45 degrees high, 90.1 klx facing it; sky 13.8 klx, turbidity 3; below the horizon {ground}"


def test_a_scene_is_described_with_the_hard_edges_that_are_asked_for(lambent, tmp_path):
    box, lean = shared_box(tmp_path), "have normals over 40 degrees from the face"
    for options, is_told in (((), True), (("--crease-angle", "40"), False)):
        assert (lean in " ".join(lambent("inspect", box, *options, "--json").json["warnings"])) == is_told


GAMMA = np.linspace(0, 90, 181).tolist()


@pytest.fixture
def downlight(tmp_path: Path) -> Path:
    path = tmp_path / "downlight.ldt"
    scale = 1000 * 3 / (2 * np.pi)  # of cos^2, so that 1000 lm leave the luminaire
    path.write_text(ldt_of(lobe(2, scale), [0], GAMMA, 1))
    return path


def test_the_figures_of_a_downlight(lambent, downlight):
    """cos^2: half of the peak at 45 degrees, a tenth at arccos sqrt .1 = 71.6."""
    facts = lambent("inspect", downlight, "--json").json
    assert (facts["is"], facts["format"], facts["name"], facts["maker"]) == ("luminaire", "EULUMDAT", "Dummy", "Maker")
    assert facts["flux_lm"] == pytest.approx(1000, rel=1e-3) and facts["most_cd"] == pytest.approx(477.46, rel=1e-4)
    assert facts["light_output_ratio"] == {"stated": 1.0, "found": pytest.approx(1, rel=1e-3)}
    assert facts["downward_share"] == {"stated": 1.0, "found": pytest.approx(1)}
    assert facts["most_at_deg"] == {"gamma": 0, "C": 0}
    for name, angle in (("beam_angle_deg", 90), ("field_angle_deg", 143.13)):
        assert facts[name] == {"C0-C180": pytest.approx(angle, abs=0.11), "C90-C270": pytest.approx(angle, abs=0.11)}
    assert facts["lamp_sets"] == {"0": "1 x lamp of 1000 lm, 1000 lm, 20 W, 3000 K"}
    assert (facts["symmetry"], facts["opening"], facts["findings"]) == ("about the axis", "point", ["no faults found"])


def test_faults_are_sentences(lambent, tmp_path):
    wrong = tmp_path / "wrong.ldt"
    wrong.write_text(ldt([(100, 100, 100)], gamma_deg=(0, 90, 180), percent=(80, 90), tilt=15))
    said = lambent("inspect", wrong).out
    assert "intensities add up to 1257 lm; the file states 900 lm" in said
    assert "50.0% of the light goes down; the file states 80.0%" in said
    assert "measured_tilt_deg" in said and max(map(len, said.splitlines())) < 100
    bright = tmp_path / "bright.ies"
    bright.write_text(ies(numbers="2 100 1"))
    assert "more than the 200 lm of the lamps" in lambent("inspect", bright).out
    rounded = tmp_path / "rounded.ldt"
    rounded.write_text(ldt([(79, 79, 79)], gamma_deg=(0, 90, 180), percent=(50, 98)))
    assert lambent("inspect", rounded, "--json").json["findings"] == ["no faults found"], "within 2 %"


def test_a_floodlight_of_type_b(lambent, tmp_path):
    path = tmp_path / "flood.IES"
    path.write_text(
        ies_of(lobe(40), "B", range(0, 91, 2), range(-90, 91, 2)).replace("[MANUFAC] none", "[MANUFAC] A & B")
    )
    facts = lambent("inspect", path, "--json").json
    assert (facts["format"], facts["symmetry"]) == ("IESNA:LM-63-2002, type B", "left to right")
    assert (facts["maker"], facts["report"], facts["photometry"]) == ("A & B", "by hand", "absolute")
    assert facts["opening"] == "rectangle, 0.25 x 0.5 x 0 m"
    wide = 2 * np.degrees(np.arccos(0.5 ** (1 / 40)))
    assert list(facts["beam_angle_deg"].values()) == pytest.approx([wide, wide], rel=0.02)


def test_the_polar_curve(lambent, downlight, tmp_path):
    """Solid and dashed curves below the centre, nothing of them above."""
    assert lambent("inspect", downlight, "--plot", tmp_path / "p.png").code == 0
    image = read_image(tmp_path / "p.png")[: int(0.85 * 720)]  # without the legend
    coloured = np.ptp(image, axis=-1) > 0.2
    rows = np.flatnonzero(coloured.any(axis=1))
    assert coloured[int(0.55 * 720) :].sum() > 300 and rows.min() > 0.45 * 720
    columns = np.flatnonzero(coloured[int(0.6 * 720) :].any(axis=0))
    assert columns.min() < 300 and columns.max() > 420, "both halves of the planes"


@pytest.mark.long
def test_the_unit_of_the_polar_curve(lambent, downlight, tmp_path):
    """cd/klm where the file relates to a flux, of which the numbers are then independent; else cd."""
    (tmp_path / "relative.ies").write_text(ies(numbers="1 2500 1"))
    (tmp_path / "absolute.ies").write_text(ies())
    for path, unit, most in (
        (downlight, "cd/klm", "500"),
        (tmp_path / "relative.ies", "cd/klm", "400"),
        (tmp_path / "absolute.ies", "cd", "1000"),
    ):
        assert lambent("inspect", path, "--plot", tmp_path / "p.svg").code == 0
        words = re.findall(r"<!-- (.*?) -->", (tmp_path / "p.svg").read_text())  # of which the outlines follow
        assert unit in words and max((word for word in words if word.isdigit()), key=int) == most, words


def test_what_a_photometric_file_does_not_state_is_left_out(lambent):
    sample = Path(__file__).parents[2] / "docs/tutorials/files/downlight.ies"
    assert lambent("inspect", sample, "--json").json["lamp_sets"] == {"0": "1 x lamp, 18 W"}


def test_objects_have_names(lambent, tmp_path):
    """The first 60 for people, all for machines."""
    boxes = "".join(f"o part_{n}\nv {n} 0 0\nv {n}.5 0 0\nv {n} 1 0\nf -3 -2 -1\n" for n in range(70))
    (tmp_path / "many.obj").write_text(boxes)
    assert len(lambent("inspect", tmp_path / "many.obj", "--json").json["object_names"]) == 70
    said = lambent("inspect", tmp_path / "many.obj").out
    assert "part_59 and 10 more" in said and "part_60" not in said
