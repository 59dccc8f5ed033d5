"""A path of a store is followed by time; the curve itself is tested in tests/scenes."""

import math
from itertools import pairwise

import pytest

from lambent.scenes.paths import sample_path
from lambent.store.camera_paths import camera_at
from lambent.store.contract import CameraRecord, PathRecord


def key(position, fov=45.0):
    return CameraRecord(name="key", position=position, target=(0, 1, 0), fov_y_deg=fov)


TOUR = PathRecord(name="tour", keys=(key((0, 1, 4)), key((3, 1, 3)), key((4, 1, 0), fov=60.0)), seconds=6)


def test_it_begins_and_ends_at_its_keys_and_stays_there():
    for time_s, end in ((0, 0), (-1, 0), (6, -1), (99, -1)):
        camera = camera_at(TOUR, time_s)
        assert camera.position == pytest.approx(TOUR.keys[end].position)
        assert camera.fov_y_deg == pytest.approx(TOUR.keys[end].fov_y_deg)


def test_it_is_the_scenes_curve_by_time():
    camera, same = camera_at(TOUR, 1.5), sample_path(TOUR, 0.25)
    assert isinstance(camera, CameraRecord)
    assert (camera.position, camera.target, camera.up) == (same.position, same.target, same.up)


def test_the_pace_is_even():
    points = [camera_at(TOUR, 0.5 * k).position for k in range(13)]
    steps = [math.dist(a, b) for a, b in pairwise(points)]
    assert max(steps) / min(steps) < 1.05


def test_a_path_of_one_key_or_of_no_time_stands_still():
    assert camera_at(PathRecord(name="still", keys=TOUR.keys[:1], seconds=3), 1.0) == TOUR.keys[0]
    assert camera_at(TOUR.model_copy(update={"seconds": 0.0}), 1.0) == TOUR.keys[0]
