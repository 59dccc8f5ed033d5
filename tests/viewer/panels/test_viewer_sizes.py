"""The sizes of the window: which panels each has, the bar of *show*, the card, and the keys of the controls."""

import pytest
from imgui_bundle import imgui

from lambent.core.light.light_mix import GroupMix, LightMix
from lambent.store.kept.session import RoomState
from lambent.viewer.modes.walk import offers
from lambent.viewer.modes.walk.input import CARD
from lambent.viewer.settings import SIZES
from tests.viewer.panel_driver import PanelDriver, walk_mode

WINDOW = (1280, 800)
DIM = RoomState(light=LightMix({"lamp": GroupMix(intensity=0.2)}))


@pytest.fixture
def window(monkeypatch, state, geometry):
    driver = PanelDriver(monkeypatch, walk_mode(state, geometry), WINDOW)
    yield driver
    driver.close()


def press(window, key):
    """Press a key as Dear ImGui sees it."""
    for down in (True, False):
        window.io.add_key_event(key, down)
        window.frame(2)


def tap(window, key, *modifiers):
    """Press a key as the window gets it, then draw."""
    event = {"event_type": "key_down", "key": key, "modifiers": modifiers}
    window.mode.input.handle(event, ui_has_mouse=False, ui_has_keys=False)
    window.frame(2)


def test_no_panel_is_lost_and_numbers_are_for_measuring(window, state):
    shown = {}
    for size in SIZES:
        state.screen.size = size
        window.frame(2)
        shown[size] = {panel.title for panel in window.mode.panels if panel.title in window.rects}
    assert shown["show"] == set() and shown["design"] | shown["measure"] == {
        panel.title for panel in window.mode.panels
    }
    assert shown["measure"] - shown["design"] == {
        "Camera", "Drawing", "Light field", "Light meter", "Compare", "Statistics",
    }  # fmt: skip
    assert shown["design"] - shown["measure"] == {"Light on it"}, "which the Light meter has there"


def test_a_key_and_a_control_switch_the_size_of_the_picture(window, state):
    narrow = state.screen.picture.width
    tap(window, "m")
    assert state.screen.size == "show" and state.screen.picture.width == WINDOW[0] > narrow
    tap(window, "m", "Shift")
    assert state.screen.size == "measure"
    window.click("show##size")
    assert state.screen.size == "show"
    window.click("design##size")
    assert state.screen.size == "design"


def test_the_bar_leaves_while_one_walks_and_comes_under_the_mouse(window, state):
    state.screen.size = "show"
    window.move(600, 300)
    window.frame()
    assert "##view" in window.rects and "play" in window.rects
    window.mode.input.held.add("w")
    window.frame()
    assert "##view" not in window.rects
    window.move(600, WINDOW[1] - 5)
    window.frame()
    assert "##view" in window.rects
    window.mode.input.held.clear()
    state.screen.panels_shown = False
    window.frame()
    assert "##view" not in window.rects, "H hides it too"


def test_the_bar_plays_a_film(window, state):
    state.screen.size = "show"
    window.frame()
    window.click("play")
    assert state.navigation.playing
    window.click("pause")
    assert not state.navigation.playing and state.navigation.path.path.name == "tour"


def test_a_press_on_the_bar_or_the_card_is_none_on_the_picture(window, state):
    state.screen.size, state.screen.card_shown = "show", True
    window.frame(2)
    for label, over in (("design##size", True), ("begin", True), (None, False)):
        window.move(*(window.point(label) if label else (100, 100)))
        window.frame()
        assert window.popup_open == over, label


def test_lists_have_what_there_is_to_choose(window, state):
    state.screen.size = "show"
    window.frame()
    assert "##variant" not in window.rects and "##light" not in window.rects, "there is only the bake"
    state.materials.edits.take(DIM)
    state.materials.edits.store("evening")
    window.frame()
    assert "##variant" in window.rects and "##light" in window.rects


def test_light_alone_is_taken_from_a_state(state):
    edits = state.materials.edits
    red = edits.current("plaster").model_copy(update={"kd": (0.7, 0.1, 0.1)})
    edits.take(DIM)
    edits.store("evening")
    edits.take(RoomState(materials={"plaster": red}))
    lights = offers.lights(state.states)
    assert list(lights.acts) == ["as baked", "evening"] and lights.now == "as baked"
    lights.acts["evening"]()
    assert edits.room == RoomState(materials={"plaster": red}, light=DIM.light)
    assert offers.variants(state.states).now == "as edited"
    edits.undo()
    assert edits.room == RoomState(materials={"plaster": red})


