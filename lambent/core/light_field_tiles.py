"""How the maps of a light field lie in tiles, whose borders hold what filters find beyond a map's edges.

A tile of level k has a map of `sides[k]` texels from texel (1, 1) on. Each level has about a quarter of the texels a
side of the one before: all but the finest take a fifteenth of its memory, where halves take a third.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.octahedral import bordered, texel_solid_angles

BLOCK = 4  # sides of tiles are multiples of this many texels, which formats in blocks hold
STEP = 4  # between the sides of levels
COARSEST = 10  # texels of a side that none coarser follows
MOST_LEVELS = 5  # of maps of `light_field.MOST_TEXELS`
POOL = 0.31  # rows of the pool of a map's distances in blocks, of those of blocks


@dataclass(frozen=True)
class Tiles:
    """Tiles of maps; `sides` are the texels of a map's side by level, from fine to coarse."""

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
        """Texels of a tile's side by level."""
        return tuple(up(side + 2, BLOCK) for side in self.sides)

    @property
    def texels(self) -> int:
        """Of a map's tiles on all levels."""
        return sum(tile**2 for tile in self.tiles)

    def chain(self, maps: NDArray[Any]) -> Iterator[NDArray[np.float32]]:
        """Tiles (P, t, t, C) of every level of maps (P, E, E, C), from fine to coarse.

        A texel is the mean of what it covers of the level before, weighted by solid angle: all levels have the same
        light.
        """
        level = np.asarray(maps, np.float32)
        for side, tile in zip(self.sides, self.tiles, strict=True):
            if side != level.shape[1]:
                level = _resampled(level, side)
            yield tiled(level, tile)


def tiled(maps: NDArray[Any], size: int) -> NDArray[Any]:
    """Tiles (P, size, size, C) with maps (P, E, E, C) from texel (1, 1) on, and what lies beyond them around."""
    beyond = size - maps.shape[1] - 1  # on the right and below, where a tile may be longer than map and border
    return np.asarray(bordered(maps, beyond)[:, beyond - 1 :, beyond - 1 :])


def pool_rows(rows: int) -> int:
    """Rows of the pool below so many rows of blocks."""
    return int(np.ceil(POOL * rows))


def up(number: int, step: int) -> int:
    """The multiple of `step` at or above a number."""
    return -(-number // step) * step


def _resampled(maps: Floats, n: int) -> NDArray[np.float32]:
    """Maps (P, E, E, C) of n texels a side."""
    share, omega, whole = _shares(maps.shape[1], n)
    light = np.einsum("ij,pjkc->pikc", share, maps * omega[..., None], optimize=True)
    return np.asarray(np.einsum("lk,pikc->pilc", share, light, optimize=True) / whole[..., None])


@cache
def _shares(side: int, n: int) -> tuple[Floats, Floats, Floats]:
    """(n, side) share of each texel along a row in each of n; solid angles of both."""
    edges, texel = np.linspace(0, side, n + 1), np.arange(side)
    share = np.clip(np.minimum(edges[1:, None], texel + 1) - np.maximum(edges[:-1, None], texel), 0, 1)
    share = share.astype(np.float32)
    omega = texel_solid_angles(side).astype(np.float32)
    return share, omega, share @ omega @ share.T
