"""The editor's panels without a window: real Dear ImGui frames, a mouse that aims at controls."""

import time

import pytest

from lambent.viewer.mode import Drawing
from lambent.viewer.modes.material.mode import MaterialMode, MaterialState
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.panels.plots import labels_apart
from tests.viewer.editor.measured_specimens import BRASS, FROSTED, write_measurement
from tests.viewer.panel_driver import PanelDriver, walk_mode


@pytest.fixture
def state(tmp_path, screen):
    BRASS.save(tmp_path / "brass.json")
    measured = write_measurement(tmp_path / "brass.txt", BRASS)
    return MaterialState.of(measured, tmp_path / "brass.json", (), screen)


@pytest.fixture
def driver(monkeypatch, state):
    driver = PanelDriver(monkeypatch, MaterialMode(state, Drawing(None)))
    yield driver
    driver.close()


def tick(driver):
    driver.mode.advance(0.0)
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
    assert editor.subject.material.lobes[0].mx == editor.subject.material.lobes[0].my > 0.15, "the ratio is kept"
    driver.click("undo")
    assert editor.subject.material == BRASS
    driver.click("redo")
    driver.click("revert")
    assert editor.subject.material == BRASS and editor.subject.edits.can_undo


def test_fix_and_narrow(driver, state):
    driver.click("##fix r0")
    driver.click("##fix kd")
    driver.click("<>##narrow mx")
    restrictions = state.editor.subject.restrictions
    assert restrictions.fixed == {"r0", "kd"} and set(restrictions.ranges) == {"mx"}
    driver.frame()
    before = restrictions.ranges["mx"]
    driver.drag("sought##mx", 0.25, 0.4)
    assert restrictions.ranges["mx"] != before and restrictions.ranges["mx"][0] < restrictions.ranges["mx"][1]
    driver.click("##fix r0")
    driver.click("x##narrow mx")
    assert restrictions.fixed == {"kd"} and restrictions.ranges == {}


def test_the_diffuse_term_is_coupled(driver, state):
    driver.click("kd falls as Fresnel rises", 0.1)
    assert state.editor.subject.material.kd_coupled
    driver.click("undo")
    assert state.editor.subject.material == BRASS


def test_lobes(driver, state):
    driver.click("add transmission")
    tick(driver)
    assert [lobe.kind for lobe in state.editor.subject.material.lobes] == ["reflection", "transmission"]
    driver.click("remove")  # the last one drawn
    tick(driver)
    driver.click("add retro")
    tick(driver)
    assert [lobe.kind for lobe in state.editor.subject.material.lobes] == ["reflection", "retro"]
    driver.click("remove")
    tick(driver)
    assert state.editor.subject.material == BRASS


def test_names_paths_and_saving(driver, state, tmp_path):
    editor = state.editor
    driver.click("##open")
    driver.type("/no/such/file")
    driver.click("load##open")
    assert state.screen.messages[-1].text.startswith("not loaded") and editor.measurement is not None
    driver.click("name", 0.9)
    driver.type("y")
    assert editor.subject.material.name == "brassy"
    driver.click("save##file")
    assert state.screen.messages[-1].text.startswith("saved") and '"brassy"' in (tmp_path / "brass.json").read_text()


def test_labels_of_the_p_axis_do_not_overlap():
    ticks = [0.0, 0.001, 0.01, 0.1, 1.0]
    assert labels_apart(ticks, 0.05) == ["0", "0.001", "0.01", "0.1", "1"]
    assert labels_apart(ticks, 0.15) == ["0", "", "0.01", "0.1", "1"]
    assert labels_apart(ticks, 0.3) == ["0", "", "", "0.1", "1"]


def test_a_loaded_document_fits_the_axes(driver, state, tmp_path):
    """Else the curves of a dull material fill the lowest tenth of the plot of a shiny one."""
    state.editor.show_measurement(None)
    tick(driver)
    assert not state.editor.plots.fit_axes
    BRASS.model_copy(update={"lobes": (), "kd": (0.1, 0.1, 0.1)}).save(tmp_path / "dull.json")
    state.editor.files.open(str(tmp_path / "dull.json"))
    state.editor.tick()
    assert state.editor.plots.fit_axes
    driver.frame(2)
    assert not state.editor.plots.fit_axes


def test_the_plane_nearest_to_45_degrees_is_shown_first(driver, state):
    editor = state.editor
    tick(driver)
    assert editor.shown.incidents[editor.plots.chosen].theta_deg == 45
    editor.plots.choose(0)
    tick(driver)
    assert editor.shown.albedos["measured", False][0].tolist() == [0, 20, 45, 65]


def test_fit_from_the_panel(driver, state):
    editor = state.editor
    tick(driver)
    driver.click("fit from here")
    assert editor.fit.work is not None
    while editor.fit.work is not None:
        tick(driver)
        time.sleep(0.01)
    assert editor.subject.edits.can_undo and state.screen.messages[-1].text.startswith("fitted")


def test_a_second_document(monkeypatch, tmp_path, screen):
    for material in (BRASS, FROSTED):
        material.save(tmp_path / f"{material.name}.json")
    state = MaterialState.of(tmp_path / "brass.json", tmp_path / "frosted.json", (), screen)
    driver = PanelDriver(monkeypatch, MaterialMode(state, Drawing(None)))
    tick(driver)
    assert {"A", "B"} == set(state.editor.shown.images)
    driver.click("copy B")
    tick(driver)
    assert state.editor.subject.material.kt_d == FROSTED.kt_d and state.editor.subject.material.name == "brass"
    driver.close()


def test_from_the_walk_mode(monkeypatch, scene, screen, geometry, tmp_path):
    """The same editor on the selected object's material, with the room's own undo."""
    state = WalkState.of(scene, "walk", screen)
    materials = state.materials
    state.selection.choose("table")
    materials.typed_measurement = str(write_measurement(tmp_path / "brass.txt", BRASS))
    driver = PanelDriver(monkeypatch, walk_mode(state, geometry))
    driver.click("compare##measurement")
    editor = materials.editor
    while editor.measurement is None:
        tick(driver)
        time.sleep(0.01)
    tick(driver)
    driver.drag("mx", 0.5, 0.8)
    assert materials.edits.current("brass") == editor.subject.material != scene.materials["brass"]
    materials.edits.undo()
    assert editor.subject.material == scene.materials["brass"]
    driver.frame()
    driver.click("close##editor")
    tick(driver)
    assert materials.editor is None
    driver.frame()
    driver.click("compare##measurement")
    assert materials.editor is not editor, "the door is there again"
    driver.close()


def test_sliders_are_in_reach_without_scrolling(monkeypatch, state):
    """Two lobes in a window of 1280 x 960, with their error, the fit, and the preview's exposure."""
    state.editor.subject.add_lobe("reflection")
    driver = PanelDriver(monkeypatch, MaterialMode(state, Drawing(None)), (1280, 960))
    tick(driver)
    bottoms = {label: driver.rects[label][3] for label in ("alpha", "add retro", "fit from here", "exposure##preview")}
    driver.close()
    assert max(bottoms.values()) <= 960
