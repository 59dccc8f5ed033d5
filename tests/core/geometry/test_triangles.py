"""Triangles: areas, normals, points on them."""

from __future__ import annotations

import numpy as np

from lambent.core.geometry.triangles import cross_2d, points_on_triangles, triangle_areas, triangle_normals


def test_areas_and_normals() -> None:
    corners = np.array([[(0, 0, 0), (2, 0, 0), (0, 3, 0)], [(1, 1, 1), (1, 1, 1), (2, 2, 2)]], float)
    assert triangle_areas(corners).tolist() == [3.0, 0.0]
    assert triangle_normals(corners).tolist() == [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]


def test_points_lie_on_their_triangles() -> None:
    rng = np.random.default_rng(0)
    corners, face = rng.normal(size=(5, 3, 3)), rng.integers(0, 5, 300)
    points = points_on_triangles(corners, face, rng)
    heights = np.sum((points - corners[face, 0]) * triangle_normals(corners)[face], axis=-1)
    assert np.abs(heights).max() < 1e-12
    parts = np.stack([corners[face], np.roll(corners[face], -1, axis=1)], axis=2)
    split = triangle_areas(np.concatenate([parts, np.broadcast_to(points[:, None, None], (300, 3, 1, 3))], axis=2))
    np.testing.assert_allclose(split.sum(axis=1), triangle_areas(corners)[face])


def test_the_cross_product_in_a_plane() -> None:
    angle = np.radians([10.0, 90.0, -30.0])
    turned = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    np.testing.assert_allclose(cross_2d(np.array([2.0, 0.0]), turned), 2 * np.sin(angle))
