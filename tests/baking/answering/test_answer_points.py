"""Points that gather light: one for each block, smaller blocks where surfaces are close."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.baked.answering.rays import BYTE, MOST_POINTS, Rays, packed_rays
from lambent.baking.answering.patches import clustered
from lambent.baking.answering.points import (
    MORE,
    MORE_RECEIVERS,
    GatherPoints,
    bounded_points,
    gather_points,
    neighbours,
    receiving_points,
    refined_points,
    seeing,
)
from lambent.baking.answering.spots import LEAST, Spots, in_few_charts
from lambent.baking.answering.transfer import AROUND, chosen_rays, neighbouring_texels, sender_means, transfer_of
from lambent.materials.document import Material
from lambent.scenes.scene import Scene

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


def test_both_sides_send_light_and_let_it_through() -> None:
    """Two materials, the second of which is black: it counts as if it reflected LEAST."""
    spots, half = plane(), np.arange(SIZE * SIZE) % 2
    light = np.array([[3.0, 7.0], [0.5, 0.0]], np.float32)  # by group and side
    irradiance = np.broadcast_to(light[..., None, None], (2, 2, SIZE * SIZE, 3))
    sheet = Material(kd=(0.5, 0.5, 0.5), kt_d=(0.25, 0.25, 0.25))
    scene = Scene("sheets", (), {"sheet": sheet, "black": Material()})
    found = replace(spots, irradiance=irradiance, material=half).exitance(scene)
    through = (0.5 + LEAST) * light + 0.25 * light[:, ::-1]
    assert np.allclose(found[..., half == 0], through[..., None]) and found.shape == (2, 2, SIZE * SIZE)
    assert np.allclose(found[..., half == 1], LEAST * light[..., None])


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
    finest = gather_points(spots, SIZE, 1)
    assert refined_points(spots, SIZE, finest, np.full(len(finest.texel), 0.1)) is finest


def test_more_charts_than_points_have_names_share_theirs_by_object() -> None:
    side = 384  # a chart for each texel
    row, column = np.divmod(np.arange(side * side), side)
    lit, one = np.ones((2, side * side), bool), np.zeros((1, 1, 1, 3), np.float32)
    position, objects = np.stack([column, 0 * row, row], axis=-1).astype(float), row // 96
    up, every = np.tile([0.0, 1.0, 0.0], (side * side, 1)), np.arange(side * side)
    spots = Spots(lit, lit, one, one, one[0], np.ones(side * side), objects, objects, every, position, up, every)
    few = in_few_charts(spots)
    found = bounded_points(few, side, 1, 1000)
    assert len(found.texel) <= MOST_POINTS and set(few.chart.tolist()) == {0, 1, 2, 3}
    codes, _ = neighbours(few, found)
    assert len(codes) == 2 * side * side, "every texel answers"
    many = replace(spots, object=every)
    assert not in_few_charts(many).chart.any() and len(bounded_points(in_few_charts(many), side, 1, 1000).texel) > 1000


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


def test_points_that_gather_alone_are_others_and_finer() -> None:
    spots = plane()
    coarse = gather_points(spots, SIZE, 4)
    away = 2 * (spots.position[coarse.texel, 0] + 0.5)  # from a wall at the left border
    senders = refined_points(spots, SIZE, coarse, away)
    found = receiving_points(spots, SIZE, coarse, away, senders)
    assert len(found.texel) and not np.isin(found.texel, senders.texel).any()
    both = senders.followed_by(found)
    assert len(both.texel) <= MORE_RECEIVERS * len(coarse.texel) + len(senders.texel)
    assert np.isin(np.arange(SIZE) * SIZE, both.texel).all(), "each texel at the wall has its own"


def test_blind_points_are_left_out_unless_all_are() -> None:
    spots = plane()
    spots = replace(spots, direct=np.zeros_like(spots.direct))
    points = gather_points(spots, SIZE, 4)
    seen = np.ones(len(points.texel))
    seen[:5] = 0
    assert np.array_equal(seeing(spots, points, seen).texel, points.texel[5:])
    assert np.array_equal(seeing(spots, points, 0 * seen).texel, points.texel)


def test_texels_show_points_of_their_own_sheet() -> None:
    """A second sheet, close behind the first, has a point at each texel: none is shown on the first."""
    one = plane()
    count = len(one.area)
    behind = one.position + np.array([0.0, 1.0, 0.0])
    both = {
        name: np.concatenate([getattr(one, name)] * 2, axis=-2 if name in ("irradiance", "direct", "sun") else -1)
        for name in ("lit", "there", "irradiance", "direct", "sun", "area", "object", "material")
    }
    chart, index = np.repeat([0, 1], count), np.arange(2 * count)
    spots = replace(
        one, **both, chart=chart, position=np.concatenate([one.position, behind]),
        normal=np.tile(one.normal, (2, 1)), index=index,
    )  # fmt: skip
    first = gather_points(one, SIZE, 4)
    second = GatherPoints(np.zeros(count, np.int64), np.arange(count, 2 * count), np.ones(count, np.int64))
    _, shown = neighbours(spots, first.followed_by(second))
    own = shown.shares * (shown.points < len(first.texel))
    assert (own[:count].sum(axis=1) == shown.shares[:count].sum(axis=1)).all()


def test_rays_of_a_point_start_from_all_texels_that_it_stands_for() -> None:
    spots = plane()
    points = gather_points(spots, SIZE, 4)
    senders = np.full((2, len(spots.area)), -1)
    row, column = np.divmod(np.arange(len(spots.area)), SIZE)
    block = (row // 4) * (SIZE // 4) + column // 4
    senders[0] = np.argsort(block[points.texel])[block]
    found = neighbouring_texels(spots, senders, points)
    assert found.shape == (len(points.texel), AROUND)
    for k in range(len(points.texel)):
        assert np.array_equal(np.sort(found[k]), np.flatnonzero(senders[0] == k)), "all 16 of a block, each once"
    few = neighbouring_texels(spots, senders, points, 4)
    assert all(len(set(one)) == 4 and (senders[0, one] == k).all() for k, one in enumerate(few))
    senders[0, senders[0] == 3] = -1
    assert (neighbouring_texels(spots, senders, points)[3] == points.texel[3]).all(), "itself if it stands for none"


def test_chosen_rays_stand_for_all() -> None:
    """Sums over chosen rays are those over all, for the light as it was and as it is after an edit."""
    rng = np.random.default_rng(0)
    met = rng.integers(-1, 30, (400, 256))
    weight = rng.random(met.shape) * (met >= 0)
    exitance = rng.random(30) ** 6  # a few are bright
    light = weight * exitance[np.maximum(met, 0)]
    chosen, scale = chosen_rays(met, weight, light, 64, rng.random(400))
    kept = np.take_along_axis(weight, chosen, axis=1) * scale
    at = np.maximum(np.take_along_axis(met, chosen, axis=1), 0)
    for sent in (exitance, rng.random(30)):
        whole, found = (weight * sent[np.maximum(met, 0)]).mean(axis=1), (kept * sent[at]).mean(axis=1)
        assert np.abs(found.mean() / whole.mean() - 1) < 0.01 and np.std(found / whole) < 0.06
    assert kept.max() <= 2.1 * weight.mean(axis=1).max()


def test_points_send_the_mean_light_of_their_lit_texels() -> None:
    """Half of a square is in the sun; its senders are columns, and one of their texels has no light."""
    spots = plane()
    column = spots.position[:, 0].astype(int)
    senders = np.stack([np.minimum(column, 3), np.full(len(column), -1)])
    light = np.zeros((2, len(column), 1))
    light[0, :, 0] = np.where(spots.position[:, 2] < SIZE / 2, 8.0, 2.0)
    unlit = spots.lit.copy()
    unlit[0, 0], light[0, 0] = False, 1e6
    spots = replace(spots, lit=unlit, area=np.where(spots.position[:, 2] < SIZE / 2, 3.0, 1.0))
    found = sender_means(spots, senders, light, 5)[:, 0]
    sunny, shady = 3.0 * SIZE / 2, 1.0 * SIZE / 2
    first = (8.0 * (sunny - 3) + 2.0 * shady) / (sunny - 3 + shady)
    assert np.allclose(found, [first, 6.5, 6.5, 6.5, 0.0])


def test_transfer_between_patches_is_that_of_their_points() -> None:
    """Two points of the first patch, one three times as large, and one of the second, which sees nothing of itself."""
    point = np.array([[0, 2, 2, 2], [1, 1, 2, 2], [0, 0, 1, 1]])
    weight = np.array([[1.0, 1, 1, 0], [1, 1, 2, 2], [1, 1, 1, 1]])
    found = transfer_of(Rays.of(packed_rays(point, weight)), np.array([0, 0, 1]), np.array([1.0, 3.0, 9.0]), 3)
    assert np.allclose(found, [[(1 + 3 * 2) / 16, (2 + 3 * 4) / 16, 0], [1, 0, 0], [0, 0, 0]])


@pytest.mark.parametrize("crossed", [False, True])
def test_patches_are_as_many_as_asked_on_both_sides_together(crossed: bool) -> None:
    spots = plane()
    there = np.stack([spots.there[0], np.full(SIZE * SIZE, crossed)])
    found = clustered(replace(spots, lit=there, there=there), np.ones(there.shape), 20)
    front, back = found.of
    assert found.count == 20 and len(np.unique(front)) == (10 if crossed else 20)
    assert (found.paired[front] == (back if crossed else front)).all() and ((back >= 0) == crossed).all()
