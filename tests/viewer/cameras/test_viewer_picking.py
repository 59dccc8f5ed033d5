"""Rays of the mouse."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lambent.core.views.camera import Camera, rays_through
from lambent.store.contract import ObjectRecord
from lambent.viewer.cameras.picking import Geometry, first_hit

TOP = Camera(name="top", position=(0, 3, 0), target=(0, 0, 0), up=(0, 0, -1), fov_y_deg=90)


def test_the_nearest_is_picked_in_whatever_order(geometry, scene):
    """The table stands over the floor; from below the floor is nearer."""
    down, up = np.array([0.0, -1, 0]), np.array([0.1, 1, 0.05])
    assert geometry.pick((0.5, 3, 0.3), down).name == "table"
    assert geometry.pick((0.5, 0.5, 0.3), down).name == "floor", "what is behind the eye is not seen"
    assert geometry.pick((0.2, -2, 0.3), up / np.linalg.norm(up)).name == "floor"
    assert geometry.pick((0.5, 3, 0.3), -down) is None
    turned = Geometry(*reordered(geometry.triangles), scene.objects[::-1])
    assert turned.pick((0.5, 3, 0.3), down).name == "table"


def reordered(triangles):
    """Vertices and faces of the same triangles; the records say where each object's are."""
    return triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)


def test_picture_points_are_right_side_up():
    eye = Camera(name="eye", position=(0, 0, 5), target=(0, 0, 0), fov_y_deg=90)
    right, top = rays_through(eye, 200, 50, 200, 100), rays_through(eye, 100, 0, 200, 100)
    assert right == pytest.approx(np.array([2, 0, -1]) / np.sqrt(5))
    assert top == pytest.approx(np.array([0, 1, -1]) / np.sqrt(2))


@given(st.integers(0, 2**32 - 1))
def test_points_inside_a_triangle_are_hit_at_their_distance(seed):
    rng = np.random.default_rng(seed)
    triangle = rng.normal(size=(1, 3, 3))
    weights = rng.dirichlet((2, 2, 2))
    point, origin = weights @ triangle[0], rng.normal(size=3) * 3
    distance = np.linalg.norm(point - origin)
    normal = np.cross(triangle[0, 1] - triangle[0, 0], triangle[0, 2] - triangle[0, 0])
    if abs(normal @ (point - origin)) < 1e-3 * np.linalg.norm(normal) * distance:
        return  # edge-on
    assert first_hit(origin, (point - origin) / distance, triangle) == pytest.approx(distance, rel=1e-5)
    outside = triangle[0, 0] + 1.2 * (triangle[0, 1] - triangle[0, 0]) + 0.2 * (triangle[0, 2] - triangle[0, 0])
    direction = (outside - origin) / np.linalg.norm(outside - origin)
    assert first_hit(origin, direction, triangle) == np.inf


def test_a_thing_within_anothers_box_is_nearer():
    """The room's box holds the eye, and its floor lies behind the leaf."""

    def square(y):
        return [[(-1, y, -1), (-1, y, 1), (1, y, 1)], [(-1, y, -1), (1, y, 1), (1, y, -1)]]

    triangles = np.array([*square(1.0), *square(0.0), *square(3.0)], float)
    leaf = ObjectRecord(name="leaf", material="m", first_face=0, face_count=2, bounds=((-1, 1, -1), (1, 1, 1)))
    room = ObjectRecord(name="room", material="m", first_face=2, face_count=4, bounds=((-1, 0, -1), (1, 3, 1)))
    for objects in ((leaf, room), (room, leaf)):
        held = Geometry(*reordered(triangles), objects)
        assert held.pick((0.2, 2, 0.1), np.array([0.0, -1, 0])).name == "leaf"
        assert held.pick((0.2, 2, 0.1), np.array([0.0, 1, 0])).name == "room"
