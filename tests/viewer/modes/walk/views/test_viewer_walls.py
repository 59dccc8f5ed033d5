"""Floors carry a walker, walls stop and guide; nobody gets stuck."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lambent.viewer.modes.walk.views.walls import BODY_M, Walls, nearest_points


def block(low, high):
    """The 12 triangles of a box."""
    x, y, z = zip(low, high, strict=True)
    corners = np.array([(x[i & 1], y[i >> 1 & 1], z[i >> 2 & 1]) for i in range(8)], float)
    quads = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    return corners[[t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]]


WALL = block((-20, 0, -2.1), (20, 2.5, -2))
TABLE = block((1, 0.72, -1), (2, 0.75, 1))
ROOM = Walls(np.concatenate([WALL, TABLE, block((-5, 0, -3), (-2, 0.1, 3)), block((-1, 2, -1), (1, 2.4, 1))]))


def walk(start, heading, metres, walls=ROOM, stride=0.05):
    eye = np.array([start[0], 1.6, start[1]])
    step = stride * np.array([math.cos(heading), 0, math.sin(heading)])
    for _ in range(round(metres / stride)):
        eye = eye + walls.allowed(eye, step, 1.6)
    return eye


def test_floors_and_tables(geometry):
    ground = Walls(geometry.triangles)
    assert ground.floor_below((3, 1.6, 3), 1.6) == pytest.approx(0)
    assert ground.floor_below((0, 1.6, 0), 1.6) == pytest.approx(0)  # the table is no stair
    assert ground.floor_below((0, 2.4, 0), 1.6) == pytest.approx(1)  # but one can stand on it
    assert ground.floor_below((9, 1.6, 0), 1.6) is None


def test_a_wall_stops():
    eye = walk((0, 0), -math.pi / 2, 5)
    assert eye == pytest.approx([0, 1.6, -2 + BODY_M], abs=0.06)


def test_one_slides_along_a_wall():
    eye = walk((-4, -1.5), -math.pi / 4, 4)
    assert eye[2] >= -2 + BODY_M - 1e-6
    assert eye[0] == pytest.approx(-4 + 4 * math.cos(math.pi / 4), abs=0.2)


def test_a_table_top_stops_though_thin():
    assert walk((0, 0), 0, 3)[0] == pytest.approx(1 - BODY_M, abs=0.06)


def test_a_doorstep_and_a_lamp_do_not():
    assert walk((0, 0), math.pi, 3)[0] == pytest.approx(-3)


def test_who_stands_too_near_may_step_away():
    near = np.array([0, 1.6, -1.99])
    away, along = np.array([0, 0, 0.02]), np.array([0.02, 0, 0])
    assert ROOM.allowed(near, away, 1.6) == pytest.approx(away)
    assert ROOM.allowed(near, along, 1.6) == pytest.approx(along)
    assert np.linalg.norm(ROOM.allowed(near, -away, 1.6)) < 1e-6


@pytest.mark.long
@settings(max_examples=40)
@given(st.floats(-4, 4), st.floats(-1.5, 3), st.floats(0, 2 * math.pi))
def test_nobody_gets_through_the_wall(x, z, heading):
    assert walk((x, z), heading, 6, stride=0.2)[2] > -2


def test_distances_to_outlines():
    triangle = np.array([[(0, 0), (2, 0), (0, 2)]], float)
    for p, expected in (((0.5, 0.5), 0), ((-1, 1), 1), ((2, 2), math.sqrt(2)), ((3, 0), 1)):
        assert nearest_points(np.array(p, float), triangle)[0][0] == pytest.approx(expected)
    assert nearest_points(np.array([1.0, -1]), triangle)[1][0] == pytest.approx((1, 0))
