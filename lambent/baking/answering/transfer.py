"""Light between points that send and gather it, and between the patches that they lie in."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from lambent.baked.answering.rays import Rays, packed_rays, weights_of_bytes
from lambent.baking.answering.patches import Clusters
from lambent.baking.answering.points import GatherPoints
from lambent.baking.answering.rays import NOWHERE, RayEnds
from lambent.baking.answering.spots import Spots
from lambent.baking.running.tiles import seed_of
from lambent.baking.surfaces.texels import Sides
from lambent.core.arrays import Flags, Floats, Indices, sums_of

AROUND = 16  # texels that the rays of a point start from
STRIDE = 8  # of the texels that viewers see, whose rays count for how important others are


class Between:
    """Rays between points that send light, from these and from others."""

    def __init__(
        self, ends: RayEnds, spots: Spots, sides: list[Sides], senders: Indices, exitance: Floats, count: int
    ) -> None:
        size = sides[0].texels.width * sides[0].texels.height
        self._ends, self._sides = ends, sides
        self._sender = np.full(2 * size, -1)
        for side in range(2):
            self._sender[spots.index * 2 + side] = senders[side]
        self._sent = sender_means(spots, senders, exitance.sum(axis=0)[..., None], count)[:, 0]

    def gathered_rays(
        self, points: GatherPoints, starts: Indices, count: int, kept: int, seed: int
    ) -> NDArray[np.uint8]:
        """`packed_rays` (n, kept, 3) of points, which send light or do not, chosen of `count` from texels (n, m)."""
        side = points.side
        found = np.zeros((len(side), kept, 3), np.uint8)
        for one in range(2):
            mine = np.flatnonzero(side == one)
            if len(mine):
                ends = self._ends.from_texels(self._sides[one], starts[mine], count, seed_of(seed, "gather", one))
                there = ends[0] != NOWHERE
                at = np.where(there, ends[0], 0)
                met = np.where(there, self._sender[at], -1)
                weight = np.where(met >= 0, ends[1], 0.0)
                if kept < count:
                    shift = np.random.default_rng((seed, one)).random(len(mine))
                    light = weight * self._sent[np.maximum(met, 0)]
                    chosen, scale = chosen_rays(met, weight, light, kept, shift)
                    met = np.take_along_axis(met, chosen, axis=1)
                    weight = np.take_along_axis(weight, chosen, axis=1) * scale
                found[mine] = packed_rays(met, weight)
        return found


def chosen_rays(met: Indices, weight: Floats, light: Floats, kept: int, shift: Floats) -> tuple[Indices, Floats]:
    """Rays (n, kept) of all R of each point that stand for these, and factors (n, kept) of their weights.

    Chances are half by the light that rays bring and half by their weights, so that a few rays to spots of sun have not
    all the noise, and none of a dark surface counts for many. Choices are systematic, in the order of
    what rays have `met` (n, R): rays to one surface are chosen as often as they should be, but for one.

    Parameters
    ----------
    weight, light : (n, R)
        Of each ray, and times the exitance that it met.
    shift : (n,)
        Random numbers in [0, 1).
    """
    order = np.argsort(met, axis=1, kind="stable")
    chance = sum(0.5 * one / np.maximum(one.sum(axis=1, keepdims=True), 1e-30) for one in (weight, light))
    sums = np.cumsum(np.take_along_axis(np.asarray(chance), order, axis=1), axis=1)
    total = sums[:, -1:]
    at = (np.arange(kept) + shift[:, None]) / kept * total
    rows = 2 * np.arange(len(met))[:, None]  # chances of a row sum to 1 at most
    place = np.searchsorted((sums + rows).reshape(-1), (at + rows).reshape(-1), side="right").reshape(at.shape)
    place = np.minimum(place - np.arange(len(met))[:, None] * met.shape[1], met.shape[1] - 1)
    chosen = np.take_along_axis(order, place, axis=1)
    of_chosen = np.take_along_axis(np.asarray(chance), chosen, axis=1)
    return chosen, np.where(of_chosen > 0, total / np.maximum(of_chosen, 1e-30) / met.shape[1], 0.0)


def transfer_of(rays: Rays, patch: Indices, area: Floats, count: int) -> NDArray[np.float32]:
    """F (count, count): means over the points of each patch, by `area` (K,), of their rays to points of each other.

    Parameters
    ----------
    rays : Rays
        Of K points, between these.
    patch : (K,) integers
    """
    each = np.diff(rays.starts)
    weight = weights_of_bytes()[rays.weights] * np.repeat(rays.scale * area, each)
    sums = csr_matrix((weight, (np.repeat(patch, each), patch[rays.points])), shape=(count, count))
    areas = np.bincount(patch, area, count)
    shares: Floats = sums.toarray() / np.maximum(areas, 1e-30)[:, None]
    return shares.astype(np.float32)


def patch_means(spots: Spots, clusters: Clusters, values: Floats) -> Floats:
    """(P, C) means over the area of each patch of values (2, K, C); over its lit texels where it has any."""
    means, _ = _means(spots, spots.there, clusters.of, values, clusters.count)
    lit, lit_area = _means(spots, spots.lit, clusters.of, values, clusters.count)
    return np.where((lit_area > 0)[:, None], lit, means)


def sender_means(spots: Spots, senders: Indices, values: Floats, count: int) -> Floats:
    """(count, C) means over area of values (2, K, C) of the lit texels for which each of `senders` (2, K) sends."""
    return _means(spots, spots.lit, senders, values, count)[0]


def _means(spots: Spots, there: Flags, of: Indices, values: Floats, count: int) -> tuple[Floats, Floats]:
    """Means (count, C) over area of values (2, K, C) of the texels that are `there`, by number `of` (2, K); areas."""
    mine = there & (of >= 0)
    weight = np.broadcast_to(spots.area, mine.shape)[mine]
    area = np.asarray(np.bincount(of[mine], weight, count), float)
    return sums_of(weight[:, None] * values[mine], of[mine], count) / np.maximum(area, 1e-30)[:, None], area


def neighbouring_texels(spots: Spots, senders: Indices, points: GatherPoints, most: int = AROUND) -> Indices:
    """(n, most) texels for which each point sends, among `senders` (2, K): some, or all in turn; itself without any."""
    found = np.broadcast_to(points.texel[:, None], (len(points.texel), most)).copy()
    for side in range(2):
        mine = np.flatnonzero(spots.lit[side] & (senders[side] >= 0))
        mine = np.random.default_rng(side).permutation(mine)
        mine = mine[np.argsort(senders[side][mine], kind="stable")]
        of = senders[side][mine]
        first, last = np.searchsorted(of, np.arange(len(found))), np.searchsorted(of, np.arange(len(found)), "right")
        some = np.flatnonzero((last > first) & (points.side == side))
        turn = np.arange(most) % (last - first)[some][:, None]
        found[some] = mine[first[some][:, None] + turn]
    return found


def light_seen(
    ends: RayEnds, spots: Spots, sides: list[Sides], points: GatherPoints, exitance: Floats, rays: int, seed: int
) -> Floats:
    """(n,) irradiance that some points gather by a few rays from exitance (G, 2, K) of the spots."""
    size = sides[0].texels.width * sides[0].texels.height
    sent = np.zeros(2 * size)
    for side in range(2):
        sent[spots.index * 2 + side] = exitance[:, side].sum(axis=0)
    found = np.zeros(len(points.texel))
    for side, of_side in enumerate(sides):
        mine = np.flatnonzero(points.side == side)
        if len(mine):
            spot, weight = ends.from_texels(of_side, points.texel[mine], rays, seed_of(seed, "seen", side))
            met = np.where(spot == NOWHERE, 0, spot).astype(np.int64)
            found[mine] = np.where(spot == NOWHERE, 0.0, weight * sent[met]).mean(axis=1)
    return found


def hits_from_viewed(ends: RayEnds, spots: Spots, sides: list[Sides], rays: int, seed: int) -> Floats:
    """(2, K) rays that end on each texel and side, from some of the texels that viewers see."""
    texels = sides[0].texels
    number = np.full(texels.width * texels.height, -1)
    number[spots.index] = np.arange(len(spots.index))
    found = np.zeros((2, len(spots.index)))
    for side, of_side in enumerate(sides):
        mine = np.flatnonzero(spots.lit[side])[::STRIDE]
        if not len(mine):
            continue
        spot, weight = ends.from_texels(of_side, mine, rays, seed_of(seed, "importance", side))
        met = spot[spot != NOWHERE].astype(np.int64)
        area = np.broadcast_to(spots.area[mine][:, None], spot.shape)[spot != NOWHERE]
        at = number[met // 2]
        share = np.minimum(weight[spot != NOWHERE], 1) * area
        for other in range(2):
            chosen = (at >= 0) & (met % 2 == other)
            found[other] += np.bincount(at[chosen], share[chosen], len(spots.index))
    return found
