"""Tiles of a light field's maps: each map with a border that holds the texels filters read beyond its edges.

A tile of level k has a map of `sides[k]` texels from texel (1, 1) on. Each level's side is about a quarter of the
previous: all but the finest take a fifteenth of its memory, where halving would take a third.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.geometry.octahedral import bordered, texel_solid_angles

BLOCK = 4  # tile sides are multiples of this, as block formats require
STEP = 4  # ratio of sides between levels
COARSEST = 10  # texels a side below which no level follows
MOST_LEVELS = 5  # for maps of `light_field.MOST_TEXELS`
POOL = 0.31  # rows of the pool of distance blocks, over rows of blocks


@dataclass(frozen=True)
class Tiles:
    """Tiles of maps; `sides` are the map's texels a side by level, from fine to coarse."""

    sides: tuple[int, ...]

    @classmethod
    def of(cls, side: int) -> Tiles:
        """Tiles of maps of `side` texels."""
        sides = [side]
        while sides[-1] > COARSEST:
            sides.append(up(up(sides[-1], STEP) // STEP + 2, BLOCK) - 2)
        return cls(tuple(sides))

    @property
    def tiles(self) -> tuple[int, ...]:
        """Texels a side of the tile by level."""
        return tuple(up(side + 2, BLOCK) for side in self.sides)

    @property
    def texels(self) -> int:
        """Texels of one map's tiles on all levels."""
        return sum(tile**2 for tile in self.tiles)

    def chain(self, maps: NDArray[Any]) -> Iterator[NDArray[np.float32]]:
        """Tiles (P, t, t, C) of every level of maps (P, E, E, C), from fine to coarse.

        Each texel is the mean of the texels it covers on the previous level, weighted by solid angle, so all levels
        have equal flux.
        """
        level = np.asarray(maps, np.float32)
        for side, tile in zip(self.sides, self.tiles, strict=True):
            if side != level.shape[1]:
                level = _resampled(level, side)
            yield tiled(level, tile)


def tiled(maps: NDArray[Any], size: int) -> NDArray[Any]:
    """Tiles (P, size, size, C): maps (P, E, E, C) from texel (1, 1) on, surrounded by the texels beyond their edges."""
    beyond = size - maps.shape[1] - 1  # on the right and below, where a tile may exceed map and border
    return np.asarray(bordered(maps, beyond)[:, beyond - 1 :, beyond - 1 :])


def pool_rows(rows: int) -> int:
    """Rows of the pool that follows `rows` rows of blocks."""
    return int(np.ceil(POOL * rows))


def up(number: int, step: int) -> int:
    """Round a number up to a multiple of `step`."""
    return -(-number // step) * step


def _resampled(maps: Floats, n: int) -> NDArray[np.float32]:
    """Resample maps (P, E, E, C) to n texels a side."""
    share, omega, whole = _shares(maps.shape[1], n)
    light = np.einsum("ij,pjkc->pikc", share, maps * omega[..., None], optimize=True)
    return np.asarray(np.einsum("lk,pikc->pilc", share, light, optimize=True) / whole[..., None])


@cache
def _shares(side: int, n: int) -> tuple[Floats, Floats, Floats]:
    """(n, side) weight of each source texel in each of n along a row; solid angles of both."""
    edges, texel = np.linspace(0, side, n + 1), np.arange(side)
    share = np.clip(np.minimum(edges[1:, None], texel + 1) - np.maximum(edges[:-1, None], texel), 0, 1)
    share = share.astype(np.float32)
    omega = texel_solid_angles(side).astype(np.float32)
    return share, omega, share @ omega @ share.T
