"""Points that gather light, one for each block of a chart's texels, and which of them each texel shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lambent.bake.answering.spots import Spots
from lambent.core.answer import BYTE, MOST_POINTS, Neighbours
from lambent.core.arrays import Floats, Indices

NEAR = 8
SPREAD = 0.7  # of a block's size: distance at which a point counts by 1/e
NORMAL_M = 0.5  # metres that a unit of the normal counts for in the search
BENT = 4  # power of the cosine between normals
LEAST = 1e-6
POINTS_OF_PATCH = 4  # at least: fewer would know less of where light is than patches do


@dataclass(frozen=True, eq=False)
class GatherPoints:
    """side, texel (K,): on which side of which of `Spots` each lies."""

    side: NDArray[np.integer]
    texel: Indices


def gather_points(spots: Spots, width: int, block: int) -> GatherPoints:
    """One lit texel of each block x block texels, chart and side: the one nearest to the block's middle."""
    row, column = np.divmod(spots.index, width)
    across = width // block + 1
    cell = (row // block) * across + column // block
    middle = (block - 1) / 2
    away = (row % block - middle) ** 2 + (column % block - middle) ** 2
    sides, texels = [], []
    for side in range(2):
        mine = np.flatnonzero(spots.lit[side])
        order = mine[np.lexsort((mine, away[mine], spots.chart[mine], cell[mine]))]
        key = np.stack([cell[order], spots.chart[order]])
        first = np.ones(len(order), bool)
        first[1:] = (np.diff(key, axis=1) != 0).any(axis=0)
        texels.append(order[first])
        sides.append(np.full(int(first.sum()), side))
    return GatherPoints(np.concatenate(sides), np.concatenate(texels))


def bounded_points(spots: Spots, width: int, block: int, patches: int) -> tuple[GatherPoints, int]:
    """`gather_points` of blocks of such a size, or another, and that size.

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
    return found, block


def neighbours(spots: Spots, points: GatherPoints, block: int) -> tuple[NDArray[np.uint32], Neighbours]:
    """Texels (T,) that answer, as twice the light map's texel plus the side, and the points near each.

    Points are of the same object and side; texels of objects without any have no answer.
    """
    from scipy.spatial import KDTree

    place = np.concatenate([spots.position, NORMAL_M * spots.normal], axis=1)
    owner = spots.object * 2
    codes, near, shares = [], [], []
    point_owner = owner[points.texel] + points.side
    for side in range(2):
        for one in np.unique(point_owner[points.side == side]):
            mine = np.flatnonzero(spots.there[side] & (owner + side == one))
            known = np.flatnonzero(point_owner == one)
            count = min(NEAR, len(known))
            found = KDTree(place[points.texel[known]]).query(place[mine], k=np.arange(1, count + 1))[1]
            at = known[found]  # (n, count)
            share = _shares(spots, mine, points.texel[at], block)
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


def _shares(spots: Spots, mine: Indices, at: Indices, block: int) -> Floats:
    """(n, count) bytes, the largest of each row BYTE."""
    size = np.sqrt(spots.area[mine])[:, None] * block * SPREAD
    squared = ((spots.position[mine][:, None] - spots.position[at]) ** 2).sum(axis=-1) / np.maximum(size**2, 1e-12)
    cosine = np.maximum((spots.normal[mine][:, None] * spots.normal[at]).sum(axis=-1), 0)
    nearest = squared.min(axis=1, keepdims=True)
    weight = np.exp(nearest - squared) * (cosine**BENT + LEAST)
    return np.asarray(np.rint(weight / weight.max(axis=1, keepdims=True) * BYTE))
