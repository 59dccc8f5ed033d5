"""Overlaps in one plane: known answers, and the grid against every pair."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from lambent.core.arrays import Floats, hashes
from lambent.core.geometry.coplanar import _overlap, coplanar_overlaps
from lambent.core.geometry.directions import basis, normalize
from lambent.core.geometry.triangles import triangle_normals

WITHIN_M = 1e-4
LARGE = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
OTHERS = {
    "inside": ([[0.1, 0.1, 0.0], [0.2, 0.1, 0.0], [0.1, 0.2, 0.0]], True),
    "inside, facing the other way": ([[0.1, 0.1, 0.0], [0.1, 0.2, 0.0], [0.2, 0.1, 0.0]], True),
    "a fan without corners inside": ([[-1.0, 0.3, 0.0], [2.0, 0.31, 0.0], [2.0, 0.29, 0.0]], True),
    "a hair in front": ([[0.1, 0.1, 0.5e-4], [0.2, 0.1, 0.5e-4], [0.1, 0.2, 0.5e-4]], True),
    "a millimetre in front": ([[0.1, 0.1, 1e-3], [0.2, 0.1, 1e-3], [0.1, 0.2, 1e-3]], False),
    "beside, sharing an edge": ([[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]], False),
    "beside, within rounding": ([[0.99995, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.99995, 0.0]], False),
    "across": ([[0.1, 0.1, -0.1], [0.2, 0.1, 0.1], [0.1, 0.2, 0.1]], False),
}


@pytest.mark.parametrize("name", OTHERS)
@pytest.mark.parametrize("at", [0.0, -300.0])
def test_two_triangles(name: str, at: float) -> None:
    other, overlaps = OTHERS[name]
    t, b = basis(n := normalize(np.array([1.0, 1.0, 0.0])))  # a plane halfway between axes
    corners = np.array([LARGE, other]) @ np.stack([t, b, n]) + at
    found = coplanar_overlaps(corners, np.array([0, 1]), np.full(2, WITHIN_M))
    assert found.tolist() == ([[0, 1]] if overlaps else [])
    assert not len(coplanar_overlaps(corners, np.array([4, 4]), np.full(2, WITHIN_M))), "of one group"


def scattered(rng: np.random.Generator, count: int) -> Floats:
    """Triangles of many sizes in five planes, one of them at a right angle to a cell's border."""
    sizes, where = 2.0 ** rng.uniform(-6, 1, (count, 1, 1)), rng.uniform(-1, 1, (count, 1, 2))
    flat = where + sizes * rng.normal(size=(count, 3, 2))
    normals = normalize(np.concatenate([[[0.0, 1.0, 0.0]], rng.normal(size=(4, 3))]))[rng.integers(5, size=count)]
    t, b = basis(normals)
    return np.asarray(np.einsum("kca,akx->kcx", flat, np.stack([t, b])))


def test_the_grid_finds_what_all_pairs_find() -> None:
    rng = np.random.default_rng(3)
    corners, group = scattered(rng, 300), rng.integers(4, size=300)
    normals, size = triangle_normals(corners), np.ptp(corners, axis=1).max(axis=1)
    expected = []
    for i, j in combinations(range(300), 2):
        small, large = (i, j) if size[i] < size[j] else (j, i)
        if group[i] != group[j] and _overlap(corners[large], normals[large], corners[small], normals[small], WITHIN_M):
            expected.append([i, j])
    assert len(expected) > 500
    assert coplanar_overlaps(corners, group, np.full(300, WITHIN_M)).tolist() == expected


def test_thousands_of_copies_count_as_one() -> None:
    copies = np.array([LARGE] * 5000)
    copies[1::2] = copies[1::2, [1, 2, 0]]  # in another order of corners
    below = np.array([[[-1.0, -1.0, 0.0], [3.0, -1.0, 0.0], [-1.0, 3.0, 0.0]]])
    corners, group = np.concatenate([copies, below]), np.array([0] * 5000 + [1])
    assert coplanar_overlaps(corners, group, np.full(5001, WITHIN_M)).tolist() == [[0, 5000]]
    turned = np.concatenate([copies, copies[:, ::-1], below])
    found = coplanar_overlaps(turned, np.array([0] * 10000 + [1]), np.full(10001, WITHIN_M))
    assert found.tolist() == [[0, 10000], [5000, 10000]], "which face the other way are others"


def test_hashes_tell_points_apart() -> None:
    side = np.arange(-64, 64) / 128
    points = np.stack(np.meshgrid(side, side, side[::4]), axis=-1).reshape(-1, 3)
    assert len(np.unique(hashes(points))) == len(points)
    assert hashes(np.array([[0.0, 1.0, -0.0]])) == hashes(np.array([[-0.0, 1.0, 0.0]]))
