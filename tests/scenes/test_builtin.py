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


def test_size(room: Scene) -> None:
    assert 50_000 <= sum(len(o.mesh.faces) for o in room.objects) <= 100_000
    low, high = room.object("walls").mesh.bounds
    assert np.allclose(high - low, (5.2, 2.804, 6.4))
    assert sum(len(o.mesh.faces) for o in load_scene("builtin:box").objects) < 1000


def test_what_the_demo_needs_is_there(room: Scene) -> None:
    materials = {o.name: o.material for o in room.objects}
    assert materials["teapot"] == "copper" and materials["brushed_plate"] == "brushed_aluminium"
    assert materials["table_top"] == "varnished_wood" and materials["screen_pane"] == "frosted_glass"
    assert room.materials["frosted_glass"].transmission_lobes
    assert len(room.cameras) >= 4 and len(room.paths) == 1
    for name in ("walls", "ceiling"):
        assert not room.materials[materials[name]].lobes


def test_brushing_runs_along_the_plate(room: Scene) -> None:
    mesh = room.object("brushed_plate").mesh
    front = mesh.normals[:, 0] > 0.99
    assert np.allclose(np.abs(mesh.tangents[front]), (0, 0, 1), atol=1e-3)
    lobe = room.materials["brushed_aluminium"].lobes[0]
    assert lobe.my > 3 * lobe.mx


def test_nothing_floats_or_stands_in_the_floor(room: Scene) -> None:
    for name in (
        "sofa_feet",
        "table_base",
        "plinth",
        "sideboard_legs",
        "shelf",
        "screen_frame",
        "rug",
        "chair_1_frame",
    ):
        assert room.object(name).mesh.bounds[0][1] == pytest.approx(0, abs=0.003), name
    for name, below in (("teapot", "table_top"), ("bowl", "table_top"), ("vase", "table_top"),
                        ("vase_small", "sideboard_top"), ("vase_red", "shelf"), ("pile_book_blue", "sideboard_top"),
                        ("lamp_canopy", "walls")):  # fmt: skip
        bottom, top = room.object(name).mesh.bounds[0][1], room.object(below).mesh.bounds[1][1]
        gap = top - room.object(name).mesh.bounds[1][1] if below == "walls" else bottom - top
        assert abs(gap) < 0.003, (name, gap)


def test_the_sphere_rests_in_its_ring(room: Scene) -> None:
    ball, ring = room.object("steel_sphere").mesh, room.object("plinth_ring").mesh
    middle = np.mean(ball.bounds, axis=0)
    nearest = np.linalg.norm(ring.positions - middle, axis=-1).min()
    assert nearest == pytest.approx(0.17, abs=0.002)


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


def test_shell_and_inner_surfaces_share_the_rim_of_the_window(room: Scene) -> None:
    shell, reveal = (room.object(n).mesh.positions for n in ("shell", "window_reveal"))
    rim = reveal[reveal[:, 0] > 2.8]
    assert len(rim) and all((np.abs(shell - p).max(axis=-1) == 0).any() for p in rim)


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


def test_cameras_stand_in_the_free_and_level(room: Scene) -> None:
    for camera in room.cameras:
        assert abs(camera.position[0]) < 2.5 and abs(camera.position[2]) < 3.1 and 1.2 < camera.position[1] < 1.7
        assert camera.up == (0.0, 1.0, 0.0)


def test_sun_reaches_the_floor_and_the_teapot(room: Scene) -> None:
    """From the table and from the open floor the way to the sun passes the window."""
    sun = np.array(room.environment.sun_direction)
    teapot = np.mean(room.object("teapot").mesh.bounds, axis=0)
    for point in (teapot, np.array([0.9, 0.0, -0.5])):
        at = point + sun * (2.85 - point[0]) / sun[0]
        assert 0.5 < at[1] < 2.45 and -1.3 < at[2] < 1.9
