"""Points that gather light, one for each block of a chart's texels, and which of them each texel shows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.baked.answering.answer import Neighbours
from lambent.baked.answering.rays import BYTE, MOST_POINTS
from lambent.baking.answering.spots import Spots
from lambent.core.arrays import Floats, Indices
from lambent.core.light.colour import luminance

NEAR = 8
SPREAD = 0.7  # of a block's size: distance at which a point counts by 1/e
NORMAL_M = 0.5  # metres that a unit of the normal counts for in the search
OFF_PLANE = 8.0  # a metre along the texel's normal counts for so many: sheets lie close behind one another
BENT = 4  # power of the cosine between normals
LEAST = 1e-6
BLIND = 0.05  # of the baked indirect light, that a few rays see
POINTS_OF_PATCH = 4  # at least: fewer would know less of where light is than patches do
CLOSE = 4.0  # sides of a block to the surfaces around: nearer ones make blocks smaller
MORE = 1.5  # times as many points, at most, where surfaces are close
MORE_RECEIVERS, CLOSE_RECEIVERS = 4.0, 8.0  # the same with those that gather and do not send


@dataclass(frozen=True, eq=False)
class GatherPoints:
    """side, texel (K,): on which side of which of `Spots` each lies; block (K,): texels on a side of its block."""

    side: NDArray[np.integer]
    texel: Indices
    block: Indices

    def __getitem__(self, some: Any) -> GatherPoints:
        return GatherPoints(self.side[some], self.texel[some], self.block[some])

    def followed_by(self, other: GatherPoints) -> GatherPoints:
        """These points, and others after them."""
        both = zip((self.side, self.texel, self.block), (other.side, other.texel, other.block), strict=True)
        side, texel, block = (np.concatenate(one) for one in both)
        return GatherPoints(side, texel, block)


def gather_points(spots: Spots, width: int, block: int) -> GatherPoints:
    """One lit texel of each block x block texels, chart and side: the one nearest to the block's middle."""
    lit = [np.flatnonzero(spots.lit[side]) for side in range(2)]
    side, texel = np.repeat([0, 1], [len(mine) for mine in lit]), np.concatenate(lit)
    return _in_blocks(spots, width, side, texel, np.full(len(texel), block))


