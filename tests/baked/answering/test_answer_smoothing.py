"""Points that are averaged: those that see the same, and no others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lambent.baked.answering.answer import Neighbours, Points, smoothed
from lambent.baked.answering.rays import Rays, gathered, packed_rays
from lambent.baked.answering.smoothing import alike

GATHERING, SENDING, RAYS = 40, 400, 256


def row_of_points(sees: np.ndarray) -> tuple[Points, Rays, Neighbours]:
    """Points in a row, each with three neighbours on both sides, over many more that send.

    Half of the senders are of material 0, half of material 1; a share `sees` (GATHERING,) of each point's rays ends on
    the latter.
    """
    rng, count = np.random.default_rng(5), GATHERING + SENDING
    material = np.r_[np.zeros(GATHERING, int), np.repeat([0, 1], SENDING // 2)]
    light = np.ones((1, count, 3), np.float32)
    ends = GATHERING + rng.integers(0, SENDING // 2, (count, RAYS))
    ends[:GATHERING] += SENDING // 2 * (rng.random((GATHERING, RAYS)) < sees[:, None])
    points = Points(np.zeros(count, int), material, np.arange(count), 0 * light, light)
    column = np.arange(-3, 4) + np.arange(count)[:, None]
    near = np.clip(column, 0, GATHERING - 1).astype(np.uint32)
    shares = np.where((column >= 0) & (column < GATHERING), 30, 0).astype(np.uint8)
    near[GATHERING:], shares[GATHERING:, 3] = np.arange(GATHERING, count)[:, None], 255
    return points, Rays.of(packed_rays(ends, np.ones(ends.shape))), Neighbours(near, shares)


def after_an_edit(points: Points, rays: Rays, around: Neighbours) -> np.ndarray:
    """Light of the gathering points over the baked when material 1 turns black, both averaged."""
    sent = np.zeros((len(points.material), 1, 4), np.float32)
    sent[..., :3] = 0.5
    baked = smoothed(gathered(rays, sent), around)
    sent[points.material == 1] = 0
    return np.asarray(smoothed(gathered(rays, sent), around)[:GATHERING, 0, 0] / baked[:GATHERING, 0, 0])


def itself(count: int) -> Neighbours:
    return Neighbours(np.arange(count, dtype=np.uint32)[:, None], np.full((count, 1), 255, np.uint8))


def test_noise_of_rays_is_averaged_over_points_that_see_the_same() -> None:
    points, rays, near = row_of_points(np.full(GATHERING, 0.5))
    around = alike(points, rays, np.full((2, 3), 0.5), near)
    noise = [(after_an_edit(points, rays, one) - 0.5).std() for one in (itself(len(points.material)), around)]
    assert 0.02 < noise[0] < 0.05 and noise[1] < 0.6 * noise[0]


def test_the_edge_between_points_that_see_other_surfaces_stays() -> None:
    """The second half sees material 1 alone, as the far sheet of a thin wall does."""
    points, rays, near = row_of_points(np.repeat([0.0, 1.0], GATHERING // 2))
    found = after_an_edit(points, rays, alike(points, rays, np.full((2, 3), 0.5), near))
    assert np.allclose(found, np.repeat([1.0, 0.0], GATHERING // 2), atol=1e-4)


def test_darker_neighbours_do_not_count() -> None:
    points, rays, near = row_of_points(np.full(GATHERING, 0.0))
    dim = np.where(np.arange(len(rays.scale)) % 2, rays.scale, 0.3 * rays.scale).astype(np.float32)
    around = alike(points, replace(rays, scale=dim), np.full((2, 3), 0.5), near)
    named = around.points[:GATHERING][around.shares[:GATHERING] > 0]
    rows = np.repeat(np.arange(GATHERING), (around.shares[:GATHERING] > 0).sum(axis=1))
    assert (named % 2 == rows % 2).all() and len(named) > 2 * GATHERING


def test_each_point_counts_most_for_itself() -> None:
    points, rays, near = row_of_points(np.full(GATHERING, 0.5))
    around = alike(points, rays, np.full((2, 3), 0.5), near)
    assert (around.points[:, 0] == np.arange(len(points.material))).all() and (around.shares[:, 0] == 255).all()
    assert (np.diff(around.shares.astype(int), axis=1) <= 0).all()
