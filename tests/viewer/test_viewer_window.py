"""The whole window on a virtual screen, with a real mouse and real keys."""

import math
import os
import subprocess
import sys

import pytest

from lambent.core.errors import UserError
from lambent.core.pictures.images import read_image
from lambent.store.kept.session import FILE, read_session
from lambent.store.kept.views import read_views
from tests.viewer.small_store import FRONT, MATERIALS, write_small_store
from tests.viewer.window_session import ROOT, WindowSession

pytestmark = pytest.mark.slow
BALL = (213, 220)  # where the window of the tests shows it


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return write_small_store(tmp_path_factory.mktemp("store") / "small")


@pytest.fixture(scope="module")
def window(virtual_screen, store, tmp_path_factory):
    opened = WindowSession(virtual_screen, store, tmp_path_factory.mktemp("window"))
    yield opened
    opened.kill()


@pytest.fixture
def session(window):
    """The one window, at the first camera, on foot, with nothing selected."""
    window.move(60, 60)
    window.tool("key", "1", "Escape", *(["o"] if window.state()["mode"] == "orbit" else []))
    window.wait_for(
        lambda s: s["camera"]["name"] == "front" and s["mode"] == "walk" and s["selected"] is None and not s["moving"]
    )
    return window


def test_drag_looks_and_w_walks(session):
    session.drag((60, 200), (140, 220))
    turned = session.wait_for(lambda state: state["camera"]["target"] != list(FRONT.target))
    assert turned["camera"]["position"] == list(FRONT.position)
    session.hold("w", lambda state: math.dist(state["camera"]["position"], FRONT.position) > 0.2)
    walked = session.state()
    assert walked["camera"]["position"][1] == pytest.approx(1.6)


def test_a_slider_changes_the_material_and_not_the_camera(session):
    session.tool("key", "o")
    session.click(*BALL)
    before = session.wait_for(lambda state: state["selected"] == "ball")
    assert before["mode"] == "orbit"
    session.drag(session.point("mx", 0.5), session.point("mx", 0.8))
    session.wait_for(lambda state: lobe_of(state).get("mx", 0) > 0.2 and lobe_of(state)["my"] == lobe_of(state)["mx"])
    session.drag(session.point("mx", 0.8), (100, 100))
    session.wait_for(lambda state: lobe_of(state).get("mx", 1) < 0.1)
    assert session.state()["camera"] == before["camera"]
    assert session.state()["selected"] == "ball"
    session.tool("key", "ctrl+z", "ctrl+z")
    session.wait_for(lambda state: state["edited"] == {})
    session.click(*session.point("##file", 0.8))
    session.tool("type", "was")
    session.wait_for(lambda state: "was" in state["file_names"].get("brass", ""))
    assert session.state()["camera"] == before["camera"]
    session.drag((100, 100), (160, 100))
    session.wait_for(lambda state: state["camera"] != before["camera"])


def test_a_notch_of_the_wheel_is_a_step(session):
    session.move(60, 60)
    session.tool("click", 4)
    session.wait_for(lambda state: state["camera"]["position"][2] < FRONT.position[2] - 0.1)
    turned = session.state()["camera"]["target"]
    session.tool("click", 7)  # sideways, as two fingers scroll
    session.wait_for(lambda state: state["camera"]["target"] != turned)


def test_a_file_goes_to_the_object_that_it_is_dropped_onto(session, tmp_path):
    MATERIALS["brass"].model_copy(update={"kd": (0, 0, 0.5), "lobes": ()}).save(tmp_path / "blue.json")
    session.drop(tmp_path / "blue.json", *BALL)
    state = session.wait_for(lambda state: state["selected"] == "ball" and state["edited"])
    assert state["edited"]["brass"]["kd"] == [0, 0, 0.5] and state["editor"] is None
    session.tool("key", "ctrl+z")
    session.wait_for(lambda state: state["edited"] == {})


def test_it_rests_then_sleeps_and_wakes(session):
    done = session.sleeps()
    session.move(100, 100)
    after = session.wait_for(lambda state: state["frames"] > done["frames"])
    assert after["drawn"] == done["drawn"], "hovering must not start the picture anew"
    session.tool("key", "2")
    session.wait_for(lambda state: state["camera"]["name"] == "side" and state["drawn"] > done["drawn"])


def test_resize_and_picture(session):
    session.tool("windowsize", session.id, 700, 500)
    session.wait_for(lambda state: state["picture"] == [467, 500])
    session.tool("key", "p")
    session.wait_for(lambda state: any(m.startswith("saved") for m in state["messages"]))
    exr, png = read_image(session.out / "small-room-001.exr"), read_image(session.out / "small-room-001.png")
    assert exr.shape == png.shape == (500, 467, 3)
    assert exr.mean() > 0.05 and png.std() > 0.02
    assert png[400:].mean() > png[:100].mean(), "the floor is lit, the sky above the wall is dark: upside down?"


@pytest.mark.long
def test_close(window, store):
    """Last, because it closes the window of the tests before; a material was changed, and a walk recorded."""
    window.tool("key", "Escape")
    window.click(*BALL)
    window.wait_for(lambda state: state["selected"] == "ball")
    window.drag(window.point("mx", 0.5), window.point("mx", 0.8))
    window.wait_for(lambda state: state["edited"])
    window.tool("key", "Escape", "r")
    before = window.state()["camera"]["position"]
    window.hold("s", lambda state: math.dist(state["camera"]["position"], before) > 0.1)
    window.tool("key", "ctrl+q")
    window.wait_for(lambda state: "stay##closing" in state["rects"])
    window.tool("key", "Escape")
    window.settle()
    assert window.process.poll() is None, "the question took the key"
    assert window.close("discard") == 0
    session = read_session(store / FILE)
    assert set(session.now.materials) == {"brass"} and session.view.movement == "walk", "kept without a question"
    assert math.dist(session.view.camera.position, before) > 0.1 and read_views(store).paths == ()


def lobe_of(state):
    return state["edited"].get("brass", {"lobes": [{}]})["lobes"][0]


def run_in_a_process(store, arguments, environment):
    code = f"from pathlib import Path; from lambent.viewer.app import run; run(Path({str(store)!r}), {arguments})"
    command = [sys.executable, "-c", code]
    return subprocess.run(command, env=environment, cwd=ROOT, capture_output=True, text=True, check=False, timeout=60)


def test_without_a_display(store):
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    done = run_in_a_process(store, "'walk'", environment)
    assert "UserError: no display; use `lambent render`" in done.stderr


@pytest.mark.parametrize(
    ("mode", "says"), [("walk", "not a store"), ("material", "file does not exist"), ("edit", "file does not exist")]
)
def test_a_missing_file_is_said_before_a_missing_display(tmp_path, monkeypatch, mode, says):
    from lambent.viewer.app import run

    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(UserError, match=says):
        run(tmp_path / "gone", mode)


def test_an_unknown_mode_is_said(store):
    from lambent.viewer.app import run

    with pytest.raises(UserError, match="unknown mode"):
        run(store, "fly")
