"""Closing with unsaved work asks; without any it does not."""

from dataclasses import replace

import pytest

from lambent.materials.document import load_material
from lambent.store.kept.session import FILE, read_session
from lambent.store.kept.views import read_views
from lambent.viewer.edits.session_file import READ_ONLY
from lambent.viewer.modes.walk.panels import room
from lambent.viewer.panels import overlay
from tests.viewer.panel_driver import PanelDriver, walk_mode


@pytest.fixture
def panels(monkeypatch, state, geometry):
    driver = PanelDriver(monkeypatch, walk_mode(state, geometry))
    yield driver
    driver.close()


def change(state, kd=0.3):
    state.materials.edits.change("brass", state.scene.materials["brass"].model_copy(update={"kd": (kd,) * 3}))
    state.materials.edits.end_stroke()


def record(panels):
    state = panels.state
    state.recordings.record()
    for k in range(10):
        state.navigation.camera = replace(state.navigation.camera, position=(0.1 * k, 1.6, 3.0))
        state.screen.clock.now_s = 0.1 * k
        panels.mode.advance(0.0)


def ask(panels):
    panels.state.screen.asks_to_close = True
    panels.frame(3)


def test_what_is_unsaved_is_named(panels, state):
    assert panels.mode.unsaved == ()
    change(state)
    assert panels.mode.unsaved == ("brass",)
    record(panels)
    assert panels.mode.unsaved == ("brass", "the recorded walk")
    state.recordings.record()
    assert panels.mode.unsaved == ("brass", "the recorded walk")


def test_a_recording_without_a_step_is_nothing(panels, state):
    state.recordings.record()
    assert panels.mode.unsaved == ()


def test_saving_keeps_all_of_it_and_closes(panels, state, tmp_path):
    change(state)
    record(panels)
    ask(panels)
    panels.click("save##closing")
    assert state.screen.closes and not state.screen.asks_to_close and panels.mode.unsaved == ()
    assert load_material(tmp_path / "brass.json").kd == (0.3, 0.3, 0.3)
    assert [path.name for path in read_views(tmp_path).paths] == ["walk 1"]


def test_a_recorded_walk_is_saved_from_the_panel(panels, state, tmp_path):
    record(panels)
    state.recordings.record()
    for label in ("Material", "View", "save path##path name"):
        panels.click(label, 0.3)
        panels.frame(2)
    assert [path.name for path in read_views(tmp_path).paths] == ["walk 1"] and panels.mode.unsaved == ()


def test_a_file_that_is_there_is_replaced_when_save_is_pressed_again(panels, state, tmp_path):
    (tmp_path / "brass.json").write_text("of somebody else")
    change(state)
    ask(panels)
    panels.click("save##closing")
    assert state.screen.asks_to_close and not state.screen.closes
    assert "save again" in state.screen.messages[-1].text
    assert (tmp_path / "brass.json").read_text() == "of somebody else"
    panels.click("save##closing")
    assert state.screen.closes and load_material(tmp_path / "brass.json").kd == (0.3, 0.3, 0.3)


def test_discarding_writes_nothing(panels, state, tmp_path, capsys):
    change(state)
    record(panels)
    ask(panels)
    panels.click("discard##closing")
    assert state.screen.closes
    panels.mode.close()
    assert list(tmp_path.iterdir()) == [] and "changes not saved: brass" in capsys.readouterr().err


def test_staying_goes_on(panels, state):
    change(state)
    for answer in (lambda: panels.click("stay##closing"), lambda: press(panels, "escape")):
        ask(panels)
        assert panels.popup_open, "the mouse is the question's"
        answer()
        panels.frame(2)
        assert not (state.screen.asks_to_close or state.screen.closes or panels.popup_open)
    assert panels.mode.unsaved == ("brass",)


def press(panels, key):
    from imgui_bundle import imgui

    for down in (True, False):
        panels.io.add_key_event(getattr(imgui.Key, key), down)
        panels.frame()


def test_enter_saves(panels, state, tmp_path):
    change(state)
    ask(panels)
    press(panels, "enter")
    assert state.screen.closes and (tmp_path / "brass.json").exists()


def test_answers_stay_where_they_are_when_a_message_goes(panels, state):
    change(state)
    state.screen.say("saved to " + "a/long/way/off/" * 20)
    ask(panels)
    before = dict(panels.rects)
    state.screen.messages.clear()
    panels.frame(3)
    assert all(panels.rects[f"{answer}##closing"] == before[f"{answer}##closing"] for answer in ("save", "discard"))


def test_it_fits_a_small_window(monkeypatch, state, geometry):
    driver = PanelDriver(monkeypatch, walk_mode(state, geometry), (320, 240))
    change(state)
    ask(driver)
    assert all(0 <= driver.rects[f"{a}##closing"][0] < driver.rects[f"{a}##closing"][2] <= 320
               for a in ("save", "discard", "stay"))  # fmt: skip
    driver.close()


def test_a_read_only_window_says_so_over_the_picture_and_above_the_panels(monkeypatch, panels, state):
    above, over = [], []
    monkeypatch.setattr(room, "wrapped", lambda lines: above.extend(lines))
    monkeypatch.setattr(overlay, "draw", lambda screen, lines, *_: over.extend(lines))
    state.session.fault = ""
    panels.frame()
    assert READ_ONLY not in (*above, *over)
    state.session.fault = READ_ONLY
    panels.frame()
    assert above == [READ_ONLY] and READ_ONLY in over


def test_a_session_that_is_kept_is_not_asked_about(panels, state):
    state.session.open()
    change(state)
    assert panels.mode.unsaved == ()
    panels.mode.close()
    assert read_session(state.store / FILE).now.materials["brass"].kd == (0.3, 0.3, 0.3)
