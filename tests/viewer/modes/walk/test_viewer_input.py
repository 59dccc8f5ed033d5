"""Mouse and keys over the picture change the state; over the panels they do not."""

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from lambent.core.views.camera import camera_axes
from lambent.viewer.cameras import cameras
from lambent.viewer.cameras.framing import framed
from lambent.viewer.cameras.navigation import PathPlay
from lambent.viewer.input import SCROLL_PX
from lambent.viewer.modes.walk.input import FOV_DEG, NOTCH_S, WalkInput
from lambent.viewer.modes.walk.markers import projected


@pytest.fixture
def mouse(state, geometry):
    return WalkInput(state, geometry)


def send(mouse, kind, ui=False, **event):
    event = {"event_type": kind, "modifiers": (), "button": 1, **event}
    mouse.handle(event, ui_has_mouse=ui, ui_has_keys=ui)


def drag(mouse, begin, end, button=1, ui=False):
    send(mouse, "pointer_down", ui, x=begin[0], y=begin[1], button=button)
    send(mouse, "pointer_move", x=end[0], y=end[1], button=0)
    send(mouse, "pointer_up", x=end[0], y=end[1], button=button)


def test_a_drag_looks_around(mouse, state):
    drag(mouse, (100, 100), (150, 100))
    assert cameras.yaw_pitch(state.navigation.camera)[0] == pytest.approx(50 * cameras.TURN_RAD_PX)
    assert state.navigation.camera.position == state.scene.cameras[0].position


@pytest.mark.parametrize(("button", "target_moves"), [(1, False), (2, True), (3, True)])
def test_orbit_turns_and_shifts(mouse, state, button, target_moves):
    state.navigation.movement = "orbit"
    before = state.navigation.camera
    drag(mouse, (100, 100), (150, 120), button)
    assert (state.navigation.camera.target != before.target) == target_moves
    assert state.navigation.camera.position != before.position


def test_orbit_turns_about_what_is_selected(mouse, state):
    state.navigation.movement = "orbit"
    before = state.navigation.camera
    state.selection.choose("table")
    middle = (0.0, 1.0, 0.0)
    state.navigation.camera = replace(before, target=(0.5, 1.2, 0.0))
    drag(mouse, (100, 100), (180, 100))
    after = state.navigation.camera
    assert after.position != before.position
    assert math.dist(after.position, middle) == pytest.approx(math.dist(before.position, middle))
    assert place(after, middle) == pytest.approx(place(replace(before, target=(0.5, 1.2, 0.0)), middle))
    send(mouse, "wheel", x=10, y=10, dx=0, dy=-200)
    assert math.dist(state.navigation.camera.position, middle) < math.dist(after.position, middle)
    state.selection.choose(None)
    drag(mouse, (100, 100), (120, 100))
    assert math.dist(state.navigation.camera.target, after.target) > 0.01, "the target was nearer, too"


def place(camera, point):
    """Where the camera sees a point: right, up and ahead."""
    return np.array(camera_axes(camera)) @ np.subtract(point, camera.position)


def test_a_click_on_something_large_is_what_orbit_turns_about(mouse, state):
    """The middle of a floor may be far behind the eye."""
    mouse.clicked(200, 290)
    assert state.selection.name == "floor"
    _, y, z = state.selection.pivot
    assert y == pytest.approx(0, abs=1e-6) and 0 < z < 3
    state.selection.choose("floor")
    assert state.selection.pivot == pytest.approx((0, 0, 0))


def test_one_drag_does_not_leave_the_room(mouse, state):
    state.navigation.movement = "orbit"
    (low, high), front = state.navigation.bounds, state.navigation.camera
    for begin, end in (((200, 100), (900, 100)), ((200, 100), (200, 900)), ((200, 100), (-700, -400))):
        for target in (front.target, (3.0, 1.0, 0.0), (0.0, 0.2, -3.0)):
            state.navigation.camera = replace(front, target=target)
            drag(mouse, begin, end)
            eye = np.array(state.navigation.camera.position)
            assert (eye >= low).all() and (eye <= high).all()
            assert state.navigation.camera.target == pytest.approx(target)


def test_orbit_stays_before_a_wall_within_the_bounds(state, geometry):
    """A wall at x = 1 that ends short of the bounds: the eye comes nearer instead of passing through it."""
    wall = np.array([[(1, 0, -4), (1, 2.6, -4), (1, 2.6, 4)], [(1, 0, -4), (1, 2.6, 4), (1, 0, 4)]], np.float32)
    geometry.triangles = np.concatenate([geometry.triangles, wall])
    mouse = WalkInput(state, geometry)
    state.navigation.movement = "orbit"
    state.navigation.camera = replace(state.navigation.camera, position=(0, 1.6, 3), target=(0, 1.6, 0))
    drag(mouse, (300, 100), (0, 100))  # a right turn
    x, _, z = state.navigation.camera.position
    assert 0.5 < x < 1.0, "it went as far as the wall"
    assert math.hypot(x, z) < 1.2
    drag(mouse, (100, 100), (300, 100))
    assert state.navigation.camera.position[0] < 1.0


