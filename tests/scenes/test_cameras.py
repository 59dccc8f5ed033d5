"""Cameras of scenes that have none, and camera paths: constant speed, smooth, through the keys; by time, too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.core.views.camera import Camera, CameraPath
from lambent.scenes.camera_paths import camera_at, path_length, sample_path
from lambent.scenes.first_view import content_bounds, first_views
from lambent.scenes.geometry.shapes import box
from lambent.scenes.scene import SceneObject


def block(name: str, size: tuple[float, float, float], at: tuple[float, float, float]) -> SceneObject:
    mesh = box(size)
    low, high = mesh.bounds
    return SceneObject(name, replace(mesh, positions=mesh.positions + (np.array(at) - (low + high) / 2)), "grey")


def room(ceiling: bool = True) -> list[SceneObject]:
    """Six by four metres, 2.8 m high, of walls a decimetre thick."""
    sides = [
        block("floor", (6, 0.1, 4), (0, -0.05, 0)), block("west", (0.1, 2.8, 4), (-3, 1.4, 0)),
        block("east", (0.1, 2.8, 4), (3, 1.4, 0)), block("north", (6, 2.8, 0.1), (0, 1.4, -2)),
        block("south", (6, 2.8, 0.1), (0, 1.4, 2)),
    ]  # fmt: skip
    return [*sides, block("ceiling", (6, 0.1, 4), (0, 2.85, 0))] if ceiling else sides


GROUND = block("ground", (50_000, 1, 50_000), (0, -0.6, 0))
TABLE = block("table", (1.2, 0.7, 0.8), (2.0, 0.35, 0.8))


def test_a_room_is_seen_from_within_and_from_outside() -> None:
    for around in ([], [GROUND]):
        within, whole = first_views([*room(), TABLE, *around])
        assert (within.name, whole.name) == ("inside", "overview")
        x, y, z = within.position
        assert abs(x) < 2.5 and abs(z) < 1.5 and y == pytest.approx(1.6, abs=1e-6), "someone stands there"
        assert np.linalg.norm(whole.position) < 15


@pytest.mark.parametrize(
    "objects",
    [
        [block("solid", (6, 3, 4), (0, 1.5, 0))],
        room(ceiling=False),
        [GROUND, TABLE],
        [replace(o, mesh=replace(o.mesh, positions=o.mesh.positions / 1000)) for o in room()],
        [block("flat", (5, 0.0, 5), (0, 0, 0))],
    ],
    ids=["solid", "no ceiling", "ground", "millimetres", "flat"],
)
def test_other_scenes_are_seen_from_outside(objects: list[SceneObject]) -> None:
    assert [camera.name for camera in first_views(objects)] == ["overview"]


def test_grounds_and_skies_do_not_push_the_camera_away() -> None:
    sky = block("sky", (900, 900, 900), (0, 100, 0))
    for around in ([GROUND], [sky], [sky, GROUND]):
        low, high = content_bounds([TABLE, *around])
        assert (low, high) == (pytest.approx(TABLE.mesh.bounds[0]), pytest.approx(TABLE.mesh.bounds[1]))
    tower = block("tower", (2, 90, 2), (0, 45, 0))
    assert content_bounds([TABLE, tower])[1][1] == 90, "something tall is no ground"
    assert content_bounds([GROUND])[1][0] == 25_000


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


@pytest.mark.long
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
