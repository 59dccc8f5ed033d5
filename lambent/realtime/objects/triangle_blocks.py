"""Light maps without charts: each triangle has a block of 2 x 2 texels.

Three corners of the block are the triangle's vertices, and the fourth continues their plane, so that the bilinear
look-up is linear over the triangle.
"""

from __future__ import annotations

import numpy as np

from lambent.core.arrays import Floats

CORNERS = np.array([(0.5, 0.5), (1.5, 0.5), (0.5, 1.5)])  # of a triangle in its block, in texels


def corners_in_blocks(count: int, across: int) -> Floats:
    """(count, 3, 2) corners (column, row) of triangles, texels; blocks lie in rows of `across`."""
    row, column = np.divmod(np.arange(count), across)
    return np.asarray(2 * np.stack([column, row], axis=-1)[:, None] + CORNERS)


def filled_blocks(values: Floats, across: int) -> Floats:
    """Light map (2 rows, 2 across, C) of values (count, 3, C) at the triangles' corners, clamped to 0 or more."""
    count, _, channels = values.shape
    row, column = np.divmod(np.arange(count), across)
    texels = np.zeros((2 * -(-count // across), 2 * across, channels), np.float32)
    for k, (dy, dx) in enumerate(((0, 0), (0, 1), (1, 0))):
        texels[2 * row + dy, 2 * column + dx] = values[:, k]
    texels[2 * row + 1, 2 * column + 1] = np.maximum(values[:, 1] + values[:, 2] - values[:, 0], 0)
    return texels


def places_in_blocks(finer: int) -> Floats:
    """Weights (2 finer, 2 finer, 3) of a triangle's corners at the centres of finer texels of its block.

    Texels outside the triangle have the weights of a point on its border.
    """
    at = (np.arange(2 * finer) + 0.5) / finer - 0.5
    b, c = np.maximum(np.stack(np.meshgrid(at, at)), 0)
    total = np.maximum(b + c, 1)
    return np.stack([1 - (b + c) / total, b / total, c / total], axis=-1)
