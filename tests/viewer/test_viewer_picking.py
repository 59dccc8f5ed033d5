"""Rays of the mouse."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lambent.core.camera import Camera, rays_through
from lambent.viewer.picking import first_hit

TOP = Camera(name="top", position=(0, 3, 0), target=(0, 0, 0), up=(0, 0, -1), fov_y_deg=90)


def test_the_nearest_object_is_picked(geometry):
    assert geometry.pick(TOP.position, rays_through(TOP, 150, 100, 300, 200)).name == "table"
    assert geometry.pick(TOP.position, rays_through(TOP, 190, 100, 200, 200)).name == "floor"
    assert geometry.pick(np.array([0.0, 3, 0]), np.array([0.0, 1, 0])) is None


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
