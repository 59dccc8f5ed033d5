"""The cells of floor plans."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import binary_erosion

from lambent.core.geometry.plan_cells import filled
from lambent.scenes.floor_plan import Surroundings, _inner, _without_strips, floor_plan
from lambent.scenes.geometry import box, patch, placed

RNG = np.random.default_rng(7)


@pytest.mark.long
def test_cells_are_filled_whose_centre_lies_in_a_triangle() -> None:
    triangles = RNG.uniform(-8, 40, (12, 3, 2))
    rows, columns = np.mgrid[:32, :40]
    expected = np.zeros((32, 40), bool)
    for a, b, c in triangles:
        edges = ((a, b), (b, c), (c, a))
        sides = [(q[0] - p[0]) * (rows - p[1]) - (q[1] - p[1]) * (columns - p[0]) for p, q in edges]
        expected |= (np.min(sides, axis=0) >= 0) | (np.max(sides, axis=0) <= 0)
    assert np.array_equal(filled(triangles, 32, 40), expected)
    assert not filled(triangles + 100, 32, 40).any()


def test_strips_along_the_edge_leave_and_islands_stay() -> None:
    covered = np.zeros((40, 40), bool)
    covered[4:36, 4:36] = True
    standing = np.zeros_like(covered)
    standing[6] = True  # cuts a strip two cells wide off
    standing[16:25, [16, 24]] = standing[[16, 24], 16:25] = True  # a block within
    found = _without_strips(covered, standing, 4.0)
    assert not found[:6].any() and found[6:36, 4:36].all()
    assert np.array_equal(_without_strips(covered, standing, 1.0), covered)
    full = RNG.random((40, 50)) < 0.8
    assert np.array_equal(_inner(full), binary_erosion(full))


def test_what_is_far_from_a_reflector_changes_nothing_and_is_left_out() -> None:
    floor = patch((0, 0, 0), (0, 0, 4), (4, 0, 0)).corners
    wall = patch((0, 0, 0), (4, 0, 0), (0, 2, 0)).corners
    far = np.concatenate([placed(box((1, 1, 1)), p).corners for p in ((20, 0, 0), (2, 9, 2), (2, -9, 2), (0, 0, -30))])
    scene, up = np.concatenate([floor, far, wall]), np.array((0.0, 1.0, 0.0))
    near = Surroundings(scene).over(floor, up)
    assert len(floor) + len(wall) <= len(near) < len(scene) - len(far) / 2
    whole, few = floor_plan(floor, up, scene), floor_plan(floor, up, near)
    assert whole is not None and few is not None and np.array_equal(whole.distance, few.distance)
