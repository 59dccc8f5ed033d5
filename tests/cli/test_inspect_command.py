"""`lambent inspect` of measurements: facts, faults in words, one picture with curves and disks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.pictures.images import read_image
from tests.materials.measured.measured_files import zemax_text
from tests.scenes.loaders.test_creases import shared_box
from tests.scenes.loaders.test_toml import MATERIALS, written


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
