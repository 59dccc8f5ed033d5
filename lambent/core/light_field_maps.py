"""Reading a light field: the points near a place on the surface, and what their octahedral maps hold along directions.

numpy's version of the renderer's shaders, tested for parity with them. Points are named by their index, (...) integers;
directions (..., 3) need not be unit.
"""

from __future__ import annotations

import numpy as np

from lambent.core.arrays import Floats, Indices
from lambent.core.light_field import LightField
from lambent.core.octahedral import to_square


def nearest_points(field: LightField, uv2: Floats) -> Indices:
    """(..., 4) points that the sample map names at places uv2 (..., 2) of the light map, nearest first, or NO_POINT.

    The nearest texel is read; beyond the map's rectangle, that of its edge.
    """
    rows, columns = field.grid
    column = np.floor(uv2[..., 0] * columns).astype(np.int64) - field.corner[1]
    row = np.floor(uv2[..., 1] * rows).astype(np.int64) - field.corner[0]
    height, width = field.sample_map.shape[:2]
    found = field.sample_map[row.clip(0, height - 1), column.clip(0, width - 1)]
    return np.asarray(found, np.int64)


def radiance_along(field: LightField, point: Indices, w: Floats) -> Floats:
    """(..., 3) radiance that points see along directions: bilinear between the four nearest texels."""
    n = field.radiance.shape[1]
    at = to_square(w) * n - 0.5
    low = np.floor(at)
    share = at - low
    column, row = low[..., 0].astype(np.int64), low[..., 1].astype(np.int64)
    total = np.zeros(w.shape)
    for i in (0, 1):
        for j in (0, 1):
            weight = np.abs(1 - j - share[..., 0]) * np.abs(1 - i - share[..., 1])
            total += weight[..., None] * field.radiance[point, *_on_map(row + i, column + j, n)]
    return total


def nearness_along(field: LightField, point: Indices, w: Floats) -> Floats:
    """(...) inverse distance, 1/m, of what points see in the texels nearest to directions; 0 for the sky."""
    n = field.inverse_distance.shape[1]
    at = np.minimum((to_square(w) * n).astype(np.int64), n - 1)
    return np.asarray(field.inverse_distance[point, at[..., 1], at[..., 0]], np.float64)


def _on_map(row: Indices, column: Indices, n: int) -> tuple[Indices, Indices]:
    """Texels at most one beyond the edges, as those of the map that lie there: mirrored, as `octahedral.bordered`."""
    row_beyond, column_beyond = (row < 0) | (row >= n), (column < 0) | (column >= n)
    row, column = row.clip(0, n - 1), column.clip(0, n - 1)
    return np.where(column_beyond, n - 1 - row, row), np.where(row_beyond, n - 1 - column, column)
