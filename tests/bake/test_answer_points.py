"""Points that gather light: one for each block, smaller blocks where surfaces are close."""

from __future__ import annotations

import numpy as np

from lambent.bake.answering.points import MORE, gather_points, neighbours, refined_points
from lambent.bake.answering.spots import Spots
from lambent.core.answer import BYTE

SIZE = 32


def plane() -> Spots:
    """A square of SIZE x SIZE texels, each a unit wide, lit on its front alone."""
    count = SIZE * SIZE
    row, column = np.divmod(np.arange(count), SIZE)
    lit = np.stack([np.ones(count, bool), np.zeros(count, bool)])
    light = np.ones((1, 2, count, 3), np.float32)
    whole = np.zeros(count, np.int64)
    up = np.tile([0.0, 1.0, 0.0], (count, 1))
    position = np.stack([column, 0.0 * row, row], axis=-1).astype(float)
    return Spots(lit, lit, light, light, light[0], np.ones(count), whole, whole, whole, position, up, np.arange(count))


def test_a_block_has_one_point_in_its_middle() -> None:
    found = gather_points(plane(), SIZE, 4)
    assert len(found.texel) == (SIZE // 4) ** 2 and (found.block == 4).all() and not found.side.any()
    assert set((found.texel % SIZE % 4).tolist()) <= {1, 2}


def test_points_are_dense_along_a_contact_and_as_many_as_allowed() -> None:
    spots = plane()
    coarse = gather_points(spots, SIZE, 4)
    away = spots.position[coarse.texel, 0] + 0.5  # from a wall at the left border
    found = refined_points(spots, SIZE, coarse, 2 * away)
    assert len(coarse.texel) < len(found.texel) <= MORE * len(coarse.texel)
    assert len(np.unique(found.texel)) == len(found.texel)
    column = found.texel % SIZE
    assert found.block[column < 4].max() < found.block[column >= 16].min() == 4
    far = refined_points(spots, SIZE, coarse, np.full(len(coarse.texel), 1e3))
    assert np.array_equal(far.texel, coarse.texel), "in the open nothing changes"


def test_points_at_each_texel_are_no_finer() -> None:
    spots = plane()
    finest = gather_points(spots, SIZE, 1)
    assert refined_points(spots, SIZE, finest, np.full(len(finest.texel), 0.1)) is finest


def test_texels_show_their_own_point_where_each_has_one() -> None:
    spots = plane()
    coarse = gather_points(spots, SIZE, 2)
    near = np.where(spots.position[coarse.texel, 0] < 2, 0.1, 1e3)
    points = refined_points(spots, SIZE, coarse, near)
    codes, shown = neighbours(spots, points)
    own = {int(texel): number for number, texel in enumerate(points.texel)}
    singles = points.texel[points.block == 1]
    assert len(singles) > 16
    for texel in singles:
        at = np.searchsorted(codes, 2 * spots.index[texel])
        share = shown.shares[at][shown.points[at] == own[int(texel)]]
        assert share.max() == BYTE
