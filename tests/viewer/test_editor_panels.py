"""The editor's panels without a window: real Dear ImGui frames, a mouse that aims at controls."""

import time

import pytest

from lambent.viewer.edit import editor_state
from lambent.viewer.state import ViewerState
from tests.viewer.measured_specimens import BRASS, FROSTED, write_measurement
from tests.viewer.panel_driver import PanelDriver


@pytest.fixture
def state(tmp_path):
    BRASS.save(tmp_path / "brass.json")
    return editor_state(write_measurement(tmp_path / "brass.txt", BRASS), tmp_path / "brass.json", folder=tmp_path)


@pytest.fixture
def driver(monkeypatch, state):
    driver = PanelDriver(monkeypatch, state)
    yield driver
    driver.close()


def tick(driver):
    driver.state.editor.tick()
    driver.frame(2)


def test_a_drag_changes_the_error_at_once_and_is_one_step(driver, state):
    editor = state.editor
    tick(driver)
    error = editor.shown.error
    driver.move(*driver.point("mx", 0.5))
    driver.button(True)
    for along in (0.6, 0.7, 0.8):
        driver.move(*driver.point("mx", along))
        tick(driver)
        assert editor.shown.error > error
        error = editor.shown.error
    driver.button(False)
    driver.frame(2)
    assert editor.material.lobes[0].mx == editor.material.lobes[0].my > 0.15, "the ratio is kept"
    driver.click("undo")
    assert editor.material == BRASS
    driver.click("redo")
    driver.click("revert")
    assert editor.material == BRASS and editor.edits.can_undo


def test_fix_and_narrow(driver, state):
    driver.click("##fix r0")
    driver.click("##fix kd")
    driver.click("<>##narrow mx")
    restrictions = state.editor.restrictions
    assert restrictions.fixed == {"r0", "kd"} and set(restrictions.ranges) == {"mx"}
    driver.frame()
    before = restrictions.ranges["mx"]
    driver.drag("sought##mx", 0.25, 0.4)
    assert restrictions.ranges["mx"] != before and restrictions.ranges["mx"][0] < restrictions.ranges["mx"][1]
    driver.click("##fix r0")
    driver.click("x##narrow mx")
    assert restrictions.fixed == {"kd"} and restrictions.ranges == {}


def test_the_diffuse_term_is_coupled(driver, state):
    driver.click("kd falls off as Fresnel rises", 0.1)
    assert state.editor.material.kd_coupled
    driver.click("undo")
    assert state.editor.material == BRASS


def test_lobes(driver, state):
    driver.click("add transmission lobe")
    tick(driver)
    assert [lobe.side for lobe in state.editor.material.lobes] == ["reflection", "transmission"]
    driver.click("remove")  # the last one drawn
    tick(driver)
    assert state.editor.material == BRASS


def test_names_paths_and_saving(driver, state, tmp_path):
    editor = state.editor
    driver.click("##open")
    driver.type("/no/such/file")
    driver.click("load##open")
    assert state.messages[-1].text.startswith("not loaded") and editor.measurement is not None
    driver.click("name", 0.9)
    driver.type("y")
    assert editor.material.name == "brassy"
    driver.click("save##file")
    assert state.messages[-1].text.startswith("saved") and '"brassy"' in (tmp_path / "brass.json").read_text()


def test_a_click_on_a_disk_chooses_it(driver, state):
    editor = state.editor
    tick(driver)
    driver.frame(1)
    assert editor.shown.incidents[editor.chosen].theta_deg == 45
    editor.choose(0)
    tick(driver)
    assert editor.shown.measured_albedo[False][0].tolist() == [0, 20, 45, 65]


def test_fit_from_the_panel(driver, state):
    editor = state.editor
    tick(driver)
    driver.click("fit from here")
    assert editor.fitting is not None
    while editor.fitting is not None:
        tick(driver)
        time.sleep(0.01)
    assert editor.edits.can_undo and state.messages[-1].text.startswith("fitted")


def test_a_second_document_and_the_divider(monkeypatch, tmp_path):
    for material in (BRASS, FROSTED):
        material.save(tmp_path / f"{material.name}.json")
    state = editor_state(tmp_path / "brass.json", tmp_path / "frosted.json", folder=tmp_path)
    driver = PanelDriver(monkeypatch, state)
    tick(driver)
    assert {"A", "B"} == set(state.editor.shown.images)
    driver.click("take B's numbers")
    tick(driver)
    assert state.editor.material.kt_d == FROSTED.kt_d and state.editor.material.name == "brass"
    driver.close()


def test_from_the_walk_window(monkeypatch, scene, choices, tmp_path):
    """The same editor on the selected object's material, with the room's own undo."""
    state = ViewerState.of(scene, choices, "walk", folder=tmp_path)
    state.select("table")
    state.typed_measurement = str(write_measurement(tmp_path / "brass.txt", BRASS))
    driver = PanelDriver(monkeypatch, state)
    driver.click("compare##measurement")
    editor = state.editor
    while editor.measurement is None:
        tick(driver)
        time.sleep(0.01)
    tick(driver)
    driver.drag("mx", 0.5, 0.8)
    assert state.edits.current("brass") == editor.material != scene.materials["brass"]
    state.edits.undo()
    assert editor.material == scene.materials["brass"]
    driver.frame()
    driver.click("close##editor")
    editor.tick()
    assert state.editor is None
    driver.frame()
    driver.click("compare##measurement")
    assert state.editor is not editor, "the door is there again"
    driver.close()