def _cells(spots: Spots, mine: Indices, width: int, block: int) -> tuple[Indices, Floats]:
    """The block and chart of some texels, as one number, and their squared distances from its middle."""
    row, column = np.divmod(spots.index[mine], width)
    cell = (row // block) * (width // block + 1) + column // block
    middle = (block - 1) / 2
    away = (row % block - middle) ** 2 + (column % block - middle) ** 2
    return cell * (int(spots.chart.max(initial=0)) + 2) + spots.chart[mine] + 1, away


def bounded_points(spots: Spots, width: int, block: int, patches: int) -> GatherPoints:
    """`gather_points` of blocks of such a size, or another.

    Blocks are smaller in small maps, where there would be fewer than POINTS_OF_PATCH points for each of so many
    patches, and larger where rays could not name all points.
    """
    found = gather_points(spots, width, block)
    while len(found.texel) < POINTS_OF_PATCH * patches and block > 1:
        block //= 2
        found = gather_points(spots, width, block)
    while len(found.texel) > MOST_POINTS:
        block += max(1, block // 4)
        found = gather_points(spots, width, block)
    return found


def refined_points(spots: Spots, width: int, points: GatherPoints, distance: Floats) -> GatherPoints:
    """Points in smaller blocks where other surfaces are close: there indirect light changes from texel to texel.

    It does by the distance to these (Ward, Rubinstein and Clear 1988), so that blocks are halved in the order of
    `distance` (K,) over their size, up to MORE times as many points. Distances are harmonic means, in texels.
    """
    if not len(points.block) or points.block[0] == 1:
        return points
    most = min(int(MORE * len(points.texel)), MOST_POINTS)
    return _in_blocks(spots, width, *_halved(spots, width, points, distance, most, CLOSE))


def receiving_points(
    spots: Spots, width: int, points: GatherPoints, distance: Floats, senders: GatherPoints
) -> GatherPoints:
    """Points that gather alone, in still smaller blocks than `senders`, which `refined_points` gave.

    Together they are up to MORE_RECEIVERS times as many as `points`.
    """
    if not len(points.block) or points.block[0] == 1:
        return senders[:0]
    most = int(MORE_RECEIVERS * len(points.texel))
    found = _in_blocks(spots, width, *_halved(spots, width, points, distance, most, CLOSE_RECEIVERS))
    taken = np.zeros((2, len(spots.area)), bool)
    taken[senders.side, senders.texel] = True
    return found[~taken[found.side, found.texel]]


def seeing(spots: Spots, points: GatherPoints, seen: Floats) -> GatherPoints:
    """Points but for blind ones, which lie within or behind other surfaces: their neighbours stand for them.

    Those are blind that have `seen` (n,) less than BLIND of the indirect light of the light map, both in luminance. An
    object keeps them on a side where all are blind.
    """
    indirect = luminance((spots.irradiance - spots.direct).sum(axis=0))[points.side, points.texel]
    sees = seen >= BLIND * indirect
    owner = 2 * spots.object[points.texel] + points.side
    return points[sees | ~np.isin(owner, owner[sees])]


def _halved(
    spots: Spots, width: int, points: GatherPoints, distance: Floats, most: int, close: float
) -> tuple[Indices, Indices, Indices]:
    """Side and number of all lit texels, and sizes of their blocks: up to `most`, halved where surfaces are `close`."""
    block = int(points.block[0])
    levels = [block >> step for step in range(1, block.bit_length())]
    lit = [np.flatnonzero(spots.lit[side]) for side in range(2)]
    side, texel = np.repeat([0, 1], [len(mine) for mine in lit]), np.concatenate(lit)
    owner = _owners(spots, width, points, side, texel)
    counts = [np.ones(len(points.texel), np.int64)]
    for level in levels:
        cell = _cells(spots, texel, width, level)[0] * 2 + side
        counts.append(np.bincount(owner[np.unique(cell, return_index=True)[1]], minlength=len(points.texel)))
    sizes = np.array([block, *levels[:-1]])[:, None]
    closeness, added = distance / sizes, np.diff(np.array(counts), axis=0)
    order = np.argsort(closeness, axis=None, kind="stable")
    room = most - len(points.texel)
    halved = np.zeros(closeness.size, bool)
    fits = np.less_equal(np.cumsum(added.reshape(-1)[order]), room) & (closeness.reshape(-1)[order] < close)
    halved[order[fits]] = True
    steps = np.logical_and.accumulate(halved.reshape(closeness.shape), axis=0).sum(axis=0)
    size = np.array([block, *levels])[steps]
    return side, texel, size[owner]


def _owners(spots: Spots, width: int, points: GatherPoints, side: Indices, texel: Indices) -> Indices:
    """Number of the point in the block of each texel and side."""
    block = int(points.block[0])
    of_points = _cells(spots, points.texel, width, block)[0] * 2 + points.side
    order = np.argsort(of_points)
    return np.asarray(order[np.searchsorted(of_points[order], _cells(spots, texel, width, block)[0] * 2 + side)])


def _in_blocks(spots: Spots, width: int, side: Indices, texel: Indices, size: Indices) -> GatherPoints:
    """The texel nearest to the middle of each block, chart and side, by the size of its block."""
    found = []
    for block in np.unique(size):
        mine = np.flatnonzero(size == block)
        cell, away = _cells(spots, texel[mine], width, int(block))
        cell = cell * 2 + side[mine]
        order = np.lexsort((mine, away, cell))
        first = np.ones(len(order), bool)
        first[1:] = np.diff(cell[order]) != 0
        found.append(mine[order[first]])
    chosen = np.concatenate(found)
    chosen = chosen[np.lexsort((texel[chosen], side[chosen]))]
    return GatherPoints(side[chosen], texel[chosen], size[chosen])


def neighbours(spots: Spots, points: GatherPoints) -> tuple[NDArray[np.uint32], Neighbours]:
    """Texels (T,) that answer, as twice the light map's texel plus the side, and the points near each.

    Points are of the same object and side, and candidates are the nearest ones of all and of the texel's chart: where
    sheets lie close behind one another, the other sheet may have more points. Texels of objects without any have no
    answer.
    """
    from scipy.spatial import KDTree

    place = np.concatenate([spots.position, NORMAL_M * spots.normal], axis=1)
    by_chart = np.column_stack([place, 10 * (1 + np.ptp(spots.position)) * spots.chart])
    owner = spots.object * 2
    codes, near, shares = [], [], []
    point_owner = owner[points.texel] + points.side
    for side in range(2):
        there = np.flatnonzero(spots.there[side])
        owners = np.unique(point_owner[points.side == side])
        texels_of, points_of = _by_number(owner[there] + side, owners), _by_number(point_owner, owners)
        for mine, known in zip(texels_of, points_of, strict=True):
            mine = there[mine]
            count = min(NEAR, len(known))
            query = np.arange(1, count + 1)
            found = np.tile(KDTree(place[points.texel[known]]).query(place[mine], k=query)[1], 2)
            others = np.flatnonzero(
                (spots.chart[points.texel[known[found[:, :count]]]] != spots.chart[mine][:, None]).any(axis=1)
            )
            if len(others):  # elsewhere the nearest of all are the nearest of the chart
                of_chart = KDTree(by_chart[points.texel[known]]).query(by_chart[mine[others]], k=query)[1]
                found[others, count:] = of_chart
            found.sort(axis=1)  # files pack it well
            share = _shares(spots, mine, points, known[found])
            share[:, 1:][np.diff(found, axis=1) == 0] = 0  # named twice
            most = np.sort(np.argsort(-share, axis=1, kind="stable")[:, :count], axis=1)
            at, share = known[np.take_along_axis(found, most, axis=1)], np.take_along_axis(share, most, axis=1)
            codes.append(spots.index[mine] * 2 + side)
            near.append(np.pad(at, ((0, 0), (0, NEAR - count))))
            shares.append(np.pad(share, ((0, 0), (0, NEAR - count))))
    if not codes:
        nothing = np.zeros((0, NEAR), np.uint32)
        return np.zeros(0, np.uint32), Neighbours(nothing, nothing.astype(np.uint8))
    code, nearest, share = np.concatenate(codes), np.concatenate(near), np.concatenate(shares)
    order = np.argsort(code)
    packed = Neighbours(nearest[order].astype(np.uint32), share[order].astype(np.uint8))
    return code[order].astype(np.uint32), packed


def _by_number(numbers: Indices, wanted: Indices) -> list[Indices]:
    """Places of each wanted number, in ascending order."""
    order = np.argsort(numbers, kind="stable")
    first, end = (np.searchsorted(numbers[order], wanted, side=side) for side in ("left", "right"))
    return [order[a:b] for a, b in zip(first, end, strict=True)]


def points_near(spots: Spots, codes: NDArray[np.uint32], near: Neighbours) -> Indices:
    """(2, K) the point that counts most for each spot that answers, -1 for others."""
    found = np.full((2, len(spots.index)), -1)
    found[codes % 2, np.searchsorted(spots.index, codes // 2)] = near.closest
    return found


def _shares(spots: Spots, mine: Indices, points: GatherPoints, at: Indices) -> Floats:
    """(n, count) bytes of the points `at` (n, count); the largest of each row is BYTE."""
    texel = points.texel[at]
    away = spots.position[texel] - spots.position[mine][:, None]
    squared = (away**2).sum(axis=-1) + (OFF_PLANE * (away * spots.normal[mine][:, None]).sum(axis=-1)) ** 2
    nearest = np.take_along_axis(points.block[at], squared.argmin(axis=1)[:, None], axis=1)
    squared /= np.maximum((np.sqrt(spots.area[mine])[:, None] * nearest * SPREAD) ** 2, 1e-12)
    cosine = np.maximum((spots.normal[mine][:, None] * spots.normal[texel]).sum(axis=-1), 0)
    weight = np.exp(squared.min(axis=1, keepdims=True) - squared) * (cosine**BENT + LEAST)
    return np.asarray(np.rint(weight / weight.max(axis=1, keepdims=True) * BYTE))
