"""The camera answers the mouse and the keys as docs/window.md says."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lambent.core.views.camera import Camera
from lambent.viewer.cameras import cameras

ROOM = ((-3.0, 0.0, -4.0), (3.0, 2.6, 4.0))
EYE = Camera(name="eye", position=(0, 1.6, 2), target=(0, 1.6, -1), fov_y_deg=50)
PIXELS = st.floats(-3000, 3000)


def walked(camera, keys, seconds, steps, **options):
    options = {"bounds": ROOM, "floor_y": 0.0, **options}
    walker = cameras.Walker.of(options["bounds"])
    for _ in range(steps):
        camera = cameras.walk(camera, walker, keys, seconds / steps, **options)
    return camera


def test_heading_and_elevation():
    right_up = replace(EYE, target=(1, 2.6, 2))
    assert cameras.yaw_pitch(EYE) == pytest.approx((0, 0))
    assert cameras.yaw_pitch(right_up) == pytest.approx((math.pi / 2, math.pi / 4))


@given(PIXELS, PIXELS)
def test_orbit_keeps_target_distance_and_horizon(dx, dy):
    turned = cameras.orbit(EYE, dx, dy)
    assert turned.target == EYE.target
    assert math.dist(turned.position, turned.target) == pytest.approx(3)
    assert turned.up == (0, 1, 0)
    assert abs(cameras.yaw_pitch(turned)[1]) <= cameras.PITCH_LIMIT_RAD + 1e-9


def test_orbit_follows_the_mouse():
    """A drag to the right shows the left side: the camera goes left; a drag down looks from above."""
    assert cameras.orbit(EYE, 100, 0).position[0] < 0
    assert cameras.orbit(EYE, 0, 100).position[1] > EYE.position[1]


@given(PIXELS, PIXELS)
def test_look_stays_on_the_spot(dx, dy):
    turned = cameras.look(EYE, dx, dy)
    assert turned.position == EYE.position
    assert abs(cameras.yaw_pitch(turned)[1]) <= cameras.PITCH_LIMIT_RAD + 1e-9


def test_look_turns_where_the_mouse_goes():
    yaw, pitch = cameras.yaw_pitch(cameras.look(EYE, 100, -50))
    assert (yaw, pitch) == pytest.approx((100 * cameras.TURN_RAD_PX, 50 * cameras.TURN_RAD_PX))


def test_pan_keeps_the_target_under_the_mouse():
    height_px = 400
    panned = cameras.pan(EYE, 40, 30, height_px)
    sight = np.subtract(EYE.target, panned.position)  # the old target, seen from the new camera
    scale = height_px / 2 / math.tan(math.radians(25))
    assert sight[0] / -sight[2] * scale == pytest.approx(40)
    assert -sight[1] / -sight[2] * scale == pytest.approx(30)


def test_zoom_goes_to_the_target_and_never_past_it():
    near = cameras.zoom(EYE, 2, ROOM)
    assert math.dist(near.position, near.target) == pytest.approx(3 * cameras.ZOOM_PER_STEP**2)
    assert math.dist(cameras.zoom(EYE, 1000, ROOM).position, EYE.target) == pytest.approx(cameras.NEAREST_M)
    assert math.dist(cameras.zoom(EYE, -1000, ROOM).position, EYE.target) == pytest.approx(20 * math.dist(*ROOM))


@pytest.mark.parametrize("flying", [False, True])
def test_walking_does_not_depend_on_the_frame_rate(flying):
    start = cameras.look(replace(EYE, position=(0, 1.2, 2)), 40, -20)
    slow = walked(start, {"w", "d"}, 0.6, 3, flying=flying)
    fast = walked(start, {"w", "d"}, 0.6, 60, flying=flying)
    assert slow.position == pytest.approx(fast.position, abs=1e-6)
    assert math.dist(slow.position, start.position) > 0.5


def test_walking_speed_and_direction():
    one_second = walked(EYE, {"w"}, 1, 10)
    assert one_second.position == pytest.approx((0, 1.6, 2 - cameras.WALK_M_S))
    assert walked(EYE, {"w"}, 0.5, 10, fast=cameras.FAST).position[2] == pytest.approx(2 - 1.5 * cameras.WALK_M_S)
    assert walked(EYE, {"ArrowRight"}, 1, 10).position == pytest.approx((cameras.WALK_M_S, 1.6, 2))
    assert walked(EYE, {"w", "s"}, 1, 10) == EYE
    assert walked(EYE, {"p"}, 1, 10) == EYE


@pytest.mark.parametrize(
    ("keys", "way"),
    [
        (("w", "ArrowUp"), (0, 0, -1)), (("s", "ArrowDown"), (0, 0, 1)), (("d", "ArrowRight"), (1, 0, 0)),
        (("a", "ArrowLeft"), (-1, 0, 0)), (("e", " "), (0, 1, 0)), (("q", "c"), (0, -1, 0)),
    ],
)  # fmt: skip
def test_where_each_key_leads(keys, way):
    """Flying and looking along -z."""
    for key in keys:
        moved = np.subtract(walked(EYE, {key}, 0.2, 4, flying=True).position, EYE.position)
        assert moved == pytest.approx(0.2 * cameras.WALK_M_S * np.array(way), abs=1e-9), key
    assert {key for key in cameras.KEYS if cameras.KEYS[key] == (way[0], way[1], -way[2])} == set(keys)


def test_the_eye_follows_the_floor_on_foot_only():
    stairs = walked(EYE, {"w"}, 1, 10, floor_y=0.3)
    assert stairs.position[1] == pytest.approx(1.9, abs=1e-3)
    assert walked(EYE, {"e"}, 1, 10) == EYE
    assert walked(EYE, {"e"}, 0.25, 5, flying=True).position[1] > 1.9


@given(st.sets(st.sampled_from(sorted(cameras.KEYS))), PIXELS, st.booleans())
def test_nobody_walks_through_the_bounds(keys, dx, flying):
    camera = walked(cameras.look(EYE, dx, 0), keys, 20, 100, flying=flying, fast=cameras.FAST)
    low, high = np.array(ROOM)
    assert np.all(camera.position > low) and np.all(camera.position < high)


def test_who_starts_outside_may_come_in_but_not_go_farther_out():
    outside = replace(EYE, position=(0, 1.6, 9))
    assert walked(outside, {"s"}, 3, 10).position[2] == pytest.approx(9)
    assert walked(outside, {"w"}, 3, 10).position[2] == pytest.approx(9 - 2.5 * cameras.WALK_M_S)
    beyond = replace(EYE, position=(-7, 1.6, 0), target=(-7, 1.6, -3))
    assert walked(beyond, {"a"}, 2, 10).position[0] == pytest.approx(-7)
    assert walked(beyond, {"d"}, 1, 10).position[0] == pytest.approx(-7 + cameras.WALK_M_S)


def test_a_low_model_is_walked_at_its_own_scale():
    box = ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    assert cameras.Walker.of(box).eye_height_m == pytest.approx(0.6)
    assert cameras.Walker.of(box).speed_m_s == pytest.approx(cameras.WALK_M_S * 0.6 / 1.6)
    assert cameras.Walker.of(ROOM).eye_height_m == 1.6
