"""Order of evaluation of pixels, and the evaluated pixels from which each is predicted.

Pixels of one pass are independent of each other (Ben-Artzi 2007, section 8.6.1 and figure 8.4).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lambent.core.arrays import Indices

SPACING = 16  # pixels of the coarsest grid
OUTSIDE = -1
STRAIGHT, DIAGONAL = ((-1, 0), (0, -1), (0, 1), (1, 0)), ((-1, -1), (-1, 1), (1, -1), (1, 1))


@dataclass(frozen=True)
class Pass:
    """Pixels (n,), row * width + column, and the pixels that inform them (n, k), padded with OUTSIDE; k may be 0."""

    pixels: Indices
    informers: Indices
    finest: bool = False  # whether this is the last pass of the grid


def scanline(width: int, height: int) -> Iterator[Pass]:
    """Each pixel is informed by its left, upper and upper left neighbour; passes are independent diagonals."""
    row, column = np.divmod(np.arange(width * height), width)
    yield _pass(np.flatnonzero((row == 0) | (column == 0)), (), width, height)
    for diagonal in range(2, width + height - 1):
        r = np.arange(max(1, diagonal - width + 1), min(height, diagonal))
        yield _pass(r * width + diagonal - r, ((0, -1), (-1, -1), (-1, 0)), width, height)


def grid(width: int, height: int) -> Iterator[Pass]:
    """Coarse to fine: the centres of squares of evaluated pixels, then the midpoints of their sides."""
    row, column = np.divmod(np.arange(width * height), width)
    yield _pass(np.flatnonzero((row % SPACING == 0) & (column % SPACING == 0)), (), width, height)
    step = SPACING // 2
    while step:
        r, c = row % (2 * step), column % (2 * step)
        yield _pass(np.flatnonzero((r == step) & (c == step)), DIAGONAL, width, height, step)
        sides = np.flatnonzero(((r == 0) & (c == step)) | ((r == step) & (c == 0)))
        yield _pass(sides, STRAIGHT, width, height, step, finest=step == 1)
        step //= 2


def side_by_side(width: int, height: int) -> Pass:
    """All pixels, each informed by its neighbours along the sides."""
    return _pass(np.arange(width * height), STRAIGHT, width, height)


def _pass(
    pixels: Indices, offsets: tuple[tuple[int, int], ...], width: int, height: int, step: int = 1, finest: bool = False
) -> Pass:
    shift = step * np.array(offsets, np.int64).reshape(-1, 2)
    row, column = pixels[:, None] // width + shift[:, 0], pixels[:, None] % width + shift[:, 1]
    inside = (row >= 0) & (row < height) & (column >= 0) & (column < width)
    return Pass(pixels, np.where(inside, row * width + column, OUTSIDE), finest)
