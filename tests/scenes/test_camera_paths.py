"""Camera paths: constant speed, smooth, through the keys; by time, too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.core.views.camera import Camera, CameraPath
from lambent.scenes import sample_path
from lambent.scenes.camera_paths import camera_at, path_length

KEYS = (
    Camera("a", (0, 1.6, 0), (0, 1, -5), fov_y_deg=40),
    Camera("b", (1, 1.6, 0), (2, 1, -5), fov_y_deg=60),
    Camera("c", (4, 1.6, -3), (5, 1, -5), fov_y_deg=50),
    Camera("d", (4.5, 1.6, -3), (9, 1, -5), fov_y_deg=50),
)
PATH = CameraPath("walk", KEYS, 10.0)


def test_speed_is_constant_though_the_keys_are_not_evenly_spaced() -> None:
    positions = np.array([sample_path(PATH, t).position for t in np.linspace(0, 1, 401)])
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=-1)
    assert steps.max() / steps.min() < 1.02
    assert path_length(PATH) == pytest.approx(steps.sum(), rel=1e-3)


def test_it_passes_the_keys_smoothly() -> None:
    positions = np.array([sample_path(PATH, t).position for t in np.linspace(0, 1, 2001)])
    for key in KEYS:
        assert np.linalg.norm(positions - key.position, axis=-1).min() < 0.005
    ways = np.diff(positions, axis=0)
    ways /= np.linalg.norm(ways, axis=-1, keepdims=True)
    assert np.sum(ways[1:] * ways[:-1], axis=-1).min() > np.cos(np.radians(2))


def key(position, fov=45.0):
    return Camera(name="key", position=position, target=(0, 1, 0), fov_y_deg=fov)


TOUR = CameraPath(name="tour", keys=(key((0, 1, 4)), key((3, 1, 3)), key((4, 1, 0), fov=60.0)), seconds=6)


def test_it_begins_and_ends_at_its_keys_and_stays_there():
    for time_s, end in ((0, 0), (-1, 0), (6, -1), (99, -1)):
        camera = camera_at(TOUR, time_s)
        assert camera.position == pytest.approx(TOUR.keys[end].position)
        assert camera.fov_y_deg == pytest.approx(TOUR.keys[end].fov_y_deg)


def test_a_path_of_one_key_or_of_no_time_stands_still():
    assert camera_at(CameraPath(name="still", keys=TOUR.keys[:1], seconds=3), 1.0) == TOUR.keys[0]
    assert camera_at(replace(TOUR, seconds=0.0), 1.0) == TOUR.keys[0]


def test_a_recorded_walk_is_smooth_through_its_keys_and_times() -> None:
    """Quadratic motion is met exactly between inner keys: slopes at keys are those between their neighbours."""

    def at(t: float) -> Camera:
        position, target = (t * t, 1.6, -2 * t), (t * t + 1, 1.6 + t, -2 * t - t * t)
        return Camera("walk", position, target, (0, 1, 0), fov_y_deg=40 + 10 * t)

    times = (0.0, 1.0, 2.0, 3.0, 4.0)
    path = CameraPath("walk", tuple(map(at, times)), 4.0, times_s=times)
    for t in (1.0, 1.25, 1.5, 2.0, 2.75):
        seen, expected = camera_at(path, t), at(t)
        assert seen.position == pytest.approx(expected.position) and seen.target == pytest.approx(expected.target)
        assert seen.fov_y_deg == pytest.approx(expected.fov_y_deg)
    for t, end in ((-1.0, 0.0), (9.0, 4.0)):
        assert camera_at(path, t).position == pytest.approx(at(end).position)
    jumping = CameraPath("walk", (at(0), at(1), at(2)), 3.0, times_s=(0.0, 1.0, 3.0))
    assert camera_at(jumping, 1.0).position == pytest.approx(at(1).position), "keys need not be even in time"
    assert camera_at(jumping, 3.0).position == pytest.approx(at(2).position)
