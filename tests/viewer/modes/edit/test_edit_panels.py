"""Panels, mouse and keys of editing in place, in real Dear ImGui frames without a window."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lambent.baking.interreflection.proposal import Proposal, Row
from lambent.viewer.mode import Drawing
from lambent.viewer.modes.edit.mode import EditMode
from lambent.viewer.modes.edit.state import DIRECT
from lambent.viewer.screen import Rect
from tests.viewer.edited_view import LIGHTS, lit_state, tint, until
from tests.viewer.panel_driver import PanelDriver


@pytest.fixture
def driver(monkeypatch, screen, tmp_path):
    state = lit_state(monkeypatch, screen, tmp_path)
    driver = PanelDriver(monkeypatch, EditMode(state, Drawing(None)))
    yield driver
    driver.close()
    state.close()


def key(driver, name, *modifiers):
    event = {"event_type": "key_down", "key": name, "modifiers": modifiers}
    driver.mode.input.handle(event, ui_has_mouse=False, ui_has_keys=False)


def mouse(driver, kind, x, y):
    place = driver.state.screen.picture
    event = {"event_type": kind, "x": place.x + x * place.width, "y": place.y + y * place.height, "button": 1}
    driver.mode.input.handle(event, ui_has_mouse=False, ui_has_keys=False)


def is_edited(state):
    one = state.session.material("tray")
    return one.now != one.start


def test_clicks_select_and_the_name_follows_the_mouse(driver):
    state = driver.state
    mouse(driver, "pointer_move", 0.05, 0.55)
    assert state.pointed == ("back", "wall")
    mouse(driver, "pointer_down", 0.05, 0.55)
    mouse(driver, "pointer_up", 0.05, 0.55)
    assert state.material == "wall" and state.selection_is_new
    mouse(driver, "pointer_down", 0.05, 0.05)
    mouse(driver, "pointer_up", 0.05, 0.05)
    assert state.material == "wall", "nothing is there"
    key(driver, "Tab")
    assert state.material == "tray"
    driver.mode.input.handle({"event_type": "pointer_leave"}, ui_has_mouse=False, ui_has_keys=False)
    assert state.pointed is None
    driver.mode.input.handle(
        {"event_type": "wheel", "x": 50, "y": 50, "dx": 0, "dy": 100, "modifiers": ()},
        ui_has_mouse=False,
        ui_has_keys=False,
    )
    driver.frame()


def test_keys_undo_redo_and_save(driver):
    state = driver.state
    tint(state.session, "tray", 2.0)
    key(driver, "z", "Control")
    assert not is_edited(state)
    key(driver, "z", "Control", "Shift")
    assert is_edited(state)
    key(driver, "s", "Control")
    assert state.files.home is not None and state.files.home.exists()
    key(driver, "p")
    assert state.screen.save_wanted


def test_the_buttons_of_the_column(driver):
    state = driver.state
    tint(state.session, "tray", 2.0)
    driver.frame()
    driver.click("undo")
    assert not is_edited(state)
    driver.click("redo")
    assert is_edited(state)
    driver.click("reset material")
    assert not is_edited(state)
    state.tick()
    driver.click("snapshot")
    assert state.compared.chosen == "snapshot 1"
    driver.click("one pixel of the picture is one of the screen")
    assert state.pixel_exact
    driver.click("save session")
    assert state.files.home is not None
    driver.click("save material")
    assert (state.screen.folder / "tray-001.json").is_file()


def test_the_picture_keeps_its_shape(driver):
    from lambent.viewer.modes.edit.drawing import EditDrawing

    drawing = EditDrawing.__new__(EditDrawing)  # without a device
    drawing._fitted, drawing._ratio = driver.state, 2.0
    assert drawing.within(Rect(0, 0, 80, 80)) == Rect(0, 10, 80, 60)
    assert drawing.within(Rect(10, 0, 160, 60)) == Rect(50, 0, 80, 60)
    driver.state.pixel_exact = True
    assert drawing.within(Rect(0, 0, 80, 80)) == Rect(38, 38, 4, 3), "two pixels of the screen are one of the window"


def test_the_panel_of_interreflections(driver):
    state, bounced = driver.state, driver.state.bounced
    until(state, lambda: state.painter.frame is not None and bounced.is_measuring)
    driver.click("Interreflections")
    assert "bake" in driver.rects and "tray##edited" not in driver.rects
    asked = state._bake.asked
    rows = (Row("tray", "edited", 17, 0.4, 0.5), Row("wall", "fixed", 21, 0.6, 0.5))
    asked[0].proposal = Proposal(replace(asked[0].bounces, fixed=frozenset({"wall"})), rows, {}, {}, 10, 20)
    asked[0].running = False
    until(state, lambda: bounced.is_measured)
    driver.frame(2)
    driver.click("wall##edited")
    assert bounced.fixed == frozenset() and not bounced.is_measured
    driver.click("tray##edited")
    assert bounced.fixed == {"tray"}
    driver.frame(2)
    driver.click("bake")
    until(state, lambda: bounced.baking is not None)
    assert state._bake.begun[-1].bounces.fixed == {"tray"} and bounced.line
    driver.frame()
    driver.click("tray##edited")
    assert bounced.fixed == {"tray"}, "not while it is baked"
    driver.click("stop")
    assert bounced.baking is None and state._bake.begun[-1].closed


def test_materials_that_look_the_same_are_merged_from_the_panel(driver):
    state, bounced = driver.state, driver.state.bounced
    until(state, lambda: state.painter.frame is not None and bounced.is_measuring)
    driver.click("Interreflections")
    rows = tuple(Row(name, "edited", 20, 0.5, 0.5) for name in ("tray", "wall"))
    asked = state._bake.asked
    asked[0].proposal, asked[0].running = Proposal(asked[0].bounces, rows, {}, {"wall": "tray"}, 10, 20), False
    until(state, lambda: bounced.is_measured)
    driver.frame(2)
    assert "merge##tray" not in driver.rects
    assert driver.rects["merge##wall"][2] <= driver.rects["Interreflections"][2], "not cut off"
    driver.click("merge##wall")
    assert state.session.document.merged == {"wall": "tray"}
    until(state, lambda: len(state._bake.begun) == 2)
    driver.frame(2)
    assert "wall##edited" not in driver.rects, "measured anew first"
    for lights in LIGHTS:
        state._bake.begun[1].arrive(lights)
        until(state, lambda: not state._bake.begun[1].arrived and not state.loading.busy)
    until(state, lambda: len(asked) == 2 and bounced.is_measuring)
    assert set(asked[1].session.document.materials) == {"tray"}


def test_the_panel_shows_the_difference_to_a(driver):
    state = driver.state
    driver.click("difference")
    assert not state.is_difference, "there is no A"
    state.compared.chosen = DIRECT
    driver.frame()
    driver.click("difference")
    assert state.is_difference
    until(state, lambda: state.scale is not None)
    driver.frame()
    driver.click("fit scale")
    assert state.scale is None
    until(state, lambda: state.scale is not None)


def test_sliders_and_curves_are_in_reach_without_scrolling(monkeypatch, screen, tmp_path):
    """In a window of 1280 x 960 as it opens."""
    state = lit_state(monkeypatch, screen, tmp_path)
    state.select("tray")
    driver = PanelDriver(monkeypatch, EditMode(state, Drawing(None)), (1280, 960))
    driver.frame(3)
    bottoms = {label: driver.rects[label][3] for label in ("smooth", "roughness", "undo", "exposure")}
    driver.close()
    state.close()
    assert max(bottoms.values()) <= 960


def test_a_slider_drag_is_one_step(driver):
    state = driver.state
    driver.click("Numbers")
    driver.frame(2)
    x0, y0, x1, y1, _ = driver.rects["mx"]
    driver.move(x0 + 0.3 * (x1 - x0), (y0 + y1) / 2)
    driver.button(True)
    for share in (0.4, 0.5, 0.6):
        driver.move(x0 + share * (x1 - x0), (y0 + y1) / 2)
    driver.button(False)
    driver.frame(2)
    assert is_edited(state)
    state.session.undo()
    assert not is_edited(state) and not state.session.history.can_undo
