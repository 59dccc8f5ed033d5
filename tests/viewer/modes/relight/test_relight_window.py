"""Relighting in its window, from a bake in the background to a saved picture, and what needs no display."""

import numpy as np
import pytest

from lambent.baking.running.relit import Relit
from lambent.baking.transport.view import View
from lambent.cli.main import run
from lambent.core.pictures.images import read_image
from lambent.editing.relit_view import RelitView
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import ImageEnvironment
from lambent.store.kept.session import FILE, RoomState, read_session
from lambent.store.store import Store
from lambent.viewer.modes.relight.baking import ViewBake
from tests.viewer import waiting

WINDOW = (1000, 700)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--camera", "nowhere"], "--camera"),
        (["--environment", "absent.hdr"], "absent.hdr: file does not exist"),
        (["--environment", "tray.store/manifest.json"], "is no sky"),
        (["--environment", "sky.exr", "--scale", "0"], "scale"),
    ],
)
def test_wrong_arguments_need_no_display(capsys, tray, sky, monkeypatch, options, said):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.chdir(tray.parent)
    assert run(["relight", "tray.store", *options]) == 2
    line = capsys.readouterr().err
    assert said in line and line.count("\n") == 1


def test_without_a_display_a_line_says_so(capsys, tray, monkeypatch):
    monkeypatch.setattr("glfw.init", lambda: False)
    assert run(["relight", str(tray)]) == 2
    assert "no display; name a picture with -o" in capsys.readouterr().err


@pytest.mark.long
def test_a_stopped_bake_goes_on(tray):
    camera = load_scene("builtin:teatray").cameras[0]
    relit = Relit(tray, RoomState(), View(camera, 160, 120))
    scene = relit.scene()
    first = ViewBake(relit, lambda: None)
    waiting.until(lambda: "triangles" in first.line and not first.line.endswith(" 0 %"))
    assert "relighting" in first.line
    first.close()
    spans = relit.view.name("relighting", "spans")
    begun = Store.open(tray).artefact(spans)
    assert not relit.is_baked(scene) and not begun.complete
    second = ViewBake(relit, lambda: None)
    waiting.until(lambda: not second.running)
    assert not second.error and relit.is_baked(scene)
    assert RelitView(Store.open(tray), camera, 160, 120).image().mean() > 0


@pytest.mark.long
def test_a_view_is_relit_in_its_window(open_window, tray, sky, tmp_path):
    window = open_window(tray, tmp_path, WINDOW, "relight")
    before = window.wait_for(lambda state: state.get("relit"))
    assert not before["said"] and before["brightness"] > 0
    window.drag(window.point("turn", 0.5), window.point("turn", 0.75))
    turned = window.wait_for(lambda state: state["relit"] and state["turn_deg"] > 60)
    window.drag((300, 300), (340, 300))
    window.wait_for(lambda state: state["turn_deg"] == pytest.approx(turned["turn_deg"] - 10, abs=1))
    window.tool("key", "ctrl+z")
    window.wait_for(lambda state: state["turn_deg"] == turned["turn_deg"])
    window.drop(sky, 300, 300)
    window.wait_for(lambda state: state["relit"] and state["sky"] == "../sky.exr")
    window.tool("key", "p")
    window.wait_for(lambda state: any("teatray-001.png" in text for text in state["messages"]))
    view = RelitView(Store.open(tray), load_scene("builtin:teatray").cameras[0], 16, 12)
    view.light(ImageEnvironment(sky))
    view.turn(turned["turn_deg"])
    view.draw()
    assert np.allclose(read_image(tmp_path / "teatray-001.exr"), view.image(), rtol=1e-3, atol=1e-5)
    window.click(*window.point("as baked"))
    window.wait_for(lambda state: state["relit"] and state["sky"] is None)
    assert window.close() == 0, window.log()
    kept = read_session(tray / FILE)
    assert kept.sky.turn_deg == turned["turn_deg"] and kept.sky.environment is None
