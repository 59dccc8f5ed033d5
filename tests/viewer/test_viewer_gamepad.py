"""A gamepad: read from the window library, polled only while it is there; it walks, looks, and chooses."""

import math
from types import SimpleNamespace

import glfw
import pytest

from lambent.viewer.cameras import cameras
from lambent.viewer.gamepad import DEAD, IDLE, GlfwPads, PadState, PadWatch, stick
from lambent.viewer.modes.walk.input import PAD_PX_S, WalkInput


class Library:
    """glfw with gamepads of a test, by number."""

    def __init__(self, **pads):
        self.pads = {int(name[1:]): pad for name, pad in pads.items()}

    def __getattr__(self, name):
        return getattr(glfw, name)

    def get_gamepad_state(self, number):
        return self.pads.get(number)


def raw(axes=(0, 0, 0, 0, -1, -1), *pressed):
    buttons = [int(number in pressed) for number in range(15)]
    return SimpleNamespace(axes=axes, buttons=buttons)


def test_the_first_gamepad_is_read():
    assert GlfwPads(Library()).read() is None
    pads = GlfwPads(Library(_2=raw((1, -1, 0, 0.5, -1, 1), glfw.GAMEPAD_BUTTON_B)))
    state = pads.read()
    assert math.hypot(*state.left) == pytest.approx(1) and state.left[1] > 0, "up is forward"
    assert state.right == pytest.approx((0, -(0.5 - DEAD) / (1 - DEAD)))
    assert (state.slower, state.faster, state.pressed) == (0, 1, {"B"})
    assert GlfwPads(Library(_0=raw())).read() == IDLE and not IDLE.moves


def test_the_installed_library_has_gamepads():
    """All that is asked of it."""
    assert all(hasattr(glfw, name) for name in ("get_gamepad_state", "set_joystick_callback", "JOYSTICK_LAST"))


def test_a_stick_begins_beyond_its_dead_zone():
    assert stick(0.1, -0.1) == (0, 0) and stick(0, 0) == (0, 0)
    assert stick(DEAD + 0.01, 0)[0] == pytest.approx(0.01 / (1 - DEAD))
    assert math.hypot(*stick(1, 1)) == pytest.approx(1), "corners of a square stick"


class Fake:
    state = None

    def read(self):
        return self.state


@pytest.fixture
def watch():
    """A watch of a fake gamepad, what is due later, and how often the window was woken."""
    due, woken = [], []
    pads = Fake()
    return PadWatch(pads, lambda seconds, call: due.append(call), lambda: woken.append(1)), pads, due, woken


def test_nothing_is_polled_without_a_gamepad(watch):
    pad, pads, due, woken = watch
    pad.connected()
    assert not due and not woken and pad.now == IDLE
    pads.state = IDLE
    pad.connected(1, 2)
    pad.connected()
    assert len(due) == 1, "once for two connections"
    due.pop()()
    assert len(due) == 1 and not woken, "the window sleeps while nothing is touched"
    pads.state = None
    due.pop()()
    assert not due, "it was unplugged"


def test_the_window_wakes_while_something_is_held_and_when_it_is_let_go(watch):
    pad, pads, due, woken = watch
    pads.state = PadState(left=(0.0, 1.0))
    pad.connected()
    due.pop()()
    assert len(woken) == 2 and pad.now.moves
    pads.state = None
    due.pop()()
    assert len(woken) == 3 and pad.now == IDLE, "unplugged while it was held"


@pytest.fixture
def input(state, geometry):
    return WalkInput(state, geometry)


def test_the_left_stick_walks_by_its_deflection_and_the_triggers(input, state):
    start, lengths = state.navigation.camera, []
    for pad in (
        PadState(left=(0, 1)),
        PadState(left=(0, 0.5)),
        PadState(left=(0, 1), faster=1),
        PadState(left=(0, 1), slower=1),
    ):
        state.navigation.jump(start)
        input.steer(pad, 0.1)
        lengths.append(math.dist(state.navigation.camera.position, start.position))
    assert lengths[0] == pytest.approx(0.1 * state.navigation.walker.speed_m_s)
    assert lengths[1:] == pytest.approx([lengths[0] / 2, cameras.FAST * lengths[0], lengths[0] / cameras.FAST])
    assert input.walking
    input.steer(IDLE, 0.1)
    assert not input.walking


def test_the_right_stick_looks_and_a_long_frame_does_not_spin(input, state):
    before = state.navigation.camera
    input.steer(PadState(right=(1.0, 0.0)), 60.0)
    after = state.navigation.camera
    turned = cameras.yaw_pitch(after)[0] - cameras.yaw_pitch(before)[0]
    assert turned == pytest.approx(cameras.LONGEST_STEP_S * PAD_PX_S * cameras.TURN_RAD_PX)
    assert after.position == before.position
    input.steer(PadState(right=(0.0, 1.0)), 0.1)
    assert cameras.yaw_pitch(state.navigation.camera)[1] > cameras.yaw_pitch(after)[1], "up"


def test_in_orbit_it_turns_and_comes_nearer(input, state):
    state.navigation.movement, before = "orbit", state.navigation.camera
    input.steer(PadState(right=(1.0, 0.0)), 0.1)
    turned = state.navigation.camera
    assert math.dist(turned.position, before.target) == pytest.approx(math.dist(before.position, before.target))
    assert turned.position != before.position
    input.steer(PadState(left=(0.0, 1.0)), 0.1)
    assert math.dist(state.navigation.camera.position, before.target) < math.dist(turned.position, before.target)


def test_a_button_acts_once_for_each_press(input, state):
    held = PadState(pressed=frozenset({"A"}))
    for pad in (held, held, IDLE, held):
        input.steer(pad, 0.0)
    assert state.navigation.camera.name == "front", "side, then front again"
    assert [message.text for message in state.screen.messages] == ["side", "front"]
    size = state.screen.size
    input.steer(PadState(pressed=frozenset({"Start", "B"})), 0.0)
    assert state.screen.size != size and state.screen.messages[-1].text == "as baked"