@pytest.mark.parametrize("name", ["table", "floor"])
def test_f_frames_the_selection(mouse, state, name):
    state.selection.choose(name)
    send(mouse, "key_down", key="f")
    camera, picture = state.navigation.camera, state.screen.picture
    (low, high), record = state.navigation.bounds, state.selection.record
    assert camera.target == pytest.approx(np.mean(record.bounds, axis=0)) and state.navigation.movement == "orbit"
    assert (np.array(camera.position) >= low).all() and (np.array(camera.position) <= high).all()
    if name == "table":
        corners = np.array(list(product(*np.array(record.bounds).T)))
        places, depths = projected(camera, corners, (picture.width, picture.height))
        assert depths.min() > 0 and places.min() > 0 and places.max() < 1
        assert np.ptp(places, axis=0).max() > 0.6, "it fills the picture"


def test_f_without_a_selection_says_so(mouse, state):
    before = state.navigation.camera
    send(mouse, "key_down", key="f")
    assert state.navigation.camera == before and "select an object" in state.screen.messages[-1].text


def test_framing_looks_for_a_line_of_sight_that_is_free(state):
    """Something stands before the object on the present side."""
    bounds = ((-0.2, 0.0, -0.2), (0.2, 0.4, 0.2))
    camera = replace(state.navigation.camera, position=(0, 0.5, 3), target=(0, 0.2, 0))
    found = framed(camera, bounds, 1.5, lambda point, towards: 0.3 if towards[2] > 0.5 else 5.0)
    assert found.position[2] < 0.5 * math.dist(found.position, found.target)
    blocked = framed(camera, bounds, 1.5, lambda point, towards: 0.3)
    assert 0.1 < math.dist(blocked.position, blocked.target) < 0.3


def test_the_wheel_zooms_in_orbit(mouse, state):
    before = state.navigation.camera
    state.navigation.movement = "orbit"
    send(mouse, "wheel", x=10, y=10, dx=0, dy=-100)
    assert math.dist(state.navigation.camera.position, before.target) < math.dist(before.position, before.target)
    near = state.navigation.camera
    send(mouse, "wheel", ui=True, x=10, y=10, dx=0, dy=-100)
    assert state.navigation.camera == near


def test_two_fingers_turn_in_orbit(mouse, state):
    state.navigation.movement, before = "orbit", state.navigation.camera
    send(mouse, "wheel", x=10, y=10, dx=37.5, dy=0)
    after = state.navigation.camera
    assert math.dist(after.position, before.target) == pytest.approx(math.dist(before.position, before.target))
    turned = cameras.yaw_pitch(after)[0] - cameras.yaw_pitch(before)[0]
    assert turned == pytest.approx(-0.375 * SCROLL_PX * cameras.TURN_RAD_PX)


def test_on_foot_the_wheel_steps_and_two_fingers_sideways_turn(mouse, state):
    before = state.navigation.camera
    send(mouse, "wheel", x=10, y=10, dx=0, dy=-100)
    step = np.subtract(state.navigation.camera.position, before.position)
    ahead = cameras.direction(cameras.yaw_pitch(before)[0], 0.0)
    assert step[[0, 2]] @ ahead[[0, 2]] == pytest.approx(NOTCH_S * state.navigation.walker.speed_m_s)
    send(mouse, "wheel", x=10, y=10, dx=0, dy=10_000)
    assert cameras.is_within(state.navigation.camera.position, state.scene.bounds), "a flick passes no wall"
    here = state.navigation.camera
    send(mouse, "wheel", x=10, y=10, dx=100, dy=0)
    assert state.navigation.camera.position == here.position
    assert cameras.yaw_pitch(state.navigation.camera)[0] > cameras.yaw_pitch(here)[0]


def test_a_pinch_changes_the_field_of_view_in_its_range(mouse, state):
    before = state.navigation.camera
    send(mouse, "wheel", x=10, y=10, dx=0, dy=-50, modifiers=("Control",))
    after = state.navigation.camera
    assert after.position == before.position and 0.9 < after.fov_y_deg / before.fov_y_deg < 1
    for dy, most in ((-5000, FOV_DEG[0]), (5000, FOV_DEG[1])):
        send(mouse, "wheel", x=10, y=10, dx=0, dy=dy, modifiers=("Control",))
        assert state.navigation.camera.fov_y_deg == most


def test_what_begins_over_the_interface_belongs_to_it(mouse, state):
    before = state.navigation.camera
    drag(mouse, (100, 100), (150, 100), ui=True)
    drag(mouse, (450, 100), (150, 100))
    assert state.navigation.camera == before


def test_a_click_selects_and_a_click_beside_selects_nothing(mouse, state):
    before = state.navigation.camera
    drag(mouse, (200, 160), (202, 160))  # a shaky click
    assert state.selection.name == "table" and state.navigation.camera == before
    drag(mouse, (200, 2), (200, 2))
    assert state.selection.name is None


