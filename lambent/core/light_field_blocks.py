"""Maps of a light field in blocks of BC6H: a byte per texel. Importing this file imports numba.

Blocks are of tiles, maps with a border of one texel and what fills the last blocks, so that a renderer can show them as
they are: maps of 222 texels a side are 56 x 56 blocks, and nothing is filled.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.bc6h import BLOCK, decoded, encoded
from lambent.core.light_field_tiles import tiled, up


def blocks_of(maps: NDArray[Any]) -> NDArray[np.uint32]:
    """(P, B, B, 4) of maps (P, E, E, 3): 4 B is the first multiple of 4 from E + 2 on."""
    return encoded(tiled(maps, up(maps.shape[1] + 2, BLOCK)))


def blocks_shape(side: int) -> tuple[int, int, int]:
    """(B, B, 4) of maps of so many texels a side."""
    return up(side + 2, BLOCK) // BLOCK, up(side + 2, BLOCK) // BLOCK, 4


def maps_of(blocks: NDArray[np.uint32], side: int) -> NDArray[np.float16]:
    """(P, E, E, 3) of blocks (P, B, B, 4); `side` is E."""
    if up(side + 2, BLOCK) != BLOCK * blocks.shape[1]:
        raise ValueError(f"{blocks.shape[1]} blocks in a row do not hold maps of {side} texels")
    return decoded(blocks)[:, 1 : side + 1, 1 : side + 1]
