"""Camera paths go through their keys, smoothly and at constant speed."""

import math
from itertools import pairwise

import numpy as np
import pytest

from lambent.store.camera_paths import camera_at
from lambent.store.contract import CameraRecord, PathRecord


def key(position, target=(0, 1, 0), fov=45.0):
    return CameraRecord(name="key", position=position, target=target, fov_y_deg=fov)


TOUR = PathRecord(
    name="tour", keys=(key((0, 1, 4)), key((3, 1, 3)), key((4, 1, 0), fov=60.0), key((1, 2, -4))), seconds=6
)


@pytest.mark.parametrize("index", range(4))
def test_it_passes_its_keys(index):
    camera = camera_at(TOUR, 2.0 * index)
    assert camera.position == pytest.approx(TOUR.keys[index].position)
    assert camera.fov_y_deg == pytest.approx(TOUR.keys[index].fov_y_deg)


def test_it_stops_at_its_ends():
    assert camera_at(TOUR, -1) == camera_at(TOUR, 0)
    assert camera_at(TOUR, 99) == camera_at(TOUR, 6)


@pytest.mark.parametrize("segment", range(3))
def test_the_speed_is_constant_within_a_segment(segment):
    times = np.linspace(2 * segment, 2 * segment + 2, 21)
    points = [camera_at(TOUR, t).position for t in times]
    steps = [math.dist(a, b) for a, b in pairwise(points)]
    assert max(steps) / min(steps) < 1.02


def test_it_is_smooth_at_a_key():
    h = 1e-3
    a, b, c = (np.array(camera_at(TOUR, 2 + d).position) for d in (-h, 0, h))
    before, after = (b - a) / np.linalg.norm(b - a), (c - b) / np.linalg.norm(c - b)
    assert before @ after > 0.9999


def test_turning_on_the_spot():
    path = PathRecord(name="turn", keys=(key((0, 1, 0), (1, 1, 0)), key((0, 1, 0), (0, 1, 1))), seconds=1)
    camera = camera_at(path, 0.5)
    assert camera.position == pytest.approx((0, 1, 0))
    assert camera.target == pytest.approx((0.5, 1, 0.5))


def test_a_path_of_one_key_stands_still():
    assert camera_at(PathRecord(name="still", keys=TOUR.keys[:1], seconds=3), 1.0) == TOUR.keys[0]
