"""Octahedral maps: all directions in one square, so that thousands of maps fit into one texture.

A direction is scaled to |x| + |y| + |z| = 1; the lower half (z < 0) is folded outwards over the edges of the square
[-1, 1]^2 (Praun and Hoppe 2003; Engelhardt and Dachsbacher 2008). Column and u grow with x, row and v with y; texel
(row, column) of a map of E texels a side has its centre at uv = ((column + 1/2)/E, (row + 1/2)/E).
Each edge of the square is joined to itself, mirrored about its middle; `bordered` uses this.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.geometry.directions import normalize


def to_square(w: Floats) -> Floats:
    """uv (..., 2) in [0, 1] of directions w (..., 3) of any length but zero."""
    p = w / np.abs(w).sum(axis=-1, keepdims=True)
    return np.asarray(_folded(p[..., :2], p[..., 2:]) / 2 + 0.5)


def from_square(uv: Floats) -> Floats:
    """Unit directions (..., 3) of uv (..., 2) in [0, 1]."""
    p = 2 * np.asarray(uv, float) - 1
    z = 1 - np.abs(p).sum(axis=-1, keepdims=True)
    return normalize(np.concatenate([_folded(p, z), z], axis=-1))


def texel_directions(n: int) -> Floats:
    """(n, n, 3) unit directions of the texels' centres."""
    centre = (np.arange(n) + 0.5) / n
    return from_square(np.stack(np.meshgrid(centre, centre), axis=-1))


def texel_solid_angles(n: int) -> Floats:
    """(n, n) solid angles of the texels, sr, by the density at their centres; their sum is 4 pi to within 1/n^2.

    The square's area element times (|x| + |y| + |z|)^3, at the unit direction, is solid angle.
    """
    return np.asarray(np.abs(texel_directions(n)).sum(axis=-1) ** 3 * (4 / (n * n)))


def bordered(maps: Any, width: int) -> Any:
    """Maps (..., E, E, C) with a border of `width` texels, for filters that read beyond an edge.

    The border continues each edge with the same edge, mirrored about its middle. Raises `ValueError` unless
    0 <= `width` <= E.
    """
    n = maps.shape[-2]
    if not 0 <= width <= n:
        raise ValueError(f"border of {width} texels around maps of {n}")
    at = np.arange(-width, n + width)
    row, column = np.meshgrid(at, at, indexing="ij")
    row_beyond, column_beyond = (row < 0) | (row >= n), (column < 0) | (column >= n)
    inner_row = np.where(row < 0, -1 - row, np.where(row >= n, 2 * n - 1 - row, row))
    inner_column = np.where(column < 0, -1 - column, np.where(column >= n, 2 * n - 1 - column, column))
    # crossing one edge mirrors the other coordinate; crossing both at a corner mirrors each twice
    found_row = np.where(column_beyond, n - 1 - inner_row, inner_row)
    found_column = np.where(row_beyond, n - 1 - inner_column, inner_column)
    return maps[..., found_row, found_column, :]


def _folded(p: Floats, z: Floats) -> Floats:
    """p (..., 2), folded over the square's diagonals where z (..., 1) is negative; its own inverse."""
    return np.where(z >= 0, p, (1 - np.abs(p[..., ::-1])) * np.where(p >= 0, 1.0, -1.0))