def test_a_drag_selects_nothing(mouse, state):
    drag(mouse, (200, 160), (230, 160))
    assert state.selection.name is None


def test_a_key_that_is_released_before_the_frame_takes_a_step(mouse, state):
    before = state.navigation.camera
    send(mouse, "key_down", key="w")
    send(mouse, "key_up", key="w")
    assert mouse.walking
    mouse.walk(0.0)
    stepped = state.navigation.camera
    assert stepped != before and not mouse.walking
    mouse.walk(0.2)
    assert state.navigation.camera == stepped
    send(mouse, "key_down", key="w")
    mouse.walk(0.0)
    assert state.navigation.camera == stepped, "the sleep before a first step is not walked through"
    send(mouse, "key_up", key="w")
    mouse.walk(0.1)
    assert state.navigation.camera != stepped and not mouse.walking


def test_shift_walks_faster_and_its_release_in_between_sticks_to_no_key(mouse, state):
    send(mouse, "key_down", key="Shift", modifiers=("Shift",))
    send(mouse, "key_down", key="W", modifiers=("Shift",))
    mouse.walk(0.1)
    assert state.navigation.camera.position[2] == pytest.approx(3 - 0.1 * cameras.FAST * cameras.WALK_M_S)
    send(mouse, "key_up", key="Shift")
    mouse.walk(0.1)
    assert state.navigation.camera.position[2] == pytest.approx(3 - 0.1 * (cameras.FAST + 1) * cameras.WALK_M_S)
    send(mouse, "key_up", key="w")
    assert not mouse.walking


def test_typing_does_not_walk(mouse, state):
    send(mouse, "key_down", key="d")
    send(mouse, "key_down", ui=True, key="w")
    assert not mouse.walking


def test_keys(mouse, state):
    state.navigation.path = PathPlay(state.scene.paths[0])
    send(mouse, "key_down", key="2")
    assert state.navigation.camera == state.scene.cameras[1] and state.navigation.path is None
    send(mouse, "key_down", key="9")
    assert state.navigation.camera == state.scene.cameras[1]
    for key in ("o", "g", "p", "h"):
        send(mouse, "key_down", key=key)
    assert (
        state.navigation.movement,
        state.navigation.flying,
        state.screen.save_wanted,
        state.screen.panels_shown,
    ) == ("orbit", True, True, False)
    state.selection.name = "table"
    send(mouse, "key_down", key="Escape")
    assert state.selection.name is None


def test_undo_and_redo_by_keys(mouse, state):
    brass = state.scene.materials["brass"]
    state.materials.edits.change("brass", brass.model_copy(update={"kd": (0.5, 0.5, 0.5)}))
    send(mouse, "key_down", key="z", modifiers=("Control",))
    assert state.materials.edits.current("brass") == brass
    send(mouse, "key_down", key="Z", modifiers=("Control", "Shift"))
    assert state.materials.edits.current("brass").kd == (0.5, 0.5, 0.5)
    assert not mouse.walking


def test_the_divider_is_dragged_and_the_camera_is_not(mouse, state):
    state.comparison.mode = "side by side"
    at = mouse.screen.picture.x + 0.5 * mouse.screen.picture.width
    before = state.navigation.camera
    drag(mouse, (at, 50), (at + 0.25 * mouse.screen.picture.width, 60))
    assert state.comparison.divider.share == pytest.approx(0.75, abs=0.02) and state.navigation.camera == before
    drag(mouse, (at, 50), (at + 40, 60))
    assert state.navigation.camera != before


def test_the_cursor_is_known_over_the_picture_only(mouse, state):
    send(mouse, "pointer_move", x=mouse.screen.picture.x, y=mouse.screen.picture.y)
    assert state.meter.cursor == pytest.approx((0, 0), abs=0.01)
    send(mouse, "pointer_move", ui=True, x=mouse.screen.picture.x, y=mouse.screen.picture.y)
    assert state.meter.cursor is None
    send(mouse, "pointer_move", x=mouse.screen.picture.x + mouse.screen.picture.width, y=mouse.screen.picture.y)
    assert state.meter.cursor is None


def test_keys_of_views_and_recordings(mouse, state):
    for key in ("v", "1", "3"):
        send(mouse, "key_down", key=key)
    assert state.navigation.camera.name == "view 1"
    send(mouse, "key_down", key="R")
    assert state.recordings.recorder.on


def test_who_stops_flying_comes_down(mouse, state):
    send(mouse, "key_down", key="g")
    mouse.walk(0.0)
    state.navigation.camera = replace(state.navigation.camera, position=(2.0, 2.4, 2.0), target=(2.0, 2.4, 1.0))
    mouse.walk(0.0)
    assert state.navigation.camera.position[1] == 2.4
    send(mouse, "key_down", key="g")
    mouse.walk(0.0)
    assert state.navigation.camera.position == pytest.approx((2.0, 1.6, 2.0)) and state.navigation.camera.target[
        1
    ] == pytest.approx(1.6)
