"""Distances in blocks: close on surfaces, exact about the sky, and no worse than told where the pool is too small."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.baked.light_fields.blocks.blocks import (
    MapsInBlocks,
    distance_blocks_of,
    distance_blocks_shape,
    distances_in_blocks,
    distances_of,
)
from lambent.baked.light_fields.blocks.distances import decoded, encoded
from lambent.baked.light_fields.blocks.tiles import pool_rows

N = 96
Y, X = np.mgrid[0:N, 0:N] / N
RNG = np.random.default_rng(3)
FLOOR = 0.01 + 3 * Y  # planes are linear in 1/m; as far as 100 m
EDGE = np.where(X + 0.3 * Y > 0.7, 8.0, 0.05 + 0.02 * Y)  # of 12 cm before 20 m
NOISE = np.exp(RNG.uniform(-5, 3, (N, N)))  # each texel another distance


def off(inverse: np.ndarray, cover: np.ndarray | None = None) -> np.ndarray:
    """Relative errors of decoded distances."""
    found, _ = decoded(encoded(inverse[None].astype(np.float16), None if cover is None else cover[None]), N // 4)
    return np.asarray(np.abs(found[0] / inverse - 1))


@pytest.mark.long
def test_surfaces_stay_where_they_are() -> None:
    """Planes to a step of 1/7 of a block at most; edges, which have entries of the pool, to the steps of a code."""
    assert off(FLOOR)[8:].max() < 0.02, "far from the horizon"
    assert off(EDGE).max() < 0.03 and np.median(off(EDGE)) < 0.01
    assert np.median(off(NOISE)) < 0.17, "next to nothing has an entry"


def test_the_sky_is_the_sky() -> None:
    inverse = np.where(X > 0.503, FLOOR, 0)[None].astype(np.float16)
    found, cover = decoded(encoded(inverse, None), N // 4)
    np.testing.assert_array_equal(found > 0, inverse > 0)
    np.testing.assert_array_equal(cover, np.where(inverse > 0, 15, 0))
    assert not encoded(np.zeros((2, N, N), np.float16), None)[:, : N // 4].any()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1.0])
def test_what_is_no_distance_is_sky(bad: float) -> None:
    inverse = np.full((1, 8, 8), bad, np.float16)
    inverse[0, :, 4:] = 2.0
    found, cover = decoded(encoded(inverse, None), 2)
    np.testing.assert_allclose(found[0], np.where(np.arange(8) >= 4, 2.0, 0)[None].repeat(8, 0), rtol=1e-2)
    assert not cover[0, :, :4].any()


def test_quarters_are_exact_as_far_as_the_pool_reaches() -> None:
    """A skyline; where everything is mixed, what is left shows the sky or a surface as most of its quarters do."""
    cover = np.where(0.52 + 0.1 * np.sin(9 * X) < Y, 15, 0).astype(np.uint8)
    line = np.diff(cover, axis=0, append=15) != 0
    cover[line] = RNG.integers(1, 15, line.sum())
    inverse = np.where(cover > 0, FLOOR, 0)
    blocks = encoded(inverse[None].astype(np.float16), cover[None])
    found, bits = decoded(blocks, N // 4)
    np.testing.assert_array_equal(bits[0], cover)
    assert np.abs(found[0][cover > 0] / inverse[cover > 0] - 1).max() < 0.05

    everywhere = RNG.integers(0, 16, (N, N)).astype(np.uint8)
    _, bits = decoded(encoded(FLOOR[None].astype(np.float16), everywhere[None]), N // 4)
    most = np.where(np.unpackbits(everywhere[..., None], axis=2).sum(axis=2) >= 2, 15, 0)
    exact = (bits[0] == everywhere).reshape(N // 4, 4, N // 4, 4).all(axis=(1, 3))
    assert exact.sum() >= pool_rows(N // 4) * N // 4 - 1
    left = ~exact.repeat(4, 0).repeat(4, 1)
    assert left.any()
    np.testing.assert_array_equal(bits[0][left], most[left])


@pytest.mark.parametrize("side", [8, 11, 30, 94, 310])
def test_maps_of_any_side_come_back(side: int) -> None:
    inverse = np.exp(RNG.uniform(-1, 0, (2, side, side))).astype(np.float16)
    blocks = distance_blocks_of(inverse, None)
    assert blocks.shape[1:] == distance_blocks_shape(side)
    found, cover = distances_of(blocks, side)
    assert found.shape == inverse.shape and (cover == 15).all()
    np.testing.assert_array_equal(distance_blocks_of(inverse[1:], None), blocks[1:])
    with pytest.raises(ValueError, match="do not hold"):
        distances_of(blocks, side + 4)


def test_maps_in_blocks_read_as_arrays_and_decode_what_is_read() -> None:
    """By one map, slices, lists and arrays of indices; maps that are not read stay in blocks."""
    inverse = np.stack([FLOOR, EDGE, FLOOR.T, NOISE])[:, :22, :22].astype(np.float16)
    blocks = distance_blocks_of(inverse, None)
    exact = distances_of(blocks, 22)[0]
    maps, cover = distances_in_blocks(blocks, 22)
    assert maps.shape == exact.shape and maps.dtype == exact.dtype
    picked = np.array([[3, 1], [1, 0]])
    for key in (2, -1, slice(1, 3), [0, 3], picked, (picked, picked + 1, 5), np.s_[1:3, ::2]):
        np.testing.assert_array_equal(maps[key], exact[key])
    np.testing.assert_array_equal(np.asarray(maps), exact)
    assert (np.asarray(cover) == 15).all()
    read = []
    counting = MapsInBlocks(blocks, maps.shape, maps.dtype, lambda some: read.append(len(some)) or maps.decode(some))
    assert counting[[3, 1, 3]].shape == (3, 22, 22) and read == [2]
