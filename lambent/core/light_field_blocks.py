"""Maps of a light field in blocks: light as BC6H, a byte per texel, distances in five bits. It imports numba.

Blocks are of tiles, maps with a border of one texel and what fills the last blocks, so that a renderer can show them as
they are: maps of 310 texels a side are 78 x 78 blocks, and nothing is filled.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core import distance_blocks
from lambent.core.arrays import Flags
from lambent.core.bc6h import BLOCK, decoded, encoded
from lambent.core.light_field import LightField
from lambent.core.light_field_tiles import pool_rows, tiled, up

OPEN = 0.25  # what a texel of sky counts beside one of a surface in the same block


def blocks_of(maps: NDArray[Any], shows: Flags | None = None) -> NDArray[np.uint32]:
    """(P, B, B, 4) of maps (P, E, E, 3): 4 B is the first multiple of 4 from E + 2 on.

    Where `shows` (P, E, E) says that texels show no surface, they count as OPEN: the environment itself answers there.
    """
    size = up(maps.shape[1] + 2, BLOCK)
    importance = None if shows is None else np.where(tiled(shows[..., None], size)[..., 0], 1.0, OPEN)
    return encoded(tiled(maps, size), importance)


def blocks_shape(side: int) -> tuple[int, int, int]:
    """(B, B, 4) of maps of so many texels a side."""
    return up(side + 2, BLOCK) // BLOCK, up(side + 2, BLOCK) // BLOCK, 4


def maps_of(blocks: NDArray[np.uint32], side: int) -> NDArray[np.float16]:
    """(P, E, E, 3) of blocks (P, B, B, 4); `side` is E."""
    _held(blocks, side)
    return decoded(blocks)[:, 1 : side + 1, 1 : side + 1]


def distance_blocks_of(inverse: NDArray[np.float16], cover: NDArray[np.uint8] | None) -> NDArray[np.uint32]:
    """(P, R, B, 2) of inverse distances and cover (P, E, E): `core.distance_blocks` of tiles as of `blocks_of`."""
    size = up(inverse.shape[1] + 2, BLOCK)
    bits = None if cover is None else tiled(cover[..., None], size)[..., 0]
    return distance_blocks.encoded(tiled(inverse[..., None], size)[..., 0], bits)


def distance_blocks_shape(side: int) -> tuple[int, int, int]:
    """(R, B, 2) of maps of so many texels a side."""
    rows = up(side + 2, BLOCK) // BLOCK
    return rows + pool_rows(rows), rows, 2


def distances_of(blocks: NDArray[np.uint32], side: int) -> tuple[NDArray[np.float16], NDArray[np.uint8]]:
    """Inverse distances and cover (P, E, E) of blocks (P, R, B, 2); `side` is E."""
    _distances_held(blocks, side)
    inverse, cover = distance_blocks.decoded(blocks, up(side + 2, BLOCK) // BLOCK)
    inner = np.s_[:, 1 : side + 1, 1 : side + 1]
    return inverse[inner], cover[inner]


@dataclass(frozen=True, eq=False)
class MapsInBlocks:
    """Maps (P, E, E) or (P, E, E, C) that stay in blocks; what is read of them is decoded, whole maps at a time.

    `decode` makes maps of some of the blocks.
    """

    blocks: NDArray[np.uint32]
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    decode: Callable[[NDArray[np.uint32]], NDArray[Any]]

    @property
    def size(self) -> int:
        return math.prod(self.shape)

    @property
    def nbytes(self) -> int:
        """Of the maps when they are decoded."""
        return self.size * self.dtype.itemsize

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, key: Any, /) -> NDArray[Any]:
        """As of an array; the first index says which maps are decoded."""
        first, *rest = key if isinstance(key, tuple) else (key,)
        wanted = np.arange(len(self))[first]
        which, place = np.unique(wanted, return_inverse=True)
        return np.asarray(self.decode(self.blocks[which])[(place.reshape(np.shape(wanted)), *rest)])

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.asarray(self.decode(self.blocks), dtype)


def light_in_blocks(blocks: NDArray[np.uint32], side: int) -> MapsInBlocks:
    """Maps (P, E, E, 3) as of `maps_of`."""
    _held(blocks, side)
    return MapsInBlocks(blocks, (len(blocks), side, side, 3), np.dtype(np.float16), partial(maps_of, side=side))


def distances_in_blocks(blocks: NDArray[np.uint32], side: int) -> tuple[MapsInBlocks, MapsInBlocks]:
    """Inverse distances and cover, (P, E, E) each, as of `distances_of`."""
    _distances_held(blocks, side)
    shape = len(blocks), side, side
    return (
        MapsInBlocks(blocks, shape, np.dtype(np.float16), lambda some: distances_of(some, side)[0]),
        MapsInBlocks(blocks, shape, np.dtype(np.uint8), lambda some: distances_of(some, side)[1]),
    )


def in_blocks(field: LightField) -> LightField:
    """A light field as it is read again where its store has blocks."""
    side = field.radiance.shape[1]
    light, inverse_distance = np.asarray(field.radiance), np.asarray(field.inverse_distance)
    cover = None if field.cover is None else np.asarray(field.cover)
    shows = None if cover is None or field.volume else cover != 0
    blocks, distances = blocks_of(light, shows), distance_blocks_of(inverse_distance, cover)
    inverse, bits = distances_of(distances, side)
    return replace(
        field, radiance=maps_of(blocks, side), inverse_distance=inverse, blocks=blocks, distances=distances,
        cover=None if field.volume else bits,
    )  # fmt: skip


def _held(blocks: NDArray[np.uint32], side: int) -> None:
    if up(side + 2, BLOCK) != BLOCK * blocks.shape[1]:
        raise ValueError(f"{blocks.shape[1]} blocks in a row do not hold maps of {side} texels")


def _distances_held(blocks: NDArray[np.uint32], side: int) -> None:
    if blocks.shape[1:] != distance_blocks_shape(side):
        raise ValueError(f"blocks of shape {blocks.shape} do not hold distances of maps of {side} texels")
