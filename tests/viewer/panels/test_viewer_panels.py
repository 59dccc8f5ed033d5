"""Every control of the panels does what it says to the state."""

import numpy as np
import pytest
from imgui_bundle import imgui
from PIL import Image

from lambent.core.light.false_colour import Range
from lambent.materials.document import Lobe
from lambent.scenes.scene import ImageTexture
from lambent.store.contract import ReflectorPart, ReflectorRecord
from lambent.store.kept.views import read_views
from lambent.viewer import layout
from lambent.viewer.look import SAMPLE_COUNTS
from lambent.viewer.modes.walk.comparison import Figures
from lambent.viewer.modes.walk.light.metering import read
from lambent.viewer.modes.walk.markers import Ball
from lambent.viewer.modes.walk.state import WalkState
from tests.viewer.panel_driver import PanelDriver, walk_mode


@pytest.fixture
def panels(monkeypatch, state, geometry):
    driver = PanelDriver(monkeypatch, walk_mode(state, geometry))
    unfold(driver, "Drawing", "Camera")
    yield driver
    driver.close()


def unfold(driver, *headers):
    for header in headers:
        driver.click(header, 0.3)
    driver.frame(2)


def test_movement_and_cameras(panels, state):
    panels.click("orbit", 0.1)
    assert state.navigation.movement == "orbit"
    panels.click("walk", 0.1)
    panels.click("fly", 0.1)
    assert (state.navigation.movement, state.navigation.flying) == ("walk", True)
    panels.click("2  side##1", 0.1)
    assert state.navigation.camera == state.scene.cameras[1]


def test_the_texture_of_a_material(panels, state, tmp_path):
    Image.fromarray(np.full((4, 4, 3), (0, 255, 0), np.uint8)).save(tmp_path / "grass.png")
    panels.mode.drop(str(tmp_path / "grass.png"))
    assert "select one first" in state.screen.messages[-1].text
    state.selection.choose("table")
    panels.frame()
    panels.mode.drop(str(tmp_path / "grass.png"))
    assert isinstance(state.materials.edits.room.textures["brass"], ImageTexture)
    kd = state.materials.edits.current("brass").kd
    assert kd[0] == kd[2] == 0 and kd[1] > 0.5, "the mean of the image, as far as the lobe leaves light"
    panels.frame()
    panels.drag("repeat", 0.5, 0.7)
    assert state.materials.edits.room.textures["brass"].repeat > 1
    panels.click("undo")
    panels.click("undo")
    assert state.materials.edits.room.textures == {} and state.materials.edits.edited == {}
    state.texturing.without_uv = {"brass"}
    panels.frame()
    assert "texture" not in panels.rects and "##image" not in panels.rects, "a line says that it has no uv"


@pytest.mark.parametrize("exact", [True, False])
def test_baked_light_is_not_called_an_estimate(panels, state, monkeypatch, exact):
    state.answering.possible = state.rebaking.possible = state.rebaking.said = True
    state.answering.likely_error, state.rebaking.exact = 0.024, exact
    state.rebaking.line = "exact: baked again" if exact else "exact except the light field of teapot"
    drawn = []
    monkeypatch.setattr(imgui, "text_disabled", drawn.append)
    panels.frame()
    assert state.rebaking.line in drawn and not any("estimated" in text for text in drawn)


@pytest.mark.parametrize("size", [(640, 480), (1680, 1050)])
def test_the_line_on_a_bake_is_shown_whole(monkeypatch, state, geometry, size):
    line = "baking again 1:10 (first bake 3:20): light map, gathered 40 %; new light on 12 of 33 objects"
    state.answering.possible = state.rebaking.possible = True
    state.rebaking.line = line
    drawn = {}

    def noted(text):
        text_disabled(text)
        drawn[text] = imgui.get_item_rect_max()

    text_disabled = imgui.text_disabled
    monkeypatch.setattr(imgui, "text_disabled", noted)
    panels = PanelDriver(monkeypatch, walk_mode(state, geometry), size)
    places = dict(panels.rects)
    assert drawn[line].x <= size[0] and drawn[line].y <= places["Material"][1]
    state.rebaking.line = f"not baked again: {'a long path/' * 40}: cannot be opened"
    panels.frame()
    (cut,) = (text for text in drawn if text.startswith("not baked again"))
    assert cut.endswith("...") and drawn[cut].x <= size[0] and panels.rects == places
    panels.close()


