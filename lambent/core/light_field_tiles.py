"""How the maps of a light field lie in tiles, whose borders hold what filters find beyond a map's edges.

A tile of `tile` texels has a map of E texels on level 0 from texel (1, 1) on. On level k it has tile/2^k texels, all
but a border of one of them a map again: levels are filtered within maps, and never across tiles.
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

LEAST_TILE = 7  # texels of the coarsest level: 5 of a map, 0.5 sr each
WASTE = 1.06  # a tile may be longer than map and border by this factor, so that it can be halved more often


@dataclass(frozen=True)
class Tiles:
    """Tiles of maps of `side` texels."""

    side: int
    tile: int
    levels: int

    @classmethod
    def of(cls, side: int) -> Tiles:
        """The tile that can be halved most often of those that are not much longer than the map and its border."""
        least = side + 2
        levels = max(
            k for k in range(12) if k == 0 or (up(least, 1 << k) <= WASTE * least and least >> k >= LEAST_TILE)
        )
        return cls(side, up(least, 1 << levels), levels + 1)

    def inner(self, level: int) -> int:
        """Texels of a map's side on a level."""
        return self.side if level == 0 else (self.tile >> level) - 2

    def chain(self, maps: NDArray[Any]) -> Iterator[NDArray[np.float32]]:
        """Tiles (P, t, t, C) of every level of maps (P, E, E, C), from fine to coarse; t = tile/2^level.

        A texel is the mean of what it covers of the level before, weighted by solid angle: all levels have the same
        light.
        """
        level = np.asarray(maps, np.float32)
        for k in range(self.levels):
            if k:
                level = _resampled(level, self.inner(k))
            yield tiled(level, self.tile >> k)


def tiled(maps: NDArray[Any], size: int) -> NDArray[Any]:
    """Tiles (P, size, size, C) with maps (P, E, E, C) from texel (1, 1) on, and what lies beyond them around."""
    beyond = size - maps.shape[1] - 1  # on the right and below, where a tile may be longer than map and border
    return np.asarray(bordered(maps, beyond)[:, beyond - 1 :, beyond - 1 :])


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
