"""Packing of a light map: charts as sets of texels, each at the first place where it fits.

A chart occupies exactly the texels that bilinear look-ups on it touch: texels of two charts may be adjacent, but never
shared. Its sides are whole numbers of texels long and pass through texel centres, so that w x h texels of surface take
(w + 1) x (h + 1).
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats, Indices

INSET = 1 / 512  # texels, from the centres of the outermost texels: rounding must not reach beyond them
FULL = 0.94  # approximate share of a map that charts fill, which determines its width
SEARCHES = 3  # heights tried, each twice the previous


def snapped(corners: Floats) -> tuple[Floats, tuple[int, int]]:
    """A chart's triangles (F, 3, 2), scaled to whole texels and wider than high, and its size (columns, rows).

    Its lowest corner is at the centre of texel (0, 0).
    """
    low = corners.reshape(-1, 2).min(axis=0)
    extent = corners.reshape(-1, 2).max(axis=0) - low
    whole = np.maximum(np.round(extent), 1)
    scale = np.divide(whole - 2 * INSET, extent, out=np.zeros(2), where=extent > 0)
    local = (corners - low) * scale + 0.5 + INSET
    if whole[1] > whole[0]:
        local, whole = local[..., ::-1], whole[::-1]
    return np.ascontiguousarray(local), (int(whole[0]) + 1, int(whole[1]) + 1)


def packed(shapes: list[tuple[Floats, tuple[int, int]]], shape: Indices) -> tuple[Indices, tuple[int, int]]:
    """Origin texel (column, row) of each chart (N, 2), and the map's size (width, height).

    `shapes` come from `snapped`; `shape` (N,) is the index of each chart's shape.
    """
    columns, rows = np.array([size for _, size in shapes], np.int64).reshape(-1, 2).T
    starts = np.append(0, np.cumsum(columns * rows))
    taken = np.zeros(int(starts[-1]), np.uint8)
    for (chart, _), start, width, height in zip(shapes, starts, columns, rows, strict=False):
        _touched(chart, int(width), int(height), taken[start : start + width * height])
    filled = np.add.reduceat(taken, starts[:-1], dtype=np.int64)[shape].sum()
    width = max(int(np.ceil(np.sqrt(filled / FULL))), int(columns.max()))
    order = np.lexsort((np.arange(len(shape)), shape, -columns[shape], -rows[shape]))
    height = int(rows.max()) + 2 * width
    for _ in range(SEARCHES):
        places, used = _placed(taken, starts, columns, rows, shape, order, width, height)
        if used:
            return places, (width, int(used))
        height += height
    raise AssertionError("rows of charts one below another fit")


@numba.njit(cache=True)
def _touched(corners: Floats, width: int, height: int, taken: NDArray[np.uint8]) -> None:
    """Mark cells less than a texel from a triangle (F, 3, 2), along rows and columns: their 2 x 2 squares meet it."""
    for f in range(len(corners)):
        t = corners[f]
        rows, columns = near(t, width, height)
        for row in range(rows[0], rows[1]):
            for column in range(columns[0], columns[1]):
                if not taken[row * width + column] and meets(t, column + 0.5, row + 0.5):
                    taken[row * width + column] = 1


@numba.njit(cache=True)
def near(t: Floats, width: int, height: int) -> tuple[tuple[int, int], tuple[int, int]]:
    """First and past-last row, and column, less than a texel from the bounding rectangle of a triangle (3, 2)."""
    low_x, high_x = min(t[0, 0], t[1, 0], t[2, 0]), max(t[0, 0], t[1, 0], t[2, 0])
    low_y, high_y = min(t[0, 1], t[1, 1], t[2, 1]), max(t[0, 1], t[1, 1], t[2, 1])
    rows = max(0, int(np.floor(low_y - 0.5))), min(height, int(np.floor(high_y + 0.5)) + 1)
    return rows, (max(0, int(np.floor(low_x - 0.5))), min(width, int(np.floor(high_x + 0.5)) + 1))


@numba.njit(cache=True)
def meets(t: Floats, x: float, y: float) -> bool:
    """Whether a triangle (3, 2) meets the square of 2 x 2 texels around a nearby (x, y)."""
    for i in range(3):  # separating axis test with the edges' normals
        a, b, c = t[i], t[(i + 1) % 3], t[(i + 2) % 3]
        nx, ny = b[1] - a[1], a[0] - b[0]
        inner = nx * (c[0] - a[0]) + ny * (c[1] - a[1])
        if inner < 0:
            nx, ny = -nx, -ny
        if nx * (x - a[0]) + ny * (y - a[1]) + abs(nx) + abs(ny) < 0:
            return False
    return True


@numba.njit(cache=True)
def _placed(
    taken: NDArray[np.uint8],
    starts: Indices,
    columns: Indices,
    rows: Indices,
    shape: Indices,
    order: Indices,
    width: int,
    height: int,
) -> tuple[Indices, int]:
    """First fit from the top, row by row; returns 0 rows if the height does not suffice.

    `busy` is the first occupied column at or after each, `free` the first free one: a chart that does not fit jumps
    past the obstacle. After a failure, further charts with the same texels are not tried there.
    """
    places = np.zeros((len(order), 2), np.int64)
    busy = np.full((height, width + 1), width, np.int32)
    free = np.zeros((height, width + 1), np.int32)
    free[:] = np.arange(width + 1)
    left = np.full(height, width)
    used, top, side, before = 0, 0, 0, taken[:0]
    for chart in order:
        w, h = columns[shape[chart]], rows[shape[chart]]
        cells = taken[starts[shape[chart]] : starts[shape[chart] + 1]]
        if w != side or len(cells) != len(before) or not (cells == before).all():
            top = 0
        side, before = w, cells
        mask = cells.reshape(h, w)
        runs = _runs(mask)
        count = np.zeros(h, np.int64)
        for row in range(h):
            count[row] = mask[row].sum()
        found = False
        for y in range(top, height - h + 1):
            possible = True
            for row in range(h):
                if left[y + row] < count[row]:
                    possible = False
                    break
            x = 0
            while possible and x + w <= width and not found:
                found = True
                for i in range(len(runs)):
                    row, first, end = runs[i]
                    at = busy[y + row, x + first]
                    if at < x + end:
                        x, found = free[y + row, at] - first, False
                        break
            if found:
                places[chart] = x, y
                top = y
                used = max(used, y + h)
                left[y : y + h] -= count
                _take(busy, free, runs, x, y)
                break
        if not found:
            return places, 0
    return places, used


@numba.njit(cache=True)
def _runs(mask: NDArray[np.uint8]) -> Indices:
    """(N, 3) row, first column, and past-last column of occupied runs; longest first."""
    found = [(0, 0, 0)]
    for row in range(mask.shape[0]):
        start = -1
        for column in range(mask.shape[1] + 1):
            is_taken = column < mask.shape[1] and mask[row, column] == 1
            if is_taken and start < 0:
                start = column
            elif not is_taken and start >= 0:
                found.append((row, start, column))
                start = -1
    runs = np.array(found[1:])
    return runs[np.argsort(runs[:, 1] - runs[:, 2], kind="mergesort")]


@numba.njit(cache=True)
def _take(busy: NDArray[np.int32], free: NDArray[np.int32], runs: Indices, x: int, y: int) -> None:
    width = busy.shape[1] - 1
    for i in range(len(runs)):
        row, first, end = y + runs[i, 0], x + runs[i, 1], x + runs[i, 2]
        after = free[row, end] if end < width else width
        for column in range(first, end):
            busy[row, column], free[row, column] = column, after
        column = first - 1
        while column >= 0 and busy[row, column] > first:
            busy[row, column] = first
            column -= 1
        column = first - 1
        while column >= 0 and busy[row, column] == column:  # occupied up to here
            free[row, column] = after
            column -= 1
