"""Retro-reflective tables at the command line: how they are looked up, fitted and converted."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from lambent.bench.scenes.retro_tapes import TAPES
from lambent.materials.document import Lobe, Material, load_material
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


def test_what_is_not_looked_up_so_is_refused(lambent, tmp_path):
    Material(name="grey", kd=0.5).save(tmp_path / "grey.json")
    for command in (("inspect",), ("check",), ("convert", tmp_path / "x.mtlx")):
        name, *rest = command
        outcome = lambent(name, tmp_path / "grey.json", *rest, "--reconstruction", "back_vector")
        assert outcome.code == 2 and "--reconstruction" in outcome.err


def test_fit_takes_a_retro_lobe_or_leaves_it(lambent, tape, tmp_path):
    outcome = lambent("fit", tape, "-o", tmp_path / "tape.json")
    assert "a retro-reflective lobe removes" in outcome.err and "retro" in outcome.out
    assert [lobe.kind for lobe in load_material(tmp_path / "tape.json").lobes] == ["reflection", "retro"]
    lambent("fit", tape, "--no-retro", "-o", tmp_path / "plain.json")
    assert [lobe.kind for lobe in load_material(tmp_path / "plain.json").lobes] == ["reflection"]


@pytest.mark.parametrize(
    ("lobe", "says"),
    [
        ({"retro": True, "side": "transmission"}, "cannot be retro"),
        ({"alpha": -1.0}, "only a retro lobe"),
        ({"retro": True, "alpha": -5.0}, "alpha"),
    ],
)
def test_impossible_lobes_are_refused(lambent, tmp_path, lobe, says):
    document = Material(lobes=(Lobe(mx=0.1, my=0.1),)).model_dump(mode="json")
    document["lobes"][0] |= lobe
    (tmp_path / "m.json").write_text(json.dumps(document))
    outcome = lambent("check", tmp_path / "m.json")
    assert outcome.code == 2 and says in outcome.err
