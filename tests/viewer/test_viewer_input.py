"""Mouse and keys over the picture change the state; over the panels they do not."""

import math
from dataclasses import replace

import numpy as np
import pytest

from lambent.viewer import cameras
from lambent.viewer.comparison import Comparison
from lambent.viewer.input import Input, Rect
from lambent.viewer.picking import Geometry
from lambent.viewer.state import PathPlay, ViewerState
from lambent.viewer.views import SavedViews


@pytest.fixture
def state(scene, choices):
    return ViewerState.of(scene, choices, "walk")


@pytest.fixture
def mouse(scene):
    def square(half, y):
        return [(-half, y, -half), (-half, y, half), (half, y, half), (half, y, -half)]

    positions = np.array(square(4, 0.0) + square(1, 1.0), np.float32)
    faces = np.array([(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)], np.uint32)
    return Input(Geometry(positions, faces, scene.objects), Rect(0, 0, 400, 300))


def send(mouse, state, kind, ui=False, **event):
    event = {"event_type": kind, "modifiers": (), "button": 1, **event}
    mouse.handle(state, event, ui_has_mouse=ui, ui_has_keys=ui)


def drag(mouse, state, begin, end, button=1, ui=False):
    send(mouse, state, "pointer_down", ui, x=begin[0], y=begin[1], button=button)
    send(mouse, state, "pointer_move", x=end[0], y=end[1], button=0)
    send(mouse, state, "pointer_up", x=end[0], y=end[1], button=button)


def test_a_drag_looks_around(mouse, state):
    drag(mouse, state, (100, 100), (150, 100))
    assert cameras.yaw_pitch(state.camera)[0] == pytest.approx(50 * cameras.TURN_RAD_PX)
    assert state.camera.position == state.scene.cameras[0].position


@pytest.mark.parametrize(("button", "target_moves"), [(1, False), (2, True), (3, True)])
def test_orbit_turns_and_shifts(mouse, state, button, target_moves):
    state.mode = "orbit"
    before = state.camera
    drag(mouse, state, (100, 100), (150, 120), button)
    assert (state.camera.target != before.target) == target_moves
    assert state.camera.position != before.position


def test_the_wheel_zooms_in_orbit_only(mouse, state):
    before = state.camera
    send(mouse, state, "wheel", x=10, y=10, dx=0, dy=-100)
    assert state.camera == before
    state.mode = "orbit"
    send(mouse, state, "wheel", x=10, y=10, dx=0, dy=-100)
    assert math.dist(state.camera.position, before.target) < math.dist(before.position, before.target)
    near = state.camera
    send(mouse, state, "wheel", ui=True, x=10, y=10, dx=0, dy=-100)
    assert state.camera == near


def test_what_begins_over_the_interface_belongs_to_it(mouse, state):
    before = state.camera
    drag(mouse, state, (100, 100), (150, 100), ui=True)
    drag(mouse, state, (450, 100), (150, 100))
    assert state.camera == before


def test_a_click_selects_and_a_click_beside_selects_nothing(mouse, state):
    before = state.camera
    drag(mouse, state, (200, 160), (202, 160))  # a shaky click
    assert state.selected == "table" and state.camera == before
    drag(mouse, state, (200, 2), (200, 2))
    assert state.selected is None


def test_a_drag_selects_nothing(mouse, state):
    drag(mouse, state, (200, 160), (230, 160))
    assert state.selected is None


def test_walking(mouse, state):
    send(mouse, state, "key_down", key="w")
    assert mouse.walking
    for _ in range(10):
        mouse.walk(state, 0.05)
    send(mouse, state, "key_up", key="w")
    assert not mouse.walking
    assert state.camera.position[2] == pytest.approx(3 - 0.5 * cameras.WALK_M_S)
    mouse.walk(state, 0.05)
    assert state.camera.position[2] == pytest.approx(3 - 0.5 * cameras.WALK_M_S)


