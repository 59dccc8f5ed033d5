"""Every control says in a sentence what it does, while the mouse rests on it: all panels of all modes are walked."""

from dataclasses import replace

import pytest
from imgui_bundle import imgui

from lambent.baking.interreflection.proposal import Proposal, Row
from lambent.core.views.camera import Camera
from lambent.materials.document import KINDS
from lambent.store.contract import ReflectorPart, ReflectorRecord
from lambent.store.light_groups import LightGroupRecord
from lambent.viewer.mode import Drawing
from lambent.viewer.modes.edit.mode import EditMode
from lambent.viewer.modes.edit.state import DIRECT
from lambent.viewer.modes.material.mode import MaterialMode, MaterialState
from lambent.viewer.modes.walk.comparison import Figures
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.panels.widgets import press
from tests.viewer import panel_driver
from tests.viewer.edited_view import lit_state, until
from tests.viewer.editor.measured_specimens import BRASS, write_measurement
from tests.viewer.panel_driver import PanelDriver, walk_mode

MORE = ("input_float2", "drag_float", "invisible_button", "tree_node", "color_edit3", "input_int", "slider_angle")
NOT_CONTROLS = ("##plot",)  # the plot of a curve: its keys are those of "?"
TALL = (1500, 3200)


class Every(dict):
    """Controls of a frame by label, also those that share one."""

    def __setitem__(self, label, rect):
        number = 1
        while (key := label if number == 1 else f"{label} #{number}") in self:
            number += 1
        super().__setitem__(key, rect)


class Walked(PanelDriver):
    """All panels of a mode unfolded, and the tooltip under the mouse."""

    def __init__(self, monkeypatch, mode):
        monkeypatch.setattr(panel_driver, "RECORDED", (*panel_driver.RECORDED, *MORE))
        mode.panels = [replace(panel, opened=True) for panel in mode.panels]
        self.said = []
        shown = imgui.set_tooltip
        monkeypatch.setattr(imgui, "set_tooltip", lambda text: (self.said.append(text), shown(text)))
        super().__init__(monkeypatch, mode, TALL)
        style = imgui.get_style()
        style.hover_stationary_delay = style.hover_delay_short = style.hover_delay_normal = 0.0

    def new_rects(self):
        return Every()

    def tooltip(self, label):
        self.move(*self.point(label, 0.3))
        self.frame(2)
        self.said.clear()
        self.frame()
        return self.said[-1] if self.said else ""


def check(driver, seen):
    """Rest on every control that this state of the panels shows and that was not yet seen."""
    driver.frame(2)
    new = [label for label in driver.rects if label not in seen and label not in NOT_CONTROLS]
    said = {label: driver.tooltip(label) for label in new}
    seen.update(said)
    faults = {label: text for label, text in said.items() if not is_sentence(text)}
    assert faults == {}
    driver.move(-1, -1)


def is_sentence(text):
    first = text.splitlines()[0] if text else ""
    return len(first.split()) >= 3 and ". " not in text and not text.endswith(".")


@pytest.fixture
def walk(monkeypatch, scene, screen, geometry):
    part = ReflectorPart(object="table", faces=(0, 1), area_m2=4.0)
    plane = ReflectorRecord(plane=(0, 1, 0, -1), outline=((-1, 1, -1), (1, 1, -1), (1, 1, 1)), parts=(part,))
    scene = scene.model_copy(update={"reflectors": (plane,), "warnings": ("a", "b", "c", "d")})
    state = WalkState.of(scene, "walk", screen, screen.folder)
    driver = Walked(monkeypatch, walk_mode(state, geometry))
    yield driver
    driver.close()