def test_a_click_at_the_shown_time_goes_to_the_path(panels, state):
    """Its keys of light are set where the camera stands on it."""
    assert state.navigation.path is None
    panels.click("##time", 0.01)
    assert state.navigation.path is not None and state.navigation.path.time_s == 0.0


def test_a_camera_path_plays_pauses_and_is_scrubbed(panels, state):
    panels.click("play")
    assert state.navigation.path.playing
    panels.click("pause")
    assert not state.navigation.path.playing
    panels.drag("##time", 0.05, 0.5)
    assert state.navigation.path.time_s == pytest.approx(2, abs=0.2) and not state.navigation.path.playing


def test_view(panels, state):
    panels.drag("exposure", 0.5, 0.75)
    assert state.look.exposure_ev == pytest.approx(6, abs=0.5)
    for label, field in (("transform", "view_transform"), ("show", "show"), ("integrator", "integrator")):
        before = getattr(state.look, field)
        panels.click(label)
        assert panels.popup_open
        x, y = panels.point(label)
        panels.move(x, y + 45)  # the second entry of the list
        panels.button(True)
        panels.button(False)
        panels.frame()
        assert getattr(state.look, field) != before, label
    panels.click("trace while nothing moves", 0.1)
    panels.click("fewer pixels in motion where needed", 0.1)
    assert not state.screen.pace.traces and not state.screen.pace.adaptive


