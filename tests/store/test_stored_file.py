"""A store that version 1.0 baked, kept as a file: every later version reads and draws it."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import numpy as np
import pytest

import lambent

FILE = Path(__file__).with_name("box-1.0.zip")  # `builtin:box`, one light group, 32 texels a side
DRAWN = {"lamps": (0.2661, 0.2297, 0.1681), "traced": (0.2642, 0.2279, 0.1666)}  # mean radiance of 48x36 pixels


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stored") / "box.store"
    with zipfile.ZipFile(FILE) as packed:
        packed.extractall(folder)
    return folder


def test_it_is_read_whole(stored):
    store = lambent.open(stored)
    assert json.loads((stored / "manifest.json").read_text())["format"] == "lambent-store"
    facts = store.facts()
    assert len(facts["arrays"]) > 30 and all(words.endswith("complete") for words in facts["arrays"].values())
    assert list(store.cameras) == ["front"] and store.light_groups == ("lamp",) and "white" in store.materials


@pytest.mark.long
@pytest.mark.parametrize("integrator", DRAWN)
def test_it_looks_as_it_did(adapter, stored, integrator):
    store = lambent.open(stored)
    wanted = {"size": (48, 36), "integrator": integrator}
    drawn = store.render("front", **wanted).radiance.mean(axis=(0, 1))
    np.testing.assert_allclose(drawn, DRAWN[integrator], rtol=0.03)
    dimmed = store.render("front", light={"lamp": 0.5}, **wanted).radiance.mean(axis=(0, 1))
    np.testing.assert_allclose(dimmed, drawn / 2, rtol=0.03)


def test_a_later_format_is_refused_in_one_line(stored, tmp_path):
    manifest = json.loads((stored / "manifest.json").read_text())
    (tmp_path / "manifest.json").write_text(json.dumps({**manifest, "version": 99}))
    with pytest.raises(lambent.UserError, match=r"unknown store version; found lambent-store 99; expected .*1 or 2"):
        lambent.open(tmp_path)
