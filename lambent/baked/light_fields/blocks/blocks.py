"""Block compression of a light field's maps: light as BC6H (8 bits per texel), distances in 5 bits. Imports numba.

Blocks hold tiles: maps with a border of one texel, padded to whole blocks, so that a renderer can use them directly.
Maps of 310 texels a side fill 78 x 78 blocks without padding.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.baked.light_fields.blocks import distances as distance_blocks
from lambent.baked.light_fields.blocks.bc6h import BLOCK, decoded, encoded
from lambent.baked.light_fields.blocks.tiles import pool_rows, tiled, up
from lambent.baked.light_fields.light_field import LightField
from lambent.core.arrays import Flags

OPEN = 0.25  # weight of a sky texel relative to a surface texel in the same block


def blocks_of(maps: NDArray[Any], shows: Flags | None = None) -> NDArray[np.uint32]:
    """Blocks (P, B, B, 4) uint32 of light maps (P, E, E, 3); 4 B is the least multiple of 4 from E + 2 on.

    `shows` (P, E, E) marks texels that show a surface; other texels have the weight OPEN, because rays to the sky read
    the environment itself.
    """
    size = up(maps.shape[1] + 2, BLOCK)
    importance = None if shows is None else np.where(tiled(shows[..., None], size)[..., 0], 1.0, OPEN)
    return encoded(tiled(maps, size), importance)


def blocks_shape(side: int) -> tuple[int, int, int]:
    """Shape (B, B, 4) of the blocks of a light map of `side` texels."""
    return up(side + 2, BLOCK) // BLOCK, up(side + 2, BLOCK) // BLOCK, 4


def maps_of(blocks: NDArray[np.uint32], side: int) -> NDArray[np.float16]:
    """Light maps (P, E, E, 3) float16 of blocks (P, B, B, 4); `side` is E. `ValueError` if B does not fit E."""
    _held(blocks, side)
    return decoded(blocks)[:, 1 : side + 1, 1 : side + 1]


def distance_blocks_of(inverse: NDArray[np.float16], cover: NDArray[np.uint8] | None) -> NDArray[np.uint32]:
    """Blocks (P, R, B, 2) of inverse distances, 1/m, and cover (P, E, E); see `baked.light_fields.blocks.distances`."""
    size = up(inverse.shape[1] + 2, BLOCK)
    bits = None if cover is None else tiled(cover[..., None], size)[..., 0]
    return distance_blocks.encoded(tiled(inverse[..., None], size)[..., 0], bits)


def distance_blocks_shape(side: int) -> tuple[int, int, int]:
    """Shape (R, B, 2) of the blocks of a distance map of `side` texels."""
    rows = up(side + 2, BLOCK) // BLOCK
    return rows + pool_rows(rows), rows, 2


def distances_of(blocks: NDArray[np.uint32], side: int) -> tuple[NDArray[np.float16], NDArray[np.uint8]]:
    """Inverse distances, 1/m, and cover (P, E, E) of blocks (P, R, B, 2); `side` is E.

    Raises `ValueError` if the blocks' shape does not fit E.
    """
    _distances_held(blocks, side)
    inverse, cover = distance_blocks.decoded(blocks, up(side + 2, BLOCK) // BLOCK)
    inner = np.s_[:, 1 : side + 1, 1 : side + 1]
    return inverse[inner], cover[inner]


@dataclass(frozen=True, eq=False)
class MapsInBlocks:
    """Maps (P, E, E) or (P, E, E, C) that stay in blocks; reading decodes whole maps.

    `decode` converts blocks of some maps to these maps.
    """

    blocks: NDArray[np.uint32]
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    decode: Callable[[NDArray[np.uint32]], NDArray[Any]]

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, key: Any, /) -> NDArray[Any]:
        """Index like an array; the first index selects the maps to decode."""
        first, *rest = key if isinstance(key, tuple) else (key,)
        wanted = np.arange(len(self))[first]
        which, place = np.unique(wanted, return_inverse=True)
        return np.asarray(self.decode(self.blocks[which])[(place.reshape(np.shape(wanted)), *rest)])

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.asarray(self.decode(self.blocks), dtype)


def light_in_blocks(blocks: NDArray[np.uint32], side: int) -> MapsInBlocks:
    """Light maps (P, E, E, 3), decoded by `maps_of` on demand. `ValueError` if the blocks do not fit `side`."""
    _held(blocks, side)
    return MapsInBlocks(blocks, (len(blocks), side, side, 3), np.dtype(np.float16), partial(maps_of, side=side))


def distances_in_blocks(blocks: NDArray[np.uint32], side: int) -> tuple[MapsInBlocks, MapsInBlocks]:
    """Inverse distances, 1/m, and cover, (P, E, E) each, decoded by `distances_of` on demand."""
    _distances_held(blocks, side)
    shape = len(blocks), side, side
    return (
        MapsInBlocks(blocks, shape, np.dtype(np.float16), lambda some: distances_of(some, side)[0]),
        MapsInBlocks(blocks, shape, np.dtype(np.uint8), lambda some: distances_of(some, side)[1]),
    )


def in_blocks(field: LightField) -> LightField:
    """The light field as a store with blocks would return it: compressed once and decoded."""
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
