"""Mesh building blocks: what every mesh promises, and volumes known by hand."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.scenes.geometry import (
    box,
    catmull_rom,
    cushion,
    cylinder,
    extrusion,
    lathe,
    signed_volume,
    smooth_curve,
    sphere,
    tube,
    turn,
)
from lambent.scenes.geometry import teapot as teapot_mesh
from lambent.scenes.geometry.teapot import evaluate, patches
from lambent.scenes.scene import Mesh
from lambent.scenes.validation import mesh_faults

RING = [(np.cos(a), 0.0, np.sin(a)) for a in np.linspace(0, 2 * np.pi, 13)[:-1]]
WAVE = [(np.cos(a), 0.4 * np.sin(2 * a + 0.3), np.sin(a)) for a in np.linspace(0, 2 * np.pi, 13)[:-1]]
CLOSED = {
    "hard box": (box((1, 2, 3)), 6.0),
    "bevelled box": (box((1, 2, 3), 0.05, segments=3), 5.987),
    "sphere": (sphere(0.5, 96, 48), np.pi / 6),
    "cylinder": (cylinder(0.5, 1.0, 96), np.pi / 4),
    "round-edged cylinder": (cylinder(0.5, 1.0, 96, bevel=0.01), np.pi / 4),
    "cushion that is a sphere": (cushion((1, 1, 1), 2.0), np.pi / 6),
    "torus": (tube(RING, 0.2, 48, 8, closed=True), 2 * np.pi**2 * 0.04),
    "straight tube": (tube([(0, 0, 0), (0, 1, 0)], 0.1, 96), 0.01 * np.pi),
    "prism": (extrusion([(0, 0), (1, 0), (1, 1), (0, 2)], 3), 4.5),
}


def boundary_edges(mesh: Mesh) -> int:
    """Edges that one triangle alone has, vertices of one place (to a micrometre) taken as one."""
    _, place = np.unique(np.round(mesh.positions, 6), axis=0, return_inverse=True)
    corners = place.reshape(-1)[mesh.faces]
    edges = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), axis=-1)
    return int((np.unique(edges, axis=0, return_counts=True)[1] == 1).sum())


@pytest.mark.parametrize("name", CLOSED)
def test_closed_shapes(name: str) -> None:
    mesh, volume = CLOSED[name]
    assert mesh_faults(mesh) == []
    assert boundary_edges(mesh) == 0
    assert signed_volume(mesh) == pytest.approx(volume, rel=0.02)


def test_a_closed_tube_does_not_twist() -> None:
    mesh = tube(WAVE, 0.2, 24, 8, closed=True)
    assert mesh_faults(mesh) == [] and boundary_edges(mesh) == 0
    corners = mesh.positions[mesh.faces].astype(float)
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    face /= np.linalg.norm(face, axis=-1, keepdims=True)
    assert np.sum(face * mesh.normals[mesh.faces].mean(axis=1), axis=-1).min() > 0.9


def test_bevelled_box_has_flat_sides_and_keeps_its_size() -> None:
    mesh = box((1, 2, 3), 0.1)
    assert np.allclose(mesh.bounds, ((-0.5, -1, -1.5), (0.5, 1, 1.5)))
    top = mesh.positions[:, 1] == 1.0
    assert top.sum() >= 4 and np.allclose(mesh.normals[top], (0, 1, 0))


def test_frames_are_right_handed_along_the_brushing() -> None:
    mesh = box((1, 1, 1), brushed=(0, 0, 1))
    side = mesh.normals[:, 0] > 0.99
    assert np.allclose(mesh.tangents[side], (0, 0, 1))
    assert np.allclose(np.cross(mesh.normals[side], mesh.tangents[side]), (0, -1, 0))


def test_lathe_normals_point_away_from_the_axis_outside_and_to_it_inside() -> None:
    mesh = lathe([[(0.5, 0), (0.5, 1)], [(0.4, 1), (0.4, 0)]], 24)
    radius = np.hypot(mesh.positions[:, 0], mesh.positions[:, 2])
    outward = np.sum(mesh.normals * mesh.positions * (1, 0, 1), axis=-1)
    assert (outward[radius > 0.45] > 0).all() and (outward[radius < 0.45] < 0).all()


@pytest.mark.parametrize(("axis", "of", "to"), [("x", 1, 2), ("y", 2, 0), ("z", 0, 1)])
def test_turn_is_right_handed(axis: str, of: int, to: int) -> None:
    assert np.allclose(turn(axis, 90) @ np.eye(3)[of], np.eye(3)[to])


def test_catmull_rom_passes_its_points_and_its_derivative_is_its_slope() -> None:
    points = np.random.default_rng(1).normal(size=(6, 3))
    for closed in (False, True):
        assert np.allclose(catmull_rom(points, np.arange(6.0), closed)[0], points)
        assert np.allclose(smooth_curve(points, 3, closed)[0][: 3 * 5 + 1 : 3], points)
        t, h = np.linspace(0.1, 4.8, 30), 1e-5
        slope = (catmull_rom(points, t + h, closed)[0] - catmull_rom(points, t - h, closed)[0]) / (2 * h)
        assert np.allclose(catmull_rom(points, t, closed)[1], slope, atol=1e-6)


def test_teapot_stands_upright_and_its_outside_is_outside() -> None:
    mesh = teapot_mesh(0.25, 8)
    low, high = mesh.bounds
    assert mesh_faults(mesh) == []
    assert high[0] - low[0] == pytest.approx(0.246, abs=0.004) and low[1] == pytest.approx(0, abs=1e-6)
    assert signed_volume(mesh) > 0
    # The lid is above the bottom, the spout towards +x is narrower than the body.
    assert mesh.positions[np.argmax(mesh.positions[:, 1])][[0, 2]] == pytest.approx([0, 0], abs=1e-3)


def test_teapot_normals_are_those_of_the_surface() -> None:
    """Against finite differences, away from the poles."""
    for members in patches().values():
        for points in members:
            positions, normals, along, across = evaluate(points, 64)
            inner = (slice(8, -8), slice(8, -8))
            du = (positions[9:-7, 8:-8] - positions[7:-9, 8:-8]) * 32
            dv = (positions[8:-8, 9:-7] - positions[8:-8, 7:-9]) * 32
            assert np.abs(du - along[inner]).max() < 0.02 and np.abs(dv - across[inner]).max() < 0.02
            assert np.abs(np.sum(normals * along, axis=-1)).max() < 1e-9
            assert np.allclose(np.linalg.norm(normals, axis=-1), 1)
