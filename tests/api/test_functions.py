"""What the API does as the commands do: check, convert, glare; what a store's window left, views under another sky."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

import lambent
from lambent.core.geometry.directions import direction
from lambent.core.light.photometry import photometric
from lambent.materials.document import Lobe
from lambent.materials.document import Material as Document
from lambent.store.kept.session import FILE, RoomState, WalkSession, write_session

BRIGHT = Document(name="bright", kd=0.9, lobes=(Lobe(mx=0.1, my=0.1, r0=0.9),))


@pytest.mark.long
def test_materials_files_and_models_are_checked(tmp_path):
    found = lambent.check(lambent.Material(BRIGHT))
    assert not found.passed and "grow without bound" in found.failures[0]
    safe = lambent.Material(BRIGHT).normalised()
    assert lambent.check(safe).passed and safe.normalised() == safe
    safe.save(tmp_path / "safe.json")
    assert lambent.check(tmp_path / "safe.json").to_json() == lambent.check(safe).to_json()
    assert lambent.check("ward", mx=0.1, ks=(0.2, 0.4, 0.9)).passed
    for wrong, values, message in (
        ("wadr", {}, "did you mean.*ward"),
        (safe, {"mx": 0.1}, "only a model takes"),
        ("builtin:box", {}, "is neither a file nor a model"),
    ):
        with pytest.raises(lambent.UserError, match=message):
            lambent.check(wrong, **values)


@pytest.mark.long
def test_a_material_is_written_in_another_format(tmp_path):
    paper = lambent.Material(Document(name="paper", kd=0.5))
    cost = lambent.convert(paper, tmp_path / "paper.bsdf", as_="rgl")
    assert cost.verdict.word == "faithful" and cost.errors
    table = lambent.read(tmp_path / "paper.bsdf")
    assert table.eval(direction(0.3, 0.0), direction(0.5, 1.0)) == pytest.approx(0.5 / np.pi, rel=1e-3)
    with pytest.raises(lambent.UserError, match="fit it first"):
        lambent.convert(table, tmp_path / "paper.mtlx")
    with pytest.raises(lambent.UserError, match="found a folder; expected a material or a measured table"):
        lambent.convert(tmp_path, tmp_path / "any.bsdf", as_="rgl")


@pytest.mark.long
def test_glare_of_a_view_in_a_store(adapter, baked_box):
    found = lambent.glare(baked_box, "front", integrator="lamps", threshold_cd_m2=100)
    marked = found.marked()
    assert marked.shape == found.radiance.shape and found.sources
    brightest = photometric(found.radiance)[found.numbers == 1].mean()
    assert brightest == pytest.approx(found.sources[0].luminance, rel=0.1)
    with pytest.raises(lambent.UserError, match="applies to stores only"):
        lambent.glare(baked_box / "manifest.json", "front")


@pytest.mark.long
def test_a_room_as_its_window_left_it(adapter, baked_box, tmp_path):
    folder = tmp_path / "box.store"
    shutil.copytree(baked_box, folder)
    store = lambent.open(folder)
    with pytest.raises(lambent.UserError, match="there is no session"):
        store.as_left()
    blue = Document(name="red", kd=(0.1, 0.1, 0.6))
    session = WalkSession(now=RoomState(materials={"red": blue}))
    write_session(folder / FILE, session)
    size = {"size": (48, 36), "integrator": "lamps"}
    left, edited = store.as_left(**size), store.render("front", edits={"red": lambent.Material(blue)}, **size)
    np.testing.assert_allclose(left.radiance, edited.radiance, rtol=1e-2, atol=1e-3)


def test_a_window_needs_something_to_show(monkeypatch, tmp_path):
    monkeypatch.setattr("lambent.viewer.app.run", lambda *given, **options: shown.append((*given, options)))
    shown = []
    (tmp_path / "manifest.json").write_text('{"format": "none"}')
    lambent.window(tmp_path, "view", size=(320, 200), fresh=True)
    assert shown == [(tmp_path, "view", {"size": (320, 200), "fresh": True})]
    with pytest.raises(lambent.UserError, match="is shown from its file"):
        lambent.window(lambent.Material(BRIGHT))
    monkeypatch.undo()
    with pytest.raises(lambent.UserError, match=r"unknown mode.*walk"):
        lambent.window(tmp_path, "wlak")