def test_the_next_of_a_list_begins_again_after_the_last(state):
    names = [offers.views(state).next() for _ in range(3)]
    assert names == ["side", "front", "side"] and state.navigation.camera.name == "side"
    state.navigation.move(state.navigation.camera.__class__("free", (0, 1.6, 2), (0, 1, 0)))
    assert offers.views(state).now == "free" and offers.views(state).next() == "front"


def test_the_bar_is_reached_by_keys_alone(window, state):
    state.screen.size = "show"
    tap(window, "Tab")
    assert window.io.nav_visible and window.io.want_capture_keyboard
    for _ in range(2):
        press(window, imgui.Key.tab)
    press(window, imgui.Key.space)
    assert state.navigation.playing, "the third control"
    press(window, imgui.Key.escape)
    assert not state.screen.by_keys
    window.frame(2)
    assert not window.io.want_capture_keyboard, "the keys walk again"


def test_the_keys_stay_with_the_controls_from_size_to_size_until_a_click(window, state):
    state.screen.size = "design"
    tap(window, "Tab")
    press(window, imgui.Key.tab)
    press(window, imgui.Key.left_arrow)
    press(window, imgui.Key.space)
    assert state.screen.size == "show"
    press(window, imgui.Key.tab)
    assert window.focused and window.focused <= set(window.rects)
    window.move(100, 100)
    window.button(True)
    window.button(False)
    window.frame(2)
    assert not state.screen.by_keys and not window.io.want_capture_keyboard
    tap(window, "Tab")
    window.click("play")
    assert not state.screen.by_keys and state.navigation.playing, "the click counts"


@pytest.mark.parametrize("key", ["Tab", "F6"])
def test_either_key_gives_the_controls_the_keys(window, state, key):
    tap(window, key)
    assert state.screen.by_keys and window.io.nav_visible


@pytest.mark.parametrize("size", SIZES)
def test_every_control_takes_the_keys(window, state, size):
    """Tab goes round all that can be pressed, moved or typed into."""
    state.screen.size = size
    tap(window, "Tab")
    seen = set()
    for _ in range(3 + 2 * len(window.rects)):
        press(window, imgui.Key.tab)
        seen |= window.focused
    assert set(window.rects) - seen - window.greyed == set()


def test_the_card_is_shown_once(window, state):
    assert not state.screen.card_shown
    state.screen.remembered.set(card_seen=False)
    window.frame(2)
    assert state.screen.card_shown and len(CARD) == 4
    window.click("begin")
    window.frame(2)
    assert not state.screen.card_shown and state.screen.remembered.now.card_seen
    tap(window, "F1")
    assert state.screen.card_shown
    tap(window, "Escape")
    assert not state.screen.card_shown


def test_letters_and_controls_scale_together(window, state):
    low, high = window.rects["meter"], imgui.get_style().frame_padding.y
    for _ in range(3):
        tap(window, "+", "Control")
    scale = state.screen.remembered.now.scale
    assert scale == pytest.approx(1.1**3, abs=0.02)
    taller = window.rects["meter"]
    assert (taller[3] - taller[1]) / (low[3] - low[1]) == pytest.approx(scale, abs=0.06)
    assert imgui.get_style().frame_padding.y == pytest.approx(scale * high, abs=1)
    tap(window, "0", "Control")
    assert imgui.get_style().frame_padding.y == high and window.rects["meter"] == low
    for _ in range(30):
        tap(window, "-", "Control")
    assert state.screen.remembered.now.scale == 0.7


def test_the_exposure_goes_by_thirds(window, state):
    start = state.look.exposure_ev
    window.click("brighter")
    assert state.look.said_exposure == "+1/3 EV" and state.look.exposure_ev == pytest.approx(start + 1 / 3)
    for _ in range(4):
        tap(window, "+")
    assert state.look.said_exposure == "+1 2/3 EV"
    state.look.exposure_ev = start - 0.5
    tap(window, "-")
    assert state.look.said_exposure == "-2/3 EV", "the next third below"
    state.look.expose(2.0)
    assert state.look.said_exposure == "0 EV"