def test_shift_walks_faster_and_its_release_in_between_sticks_to_no_key(mouse, state):
    send(mouse, state, "key_down", key="Shift", modifiers=("Shift",))
    send(mouse, state, "key_down", key="W", modifiers=("Shift",))
    mouse.walk(state, 0.1)
    assert state.camera.position[2] == pytest.approx(3 - 0.1 * cameras.FAST * cameras.WALK_M_S)
    send(mouse, state, "key_up", key="Shift")
    mouse.walk(state, 0.1)
    assert state.camera.position[2] == pytest.approx(3 - 0.1 * (cameras.FAST + 1) * cameras.WALK_M_S)
    send(mouse, state, "key_up", key="w")
    assert not mouse.walking


def test_typing_does_not_walk(mouse, state):
    send(mouse, state, "key_down", key="d")
    send(mouse, state, "key_down", ui=True, key="w")
    assert not mouse.walking


def test_keys(mouse, state):
    state.path = PathPlay(state.scene.paths[0])
    send(mouse, state, "key_down", key="2")
    assert state.camera == state.scene.cameras[1] and state.path is None
    send(mouse, state, "key_down", key="9")
    assert state.camera == state.scene.cameras[1]
    for key in ("o", "f", "p", "h"):
        send(mouse, state, "key_down", key=key)
    assert (state.mode, state.flying, state.screenshot_wanted, state.panels_shown) == ("orbit", True, True, False)
    state.selected = "table"
    send(mouse, state, "key_down", key="Escape")
    assert state.selected is None


def test_undo_and_redo_by_keys(mouse, state):
    brass = state.scene.materials["brass"]
    state.edits.change("brass", brass.model_copy(update={"kd": (0.5, 0.5, 0.5)}))
    send(mouse, state, "key_down", key="z", modifiers=("Control",))
    assert state.edits.current("brass") == brass
    send(mouse, state, "key_down", key="Z", modifiers=("Control", "Shift"))
    assert state.edits.current("brass").kd == (0.5, 0.5, 0.5)
    assert not mouse.walking


def test_the_divider_is_dragged_and_the_camera_is_not(mouse, state):
    state.comparison = Comparison(mode="side by side")
    at = mouse.picture.x + 0.5 * mouse.picture.width
    before = state.camera
    drag(mouse, state, (at, 50), (at + 0.25 * mouse.picture.width, 60))
    assert state.comparison.split == pytest.approx(0.75, abs=0.02) and state.camera == before
    drag(mouse, state, (at, 50), (at + 40, 60))
    assert state.camera != before


def test_the_cursor_is_known_over_the_picture_only(mouse, state):
    send(mouse, state, "pointer_move", x=mouse.picture.x, y=mouse.picture.y)
    assert state.meter.cursor == pytest.approx((0, 0), abs=0.01)
    send(mouse, state, "pointer_move", ui=True, x=mouse.picture.x, y=mouse.picture.y)
    assert state.meter.cursor is None
    send(mouse, state, "pointer_move", x=mouse.picture.x + mouse.picture.width, y=mouse.picture.y)
    assert state.meter.cursor is None


def test_keys_of_views_and_recordings(mouse, state, scene, tmp_path):
    state.views = SavedViews(scene, tmp_path, state.say)
    for key in ("v", "1", "3"):
        send(mouse, state, "key_down", key=key)
    assert state.camera.name == "view 1"
    send(mouse, state, "key_down", key="R")
    assert state.recorder.on


def test_the_walkers_own_pace(mouse, state):
    state.walker.speed_m_s = 0.5
    before = state.camera.position
    send(mouse, state, "key_down", key="w")
    mouse.walk(state, 0.2)
    assert before[2] - state.camera.position[2] == pytest.approx(0.1)


def test_who_stops_flying_comes_down(mouse, state):
    send(mouse, state, "key_down", key="f")
    mouse.walk(state, 0.0)
    state.camera = replace(state.camera, position=(2.0, 2.4, 2.0), target=(2.0, 2.4, 1.0))
    mouse.walk(state, 0.0)
    assert state.camera.position[1] == 2.4
    send(mouse, state, "key_down", key="f")
    mouse.walk(state, 0.0)
    assert state.camera.position == pytest.approx((2.0, 1.6, 2.0)) and state.camera.target[1] == pytest.approx(1.6)