def test_the_walk_mode(walk):
    state, seen = walk.state, {}
    check(walk, seen)
    state.selection.choose("table")
    state.look.near_m, state.look.n, state.look.view_transform = 0.1, 3, "false-colour"
    state.comparison.mode, state.comparison.figures = "error map", Figures(33.3, 1.2, (0, 64))
    check(walk, seen)
    state.materials.edits.store("evening")
    state.lights.groups = (LightGroupRecord(name="lamp", members=("bulb",), share=1.0),)
    state.navigation.scrub(state.scene.paths[0], 1.0)
    state.recordings.set_key()
    state.answering.possible = state.rebaking.possible = True
    state.rebaking.line = "baking again"
    check(walk, seen)
    state.recordings.save_view()
    check(walk, seen)
    state.recordings.views.renaming = ("camera", state.navigation.camera.name)
    check(walk, seen)
    state.recordings.views.renaming = None
    state.recordings.record()
    check(walk, seen)
    for k in range(10):
        state.recordings.recorder.take(Camera("free", (0.1 * k, 1.6, 3.0), (0, 1, 0)), 0.1 * k)
    state.recordings.record()
    check(walk, seen)
    state.recordings.save()
    check(walk, seen)
    state.films.under_way = FilmUnderWay()
    check(walk, seen)
    state.screen.asks_to_close = True
    state.materials.edits.change("brass", state.scene.materials["plaster"])
    check(walk, seen)
    wanted = {"cancel the film", "mx", "rename##new camera name", "smooth", "save##closing", "planes", "delete##path"}
    wanted |= {"light follows", "bake edits", "apply##as baked", "x##evening", "set keys", "1.0 s##key"}
    assert wanted <= set(seen) and len(seen) > 80


class FilmUnderWay:
    done, total, left_s = 3, 10, 12.0

    class file:
        name = "tour.mp4"


@pytest.mark.long
def test_the_editor(monkeypatch, screen, tmp_path):
    BRASS.save(tmp_path / "brass.json")
    measured = write_measurement(tmp_path / "brass.txt", BRASS)
    state, seen = MaterialState.of(measured, tmp_path / "brass.json", (), screen), {}
    driver, editor = Walked(monkeypatch, MaterialMode(state, Drawing(None))), state.editor
    driver.mode.advance(0.0)
    check(driver, seen)
    for kind in KINDS:
        editor.subject.add_lobe(kind)
    editor.subject.restrictions.narrow("mx", (0.1, 0.2))
    editor.subject.reference = "a document"
    check(driver, seen)
    editor.subject.compare_with(BRASS)
    state.look.view_transform, editor.fit.work = "false-colour", FitUnderWay()
    editor.leave = lambda: None
    check(driver, seen)
    driver.close()
    assert {"stop, keep the best", "sought##mx", "copy B", "close##editor", "##axis"} <= set(seen)


class FitUnderWay:
    share, what, cancelling = 0.3, "fitting", False


def test_editing_in_place(monkeypatch, screen, tmp_path):
    state = lit_state(monkeypatch, screen, tmp_path)
    driver, seen = Walked(monkeypatch, EditMode(state, Drawing(None))), {}
    check(driver, seen)
    bounced = state.bounced
    until(state, lambda: bounced.is_measuring)
    asked, rows = state._bake.asked[0], (Row("tray", "edited", 17, 0.4, 0.5), Row("wall", "fixed", 21, 0.6, 0.5))
    asked.proposal, asked.running = (
        Proposal(replace(asked.bounces, fixed=frozenset({"wall"})), rows, {}, {}, 9, 9),
        False,
    )
    until(state, lambda: bounced.is_measured)
    state.compared.chosen, state.compared.is_difference = DIRECT, True
    state.look.view_transform = "false-colour"
    state.select("tray")
    check(driver, seen)
    driver.close()
    state.close()
    assert {"tray##edited", "fit scale", "snapshot", "save material", "smooth", "curve", "mx"} <= set(seen)


def test_a_tooltip_covers_no_line_of_the_panel(monkeypatch):
    """It ends where the panel begins, and is where Dear ImGui puts it where there is no room for that."""
    places = []

    class Panel(panel_driver.Frames):
        left = 700.0

        def draw(self):
            imgui.set_next_window_pos((self.left, 10))
            imgui.begin("panel")
            press("first", "what the first one does")
            press("second", "what the second one does")
            imgui.end()

    monkeypatch.setattr(imgui, "set_next_window_pos", watched(imgui.set_next_window_pos, places))
    panel = Panel(monkeypatch, (1000, 400))
    style = imgui.get_style()
    style.hover_stationary_delay = style.hover_delay_short = style.hover_delay_normal = 0.0
    panel.move(*panel.point("first"))
    panel.frame(3)
    left, top = panel.rects["first"][0:2]
    (x, y), options = places[-1]
    assert options == {"pivot": (1, 0)} and x < Panel.left <= left and abs(y - top) < 1
    Panel.left = 5.0
    panel.frame(2)
    panel.move(*panel.point("first"))
    panel.frame(3)
    assert places[-1][1] == {}  # that of the panel itself
    panel.close()


def watched(call, places):
    def wrapped(at, *args, **options):
        places.append((at, options))
        return call(at, *args, **options)

    return wrapped
