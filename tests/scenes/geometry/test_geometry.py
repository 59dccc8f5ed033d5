"""Mesh building blocks: what every mesh promises, volumes known by hand; Bezier patches and their tessellation."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.scenes.geometry import (
    bezier,
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
from lambent.scenes.geometry.bezier import oriented_alike, steps_to, tessellated, triangles_of
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


HANDLE = 4 / 3 * (np.sqrt(2) - 1)  # of a cubic quarter circle: its radius is right within .03 %
ARC = np.array([[1, 0], [1, HANDLE], [HANDLE, 1], [0, 1]])
THIRDS = np.arange(4) / 3
TEAPOT = np.array([points for members in patches().values() for points in members])


def sheet(heights: np.ndarray | float = 0.0) -> np.ndarray:
    """Control points (4, 4, 3) over the unit square: x is u, y is v."""
    u, v = np.meshgrid(THIRDS, THIRDS)
    return np.stack([u, v, np.broadcast_to(heights, u.shape)], axis=-1).astype(float)


def octant(radius: float = 1.0) -> np.ndarray:
    """An eighth of a ball: u runs around the axis, v up to the pole, where an edge is one point."""
    points = np.zeros((4, 4, 3))
    points[..., :2] = radius * ARC[:, :1, None] * ARC
    points[..., 2] = radius * ARC[:, 1:]
    return points


def random_patch() -> np.ndarray:
    return sheet() + 0.3 * np.random.default_rng(3).standard_normal((4, 4, 3))


def some(count: int = 200) -> tuple[np.ndarray, np.ndarray]:
    u, v = np.random.default_rng(0).random((2, count))
    return u, v


def test_a_ball_and_its_pole() -> None:
    u, v = some()
    ball = octant(2.0)
    at = bezier.positions(ball, u, v)
    assert np.allclose(np.linalg.norm(at, axis=1), 2, rtol=6e-4)
    assert (bezier.normals(ball, u, v) * at / 2).sum(axis=1).min() > 0.999
    around = np.linspace(0, 1, 9)
    pole = np.ones(9)
    assert np.allclose(bezier.positions(ball, around, pole), (0, 0, 2))
    assert np.allclose(bezier.normals(ball, around, pole), (0, 0, 1), atol=1e-6)


def test_derivatives_are_those_of_finite_differences() -> None:
    points, (u, v), h = random_patch(), some(), 1e-5
    u, v = 0.1 + 0.8 * u, 0.1 + 0.8 * v
    s_u, s_v = bezier.tangents(points, u, v)
    assert np.allclose((bezier.positions(points, u + h, v) - bezier.positions(points, u - h, v)) / (2 * h), s_u)
    assert np.allclose((bezier.positions(points, u, v + h) - bezier.positions(points, u, v - h)) / (2 * h), s_v)
    s_uu, s_uv, s_vv = bezier.bends(points, u, v)
    by_u = [(a - b) / (2 * h) for a, b in zip(*(bezier.tangents(points, u + k, v) for k in (h, -h)), strict=True)]
    by_v = [(a - b) / (2 * h) for a, b in zip(*(bezier.tangents(points, u, v + k) for k in (h, -h)), strict=True)]
    for found, expected in zip((s_uu, s_uv, s_uv, s_vv), (*by_u, *by_v), strict=True):
        assert np.allclose(found, expected, atol=1e-6)


@pytest.mark.parametrize("shape", [(2, 2), (2, 4), (3, 2), (4, 3), (4, 4)])
def test_elevation_keeps_the_surface(shape: tuple[int, int]) -> None:
    from math import comb

    points = np.random.default_rng(1).random((*shape, 3))
    u, v = some(50)

    def basis(t: np.ndarray, degree: int) -> np.ndarray:
        return np.stack([comb(degree, i) * t**i * (1 - t) ** (degree - i) for i in range(degree + 1)], axis=1)

    expected = np.einsum("ni,nj,ijx->nx", basis(v, shape[0] - 1), basis(u, shape[1] - 1), points)
    assert np.allclose(bezier.positions(bezier.elevated(points), u, v), expected, atol=1e-14)


def deviation(control: np.ndarray, steps: np.ndarray) -> float:
    """Largest distance between a patch (4, 4, 3) and its triangles, along the normal."""
    mesh = tessellated(control[None], steps[None])
    places = np.random.default_rng(0).dirichlet((1, 1, 1), 40)
    u, v = np.einsum("kc,fcx->xfk", places, mesh.uv[mesh.faces].astype(float))
    away = np.einsum("kc,fcx->fkx", places, mesh.corners) - bezier.positions(control, u, v)
    return float(np.abs((away * bezier.normals(control, u, v)).sum(-1)).max())


@pytest.mark.long
@pytest.mark.parametrize("tolerance", [0.05, 0.01])
def test_tessellation_within_a_tolerance(tolerance: float) -> None:
    """Bulges of different size beside each other: patches get different steps, and still share their edges."""
    steps = steps_to(TEAPOT, tolerance)
    mesh = tessellated(TEAPOT, steps)
    assert len(np.unique(steps[:, :2])) > 1 and (steps[:, 2:] != steps[:, [0, 0, 1, 1]]).any()
    assert tolerance / 20 < max(map(deviation, TEAPOT, steps)) < tolerance
    assert mesh_faults(mesh) == []
    assert len(mesh.faces) <= triangles_of(steps)


def test_edges_of_neighbours_coincide_bitwise() -> None:
    """Four sheets about a corner, one with a bulge, one transposed and one reversed: the rim alone is open."""
    ridge = np.array([0.0, 0.1, 0.2, 0.0]) / 7  # heights along the edges that the patches share
    parts = [sheet(np.pad(np.full((2, 2), 3.0), 1)), *(sheet() for _ in range(3))]
    for i, part in enumerate(parts):
        part[:, 0 if i % 2 else 3, 2] += ridge
        part[..., :2] += (i % 2, i // 2)
    parts[1] = parts[1].transpose(1, 0, 2)
    parts[2] = parts[2][:, ::-1]
    steps = steps_to(np.array(parts), 0.004)
    assert len(np.unique(steps, axis=0)) > 1
    mesh = tessellated(np.array(parts), steps)
    places, at = np.unique(mesh.positions, axis=0, return_inverse=True)  # no rounding
    ends = np.sort(np.concatenate([at[mesh.faces][:, pair] for pair in ([0, 1], [1, 2], [2, 0])]), axis=1)
    edges, count = np.unique(ends, axis=0, return_counts=True)
    rim = places[edges[count == 1]][..., :2]
    assert len(rim) and ((rim == 0) | (rim == 2)).any(axis=-1).all()


def test_a_fixed_number_of_steps() -> None:
    ball = tessellated(octant()[None], 8)
    assert len(ball.faces) == 2 * 64 - 8, "those at the pole have one triangle"
    assert np.allclose(bezier.positions(octant(), *ball.uv.T.astype(float)), ball.positions, atol=1e-6)
    assert np.allclose(np.linalg.norm(ball.positions, axis=1), 1, rtol=6e-4)


def test_a_closed_ball_has_no_open_edge() -> None:
    turn = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    upper = [octant() @ np.linalg.matrix_power(turn, k) for k in range(4)]
    control = oriented_alike(np.array([*upper, *(points * (1, 1, -1) for points in upper)]))
    mesh = tessellated(control, steps_to(control, 0.002))
    assert boundary_edges(mesh) == 0 and mesh_faults(mesh) == []
