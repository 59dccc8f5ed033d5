"""Maps of a light field in blocks: light as BC6H, one byte a texel, distances in five bits a texel. It imports numba.

Blocks cover tiles: maps with a border of one texel, padded to whole blocks. A renderer can upload them as they are.
Maps of 310 texels a side are 78 x 78 blocks without padding.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core import distance_blocks
from lambent.core.bc6h import BLOCK, decoded, encoded
from lambent.core.light_field import LightField
from lambent.core.light_field_tiles import pool_rows, tiled, up


def blocks_of(maps: NDArray[Any]) -> NDArray[np.uint32]:
    """Blocks (P, B, B, 4) of maps (P, E, E, 3); 4 B is the first multiple of 4 from E + 2 on."""
    return encoded(tiled(maps, up(maps.shape[1] + 2, BLOCK)))


def blocks_shape(side: int) -> tuple[int, int, int]:
    """(B, B, 4) for maps of `side` texels a side."""
    return up(side + 2, BLOCK) // BLOCK, up(side + 2, BLOCK) // BLOCK, 4


def maps_of(blocks: NDArray[np.uint32], side: int) -> NDArray[np.float16]:
    """Maps (P, E, E, 3) of blocks (P, B, B, 4); `side` is E."""
    if up(side + 2, BLOCK) != BLOCK * blocks.shape[1]:
        raise ValueError(f"{blocks.shape[1]} blocks in a row do not hold maps of {side} texels")
    return decoded(blocks)[:, 1 : side + 1, 1 : side + 1]


def distance_blocks_of(inverse: NDArray[np.float16], cover: NDArray[np.uint8] | None) -> NDArray[np.uint32]:
    """Blocks (P, R, B, 2) of inverse distances and cover (P, E, E): `core.distance_blocks` of bordered tiles."""
    size = up(inverse.shape[1] + 2, BLOCK)
    bits = None if cover is None else tiled(cover[..., None], size)[..., 0]
    return distance_blocks.encoded(tiled(inverse[..., None], size)[..., 0], bits)


def distance_blocks_shape(side: int) -> tuple[int, int, int]:
    """(R, B, 2) for maps of `side` texels a side."""
    rows = up(side + 2, BLOCK) // BLOCK
    return rows + pool_rows(rows), rows, 2


def distances_of(blocks: NDArray[np.uint32], side: int) -> tuple[NDArray[np.float16], NDArray[np.uint8]]:
    """Inverse distances and cover (P, E, E) of blocks (P, R, B, 2); `side` is E."""
    if blocks.shape[1:] != distance_blocks_shape(side):
        raise ValueError(f"blocks of shape {blocks.shape} do not hold distances of maps of {side} texels")
    inverse, cover = distance_blocks.decoded(blocks, up(side + 2, BLOCK) // BLOCK)
    inner = np.s_[:, 1 : side + 1, 1 : side + 1]
    return inverse[inner], cover[inner]


def in_blocks(field: LightField) -> LightField:
    """A light field after a round trip through a store with blocks."""
    side = field.radiance.shape[1]
    blocks, distances = blocks_of(field.radiance), distance_blocks_of(field.inverse_distance, field.cover)
    inverse, cover = distances_of(distances, side)
    return replace(
        field, radiance=maps_of(blocks, side), inverse_distance=inverse, blocks=blocks, distances=distances,
        cover=None if field.volume else cover,
    )  # fmt: skip
