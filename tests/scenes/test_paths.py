"""Camera paths: constant speed, smooth, through the keys; of a scene's dataclass or any object alike."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from lambent.scenes import sample_path
from lambent.scenes.paths import path_length
from lambent.scenes.scene import Camera, CameraPath

KEYS = (
    Camera("a", (0, 1.6, 0), (0, 1, -5), fov_y_deg=40),
    Camera("b", (1, 1.6, 0), (2, 1, -5), fov_y_deg=60),
    Camera("c", (4, 1.6, -3), (5, 1, -5), fov_y_deg=50),
    Camera("d", (4.5, 1.6, -3), (9, 1, -5), fov_y_deg=50),
)
PATH = CameraPath("walk", KEYS, 10.0)


def test_ends() -> None:
    for t, key in ((0, KEYS[0]), (-1, KEYS[0]), (1, KEYS[-1]), (2, KEYS[-1])):
        camera = sample_path(PATH, t)
        assert camera.position == pytest.approx(key.position) and camera.target == pytest.approx(key.target)
    assert sample_path(PATH, 0.3).name == "walk"


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


def test_any_object_with_the_same_attributes_will_do() -> None:
    keys = [SimpleNamespace(position=k.position, target=k.target, up=k.up, fov_y_deg=k.fov_y_deg) for k in KEYS]
    assert sample_path(SimpleNamespace(name="walk", keys=keys), 0.37) == sample_path(PATH, 0.37)


def test_a_path_that_stands_still_turns() -> None:
    keys = (Camera("a", (0, 1, 0), (1, 1, 0)), Camera("b", (0, 1, 0), (0, 1, 1)))
    assert sample_path(CameraPath("turn", keys), 0.5).target == pytest.approx((0.5, 1, 0.5))
