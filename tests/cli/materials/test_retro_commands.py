"""Retro-reflective tables at the command line: how they are looked up, fitted and converted."""

from __future__ import annotations

from pathlib import Path

import pytest

from lambent.bench.scenes.retro_tapes import TAPES
from lambent.materials.document import load_material
from lambent.materials.export import gonio_text


@pytest.fixture(scope="module")
def tape(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("tapes") / "tape.txt"
    gonio_text.write(TAPES[1].measured(10.0), path)
    return path


def test_inspect_says_how_a_table_is_looked_up(lambent, tape):
    facts = lambent("inspect", tape, "--json").json
    assert facts["reconstruction"]["way"] == "back_vector"
    assert facts["reconstruction"]["back_vector_percent"] < 20 < facts["reconstruction"]["half_vector_percent"]
    given = lambent("inspect", tape, "--reconstruction", "quadrilinear", "--json").json
    assert given["reconstruction"] == {"way": "quadrilinear"}


def test_fit_takes_a_retro_lobe_or_leaves_it(lambent, tape, tmp_path):
    outcome = lambent("fit", tape, "-o", tmp_path / "tape.json")
    assert "a retro-reflective lobe removes" in outcome.err and "retro" in outcome.out
    assert [lobe.kind for lobe in load_material(tmp_path / "tape.json").lobes] == ["reflection", "retro"]
    lambent("fit", tape, "--no-retro", "-o", tmp_path / "plain.json")
    assert [lobe.kind for lobe in load_material(tmp_path / "plain.json").lobes] == ["reflection"]