def test_samples(panels, state):
    panels.drag("samples", 0.1, 0.9)
    assert state.look.n is None  # greyed out while automatic
    panels.click("samples from roughness", 0.05)
    assert state.look.n == SAMPLE_COUNTS[len(SAMPLE_COUNTS) // 2]
    panels.drag("samples", 0.6, 0.99)
    assert state.look.n == SAMPLE_COUNTS[-1]
    panels.click("samples from roughness", 0.05)
    assert state.look.n is None


def test_material_sliders(panels, state):
    state.selection.choose("table")
    assert state.selection.name == "table"
    panels.frame()
    before = state.materials.edits.current("brass").lobes[0]
    panels.drag("mx", 0.5, 0.7)
    lobe = state.materials.edits.current("brass").lobes[0]
    assert lobe.mx > before.mx
    assert lobe.my / lobe.mx == pytest.approx(before.my / before.mx, rel=1e-4)
    panels.click("keep the ratio of mx and my", 0.05)
    panels.drag("my", 0.5, 0.4)
    assert state.materials.edits.current("brass").lobes[0].my < lobe.my
    assert state.materials.edits.current("brass").lobes[0].mx == lobe.mx
    panels.drag("alpha", 0.1, 0.6)
    assert state.materials.edits.current("brass").lobes[0].alpha == pytest.approx(0.6, abs=0.05)
    panels.drag("##values", 0.1, 0.2)
    for _ in range(4):
        panels.click("undo")
    assert state.materials.edits.edited == {}
    panels.click("redo")
    assert state.materials.edits.current("brass").lobes[0] == lobe
    panels.click("reset")
    assert state.materials.edits.edited == {}


def test_the_colour_picker_edits_linear_coefficients(panels, state):
    state.selection.name = "floor"
    panels.frame()
    panels.click("##swatch")
    assert panels.popup_open
    panels.frame(2)
    x, y = panels.point("##swatch")
    panels.move(x - 40, y + 60)
    panels.button(True)
    panels.button(False)
    panels.frame()
    kd = state.materials.edits.current("plaster").kd
    assert kd != (0.6, 0.6, 0.6) and all(0 <= v <= 1 for v in kd)


def test_a_message_does_not_end_a_drag(panels, state):
    state.selection.name = "table"
    panels.frame(2)
    panels.move(*panels.point("mx", 0.4))
    panels.button(True)
    state.screen.say("saved")
    panels.frame(3)
    panels.move(*panels.point("mx", 0.9))
    panels.button(False)
    assert state.materials.edits.current("brass").lobes[0].mx > 0.5


@pytest.fixture
def whole(monkeypatch, scene, screen, geometry):
    """The panels in a taller window, with a note on the light map and false colours to choose."""
    state = WalkState.of(scene, "walk", screen, screen.folder)
    state.notes = ("light map: noise 3.1 %",)
    driver = PanelDriver(monkeypatch, walk_mode(state, geometry), (1400, 2200))
    unfold(driver, "Drawing", "Camera")
    yield driver
    driver.close()


def pick(panels, label, index):
    panels.click(label)
    x, y = panels.point(label)
    panels.move(x, y + 26 + 19 * index)
    panels.button(True)
    panels.button(False)
    panels.frame()


def test_the_camera_and_the_walker(whole):
    state = whole.state
    whole.drag("field of view", 0.3, 0.8)
    assert state.navigation.camera.fov_y_deg > 80
    whole.drag("speed", 0.5, 0.8)
    assert state.navigation.walker.speed_m_s > 1.5
    before = state.navigation.camera.position[1]
    whole.drag("eye height", 0.5, 0.7)
    assert state.navigation.camera.position[1] > before
    whole.click("near plane by scene size", 0.05)
    assert state.look.near_m == 0.01
    whole.frame()
    whole.drag("near", 0.3, 0.9)
    assert state.look.near_m > 0.5
    whole.drag("frame", 0.6, 0.2)
    assert state.screen.pace.target_ms < 40


def test_views_in_the_panel(whole, tmp_path):
    state = whole.state
    whole.click("##view name", 0.5)
    whole.type("by/the door")
    whole.click("save view##view name")
    whole.frame(2)
    assert [c.name for c in read_views(tmp_path).cameras] == ["by/the door"]
    whole.click("rename...##camera")
    whole.frame()
    whole.click("##new camera name", 0.9)
    whole.type("!")
    whole.click("rename##new camera name")
    whole.frame()
    assert state.navigation.camera.name == "by/the door!" == state.recordings.cameras[-1].name
    whole.click("delete##camera")
    assert len(state.recordings.cameras) == 2 and read_views(tmp_path).cameras == ()


def test_false_colour_has_a_range(whole):
    state = whole.state
    pick(whole, "transform", 3)
    assert state.look.view_transform == "false-colour"
    whole.frame()
    whole.click("decades", 0.05)
    assert not state.look.scale.log
    state.meter.fit_wanted = False
    whole.click("fit to the picture")
    assert state.meter.fit_wanted


def test_comparison_film_and_marks(whole):
    state = whole.state
    for header in ("Light meter", "Compare", "Film", "Statistics"):
        whole.click(header, 0.3)
    assert state.meter.wanted
    pick(whole, "compare", 2)
    assert state.comparison.mode == "error map"
    state.comparison.figures = Figures(33.3, 1.2, (0, 64), 0.04, (0, 32), 2)
    whole.frame()
    pick(whole, "map", 1)
    assert state.comparison.kind == "FLIP"
    whole.click("probes", 0.1)
    whole.click("readout", 0.1)
    assert state.marks.probes and state.meter.readout_on
    whole.click("make film##film file")
    assert state.films.wanted == state.scene.paths[0] and state.films.file_name == "tour.mp4"
    state.meter.reading = read(np.full((8, 8, 3), 0.5))
    whole.click("meter")
    assert state.meter.expose_wanted
    whole.click("save picture")
    assert state.screen.save_wanted
    assert {label for label, rect in whole.rects.items() if rect[2] > whole.io.display_size.x} == set()


def test_what_stands_over_the_picture_is_drawn(whole):
    """Lines, balls, scales, the readout: every call is one that this version of Dear ImGui takes."""
    state = whole.state
    bare = imgui.get_draw_data().total_vtx_count
    state.marks.lines = (((0.1, 0.1), (0.5, 0.2), (0.4, 0.9)),)
    state.marks.balls = (Ball("lamp", 0.5, 0.5, 0.1, 2.0),)
    state.meter.cursor, state.meter.under_cursor = (0.99, 0.99), (1.0, 2.0, 3.0)
    state.recordings.record()
    for scale in (Range(1, 1000), Range(0, 500, log=False), Range(33, 34)):
        state.look.view_transform, state.look.scale = "false-colour", scale
        whole.frame()
    state.comparison.mode, state.comparison.figures = "error map", Figures(33.3, 1.2, (0, 64))
    for state.comparison.kind in ("difference", "FLIP"):
        whole.frame()
    assert imgui.get_draw_data().total_vtx_count > bare + 300


def test_the_method_of_planar_reflectors_is_offered_where_there_are_some(monkeypatch, scene, screen, geometry):
    part = ReflectorPart(object="table", faces=(0, 1), area_m2=4.0)
    plane = ReflectorRecord(plane=(0, 1, 0, -1), outline=((-1, 1, -1), (1, 1, -1), (1, 1, 1)), parts=(part,))
    scene = scene.model_copy(update={"reflectors": (plane,)})
    state = WalkState.of(scene, "walk", screen)
    driver = PanelDriver(monkeypatch, walk_mode(state, geometry), (1400, 2200))
    unfold(driver, "Drawing")
    pick(driver, "planes", 1)
    driver.close()
    assert state.look.planar == "off"


@pytest.mark.parametrize("size", [(640, 480), (800, 600), (320, 240), (1000, 700), (1680, 1050), (1100, 400)])
def test_the_column_takes_a_third_at_most(state, geometry, size):
    column = layout.regions(walk_mode(state, geometry), *size).column
    assert column.width <= size[0] / 3 and (column.width >= 300 or size[0] < 1000)


def test_the_sliders_are_in_reach_without_scrolling(monkeypatch, scene, screen, geometry):
    """Of a material with two lobes, in a window of 1280 x 960 as it opens; exposure, too."""
    lobes = tuple(Lobe(mx=0.1 * k, my=0.1 * k) for k in (1, 2))
    brass = scene.materials["brass"].model_copy(update={"lobes": lobes})
    objects = tuple(scene.objects[1].model_copy(update={"name": f"table {k}"}) for k in range(80))
    scene = scene.model_copy(update={"materials": {**scene.materials, "brass": brass}, "objects": objects})
    state = WalkState.of(scene, "walk", screen)
    state.selection.choose("table 30")
    driver = PanelDriver(monkeypatch, walk_mode(state, geometry), (1280, 960))
    driver.frame(2)
    wanted = ("##values", "mx", "my", "alpha", "undo", "save", "exposure", "transform", "show", "save picture")
    places = {label: driver.rects[label] for label in wanted}
    driver.close()
    assert max(place[3] for place in places.values()) <= 960
    assert max(place[2] for place in places.values()) <= 1280


@pytest.mark.parametrize("size", [(640, 480), (800, 600)])
def test_controls_of_a_narrow_column_can_be_used(monkeypatch, state, geometry, size):
    state.selection.choose("table")
    driver = PanelDriver(monkeypatch, walk_mode(state, geometry), size)
    driver.frame(2)
    for label in ("undo", "redo", "reset", "save", "walk", "orbit", "fly", "meter", "save picture"):
        x0, _, x1, _, _ = driver.rects[label]
        assert 2 / 3 * size[0] <= x0 < x1 <= size[0], label
    driver.drag("mx", 0.3, 0.9)
    assert state.materials.edits.current("brass").lobes[0].mx > 0.2
    driver.close()


def test_a_panel_that_is_opened_comes_into_sight(monkeypatch, state, geometry):
    driver = PanelDriver(monkeypatch, walk_mode(state, geometry), (800, 700))
    driver.frame(2)
    for panel, last in (("Film", "make film##film file"), ("Drawing", "frame")):
        before = driver.rects[panel][1]
        driver.click(panel, 0.3)
        driver.frame(3)
        assert 660 < driver.rects[last][3] <= 700 and driver.rects[panel][1] < before, "scrolled as far as it has to"
        driver.click(panel, 0.3)
        driver.frame(3)
    driver.close()
