"""The Curves panel, driven by its controls: nodes are pulled, curves smoothed, copied and put back."""

import numpy as np
import pytest

from lambent.editing.curves.nodes import Which, values_of
from lambent.materials.document import Lobe, Material
from lambent.materials.lobes import widths
from tests.viewer import waiting
from tests.viewer.editor.measured_specimens import write_measurement
from tests.viewer.panel_driver import PanelDriver, walk_mode

SHAPE, FRESNEL, DIFFUSE = Which("shape"), Which("fresnel"), Which("diffuse")


@pytest.fixture
def driver(monkeypatch, state, geometry):
    """The panel of the brass object, opened."""
    state.selection.choose(next(item.name for item in state.selection.objects if item.material == "brass"))
    driver = PanelDriver(monkeypatch, walk_mode(state, geometry))
    driver.click("Curves")
    driver.frame(2)
    yield driver
    driver.close()


def plot(driver, across, up):
    """A point of the plot, between the choice of the tool above it and the buttons below."""
    x0, _, x1, y0, _ = driver.rects["tool"]
    y1 = driver.rects["smooth"][1]
    return x0 + across * (x1 - x0), y1 - up * (y1 - y0)


def pull(driver, begin, end):
    driver.move(*plot(driver, *begin))
    driver.button(True)
    driver.move(*plot(driver, *end))
    driver.frame()
    driver.button(False)
    driver.frame(2)


def test_a_node_is_pulled_and_one_undo_takes_it_back(driver, state):
    edits = state.materials.edits
    before = values_of(edits.current("brass"), SHAPE)
    pull(driver, (0.5, 0.5), (0.5, 0.8))
    after = values_of(edits.current("brass"), SHAPE)
    changed = np.flatnonzero(np.abs(after / before - 1).ravel() > 1e-3)
    assert len(changed) == 1 and edits.current("brass").version == 2
    edits.undo()
    assert edits.current("brass") == edits.scene["brass"] and not edits.can_undo


def test_drawing_sets_every_node_that_the_mouse_passes(driver, state):
    panel = next(panel for panel in driver.mode.panels if panel.title == "Curves").draw.__self__
    panel.tool = "draw"
    before = values_of(state.materials.edits.current("brass"), SHAPE)
    driver.move(*plot(driver, 0.3, 0.6))
    driver.button(True)
    for across in np.linspace(0.3, 0.6, 40):
        driver.move(*plot(driver, across, 0.6))
    driver.button(False)
    after = values_of(state.materials.edits.current("brass"), SHAPE)
    drawn = np.flatnonzero(np.abs(after / before - 1).ravel() > 1e-3)
    assert len(drawn) >= 6 and (np.diff(drawn) == 1).all()
    assert np.ptp(np.log(after[drawn[1:-1]])) < 0.3


def test_curves_are_smoothed_and_put_back(driver, state):
    edits = state.materials.edits
    pull(driver, (0.5, 0.5), (0.5, 0.9))
    bumpy = np.abs(np.diff(np.log(values_of(edits.current("brass"), SHAPE)[:, 0]), 2)).max()
    driver.click("smooth")
    assert np.abs(np.diff(np.log(values_of(edits.current("brass"), SHAPE)[:, 0]), 2)).max() < bumpy
    driver.click("reset curve")
    assert edits.current("brass") == edits.scene["brass"]


@pytest.mark.long
def test_a_curve_is_copied_from_a_measurement(driver, state, tmp_path):
    rough = Material(name="rough", kd=0.05, lobes=(Lobe(mx=0.3, my=0.3, k=(0.9, 0.8, 0.5), r0=0.6),))
    write_measurement(tmp_path / "rough.txt", rough)
    edits, panel = state.materials.edits, driver.mode.panels[1].draw.__self__
    before = edits.current("brass")
    panel.typed = str(tmp_path / "rough.txt")
    driver.click("copy##curve of")
    assert driver.mode.fitting.busy and driver.mode.wait_s() is not None
    waiting.until(lambda: not driver.mode.fitting.busy, driver.mode.fitting.poll)
    (lobe,) = edits.current("brass").lobes
    assert widths(lobe)[0] == pytest.approx(0.3, rel=0.15) and edits.current("brass").kd == before.kd
    edits.undo()
    assert edits.current("brass") == before
    panel.typed = str(tmp_path / "none.txt")
    driver.click("copy##curve of")
    waiting.until(lambda: not driver.mode.fitting.busy, driver.mode.fitting.poll)
    assert "none.txt" in state.screen.messages[-1].text


def test_nothing_can_be_pulled_without_an_object(driver, state):
    state.selection.choose(None)
    driver.frame(2)
    assert "smooth" not in driver.rects
