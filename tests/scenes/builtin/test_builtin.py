"""The built-in scenes: sound meshes, true sizes, nothing in the way of the walk, no light through walls."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.scenes import load_scene, sample_path
from lambent.scenes.camera_paths import path_length
from lambent.scenes.scene import Scene


@pytest.fixture(scope="module")
def room() -> Scene:
    return load_scene("builtin:room")


def test_every_way_out_is_the_window(room: Scene) -> None:
    """Rays from the air of the room end on its inner surfaces, unless they pass the window's opening."""
    inner = [room.object(n).mesh for n in ("walls", "window_reveal", "ceiling")]
    corners = np.concatenate([m.positions[m.faces] for m in inner]).astype(float)
    rng = np.random.default_rng(2)
    origins = rng.uniform((-2.4, 0.2, -3.0), (2.4, 2.6, 3.0), (4000, 3))
    directions = rng.normal(size=(4000, 3))
    directions[:, 1] = np.abs(directions[:, 1])  # the floor is tiles and joints over a closed shell
    hit = _hits(origins, directions, corners)
    through = np.ones(len(origins), bool)
    for x in (2.6, 2.85):  # both rims of the opening
        t = (x - origins[:, 0]) / directions[:, 0]
        at = origins + t[:, None] * directions
        through &= (t > 0) & (at[:, 1] > 0.5) & (at[:, 1] < 2.45) & (at[:, 2] > -1.3) & (at[:, 2] < 1.9)
    assert through.sum() > 100
    assert np.array_equal(hit, ~through)


def _hits(origins: np.ndarray, directions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Whether each ray meets any triangle (Moller & Trumbore 1997)."""
    hit = np.zeros(len(origins), bool)
    for a, b, c in triangles:
        e1, e2 = b - a, c - a
        p = np.cross(directions, e2)
        determinant = p @ e1
        with np.errstate(divide="ignore", invalid="ignore"):
            s = origins - a
            u = np.sum(s * p, axis=-1) / determinant
            q = np.cross(s, e1)
            v = np.sum(directions * q, axis=-1) / determinant
            t = q @ e2 / determinant
            hit |= (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
    return hit


def test_the_walk_passes_nothing_too_near(room: Scene) -> None:
    """A walker of 25 cm radius, from shin to crown, along the whole path, at constant speed and eye height."""
    path = room.paths[0]
    cameras = [sample_path(path, t) for t in np.linspace(0, 1, 121)]
    positions = np.array([c.position for c in cameras])
    assert np.allclose(positions[:, 1], 1.6)
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=-1)
    assert steps.max() < 1.05 * steps.min()
    assert 0.2 < path_length(path) / path.seconds < 1.2  # m/s
    walker = positions[::4]
    for o in room.objects:
        corners = o.mesh.positions[o.mesh.faces].astype(float)
        points = np.concatenate([corners.reshape(-1, 3), corners.mean(axis=1)])
        points = points[(points[:, 1] > 0.15) & (points[:, 1] < 1.8)]
        if len(points):
            near = np.hypot(points[:, None, 0] - walker[:, 0], points[:, None, 2] - walker[:, 2]).min()
            assert near > 0.25, o.name
