"""Stand-ins for large textures: coarse texels that arrive first, which the page enlarges to the texture's own size.

A stand-in is a coarser MIP level and those below it. Textures without levels are merged by blocks of texels. Half
floats keep 6 of the 10 bits of their mantissas: steps of 1.5 %, seen for a few seconds.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

LARGE = 1 << 16  # bytes to transfer, above which a texture has a stand-in
COARSE_LEVEL = 3  # an eighth of a side
LIGHT_LEVEL, DEPTH_LEVEL = 1, 2  # of textures without levels; charts of a light map are a few texels apart
DROPPED_BITS = 4  # of the mantissas of half floats
HALF, DEPTH, BYTE = "16float", "depth32float", "8unorm"  # formats with stand-ins end so, or go on with -srgb


def standin(format: str, size: tuple[int, int, int], levels: list[bytes]) -> tuple[int, list[bytes]] | None:
    """The level of a stand-in's finest texels, and its levels; None if a texture has none.

    `size` is columns, rows and layers; `levels` are those of the texture, of each all layers.
    """
    if len(levels) > COARSE_LEVEL and (format.endswith(HALF) or format.removesuffix("-srgb").endswith(BYTE)):
        coarse = levels[COARSE_LEVEL:]
        return COARSE_LEVEL, [_rounded(level) for level in coarse] if format.endswith(HALF) else coarse
    if len(levels) > 1 or min(size[:2]) <= 1 << DEPTH_LEVEL:
        return None
    columns, rows, layers = size
    if format.endswith(HALF):
        texels = np.frombuffer(levels[0], np.float16).reshape(layers, rows, columns, -1)
        return LIGHT_LEVEL, [_rounded(_means(texels, 1 << LIGHT_LEVEL).tobytes())]
    if format == DEPTH:
        depths = np.frombuffer(levels[0], np.float32).reshape(layers, rows, columns)
        blocks = _blocks(depths[..., None], 1 << DEPTH_LEVEL)
        return DEPTH_LEVEL, [blocks.min(axis=(2, 4)).tobytes()]  # farthest from the sun: no surface shades itself
    return None


def _means(texels: NDArray[np.float16], side: int) -> NDArray[np.float16]:
    """Means (layers, h, w, C) over blocks of texels (layers, H, W, C), but for black ones: those are outside charts."""
    blocks = _blocks(texels.astype(np.float32), side)
    lit: NDArray[np.bool_] = (blocks[..., :3] != 0).any(axis=-1, keepdims=True)
    lit |= ~lit.any(axis=(2, 4), keepdims=True)
    return np.asarray((blocks * lit).sum(axis=(2, 4)) / lit.sum(axis=(2, 4)), np.float16)


def _blocks(texels: NDArray[Any], side: int) -> NDArray[Any]:
    """(layers, h, side, w, side, C) of texels (layers, H, W, C); without the last ones, which fill no block."""
    layers, rows, columns, channels = texels.shape
    rows, columns = rows // side, columns // side
    whole = texels[:, : rows * side, : columns * side]
    return whole.reshape(layers, rows, side, columns, side, channels)


def _rounded(level: bytes) -> bytes:
    """Half floats to fewer bits, to the nearest; what would become infinite is cut off."""
    words = np.frombuffer(level, np.uint16)
    steps = words.astype(np.uint32) + (1 << DROPPED_BITS - 1)
    kept = np.where((steps & 0x7C00) == 0x7C00, words, steps)
    return (kept.astype(np.uint16) >> DROPPED_BITS << DROPPED_BITS).tobytes()
