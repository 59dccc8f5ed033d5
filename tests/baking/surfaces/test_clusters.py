"""Groups of faces that become one chart each."""

from __future__ import annotations

import numpy as np

from lambent.baking.surfaces.clusters import clusters_of
from lambent.core.arrays import Floats

NO_TURN = np.eye(2)[None]


def squares(at: Floats, side: float = 1.0) -> Floats:
    """(2 N, 3, 3) of squares in the plane z = 0, or at the depths of places (N, 3)."""
    a, b, c, d = (np.asarray(at, float) + side * np.array([x, y, 0]) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))
    return np.stack([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)], axis=1).reshape(-1, 3, 3)


def groups(corners: Floats, size_m: float = 0.25) -> list[list[int]]:
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    found = clusters_of(corners, areas, np.full(len(corners), size_m), 2, NO_TURN)
    return sorted(sorted(group.tolist()) for group in found)


def test_what_lies_apart_is_parted_and_what_lies_together_stays() -> None:
    near = [(x, y, 0) for x in range(3) for y in range(3)]
    far = [(x + 40, y, 0) for x in range(2) for y in range(2)]
    assert groups(squares(near)) == [list(range(18))]
    assert groups(squares([*near, *far])) == [list(range(18)), list(range(18, 26))]


def test_what_lies_one_behind_another_is_parted_by_its_depth() -> None:
    behind = [(0, 0, z) for z in (0, 60)]
    assert groups(squares(behind, 4)) == [[0, 1], [2, 3]]
    assert groups(squares([(0, 0, 0), (0, 0, 0.1)], 4)) == [[0, 1, 2, 3]]


def test_all_faces_are_in_one_group_each_and_none_without_area_is_lost() -> None:
    at = np.random.default_rng(1).uniform(0, 50, (300, 3))
    corners = np.concatenate([squares(at, 0.3), np.zeros((3, 3, 3))])
    found = groups(corners)
    assert sorted(face for group in found for face in group) == list(range(len(corners)))
    assert len(found) > 20
    assert groups(np.zeros((4, 3, 3))) == [[0, 1, 2, 3]]
