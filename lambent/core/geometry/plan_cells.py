"""Compiled loops over the cells of floor plans: plans have millions of cells, and floors many triangles."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Flags, Floats


@numba.njit(cache=True)
def filled(triangles: Floats, rows: int, columns: int) -> Flags:
    """(rows, columns) cells whose centre, at integer coordinates (column, row), lies in a triangle (K, 3, 2)."""
    cells = np.zeros((rows, columns), np.bool_)
    for k in range(len(triangles)):
        t = triangles[k]
        first = max(int(np.ceil(min(t[0, 1], t[1, 1], t[2, 1]))), 0)
        end = min(int(np.floor(max(t[0, 1], t[1, 1], t[2, 1]))) + 1, rows)
        for row in range(first, end):
            left, right = np.inf, -np.inf
            for i in range(3):
                x0, y0, x1, y1 = t[i, 0], t[i, 1], t[(i + 1) % 3, 0], t[(i + 1) % 3, 1]
                if y0 != y1:
                    share = (row - y0) / (y1 - y0)
                    if 0 <= share <= 1:
                        x = x0 + share * (x1 - x0)
                        left, right = min(left, x), max(right, x)
            if left <= right:
                begin, last = max(int(np.ceil(left)), 0), min(int(np.floor(right)), columns - 1)
                for column in range(begin, last + 1):
                    cells[row, column] = True
    return cells


@numba.njit(cache=True)
def share_filled(cells: Flags, size: int) -> Floats:
    """(rows, columns) filled fraction of each square of `size` x `size` cells."""
    rows, columns = cells.shape[0] // size, cells.shape[1] // size
    share = np.zeros((rows, columns))
    for row in range(rows):
        for column in range(columns):
            count = 0
            for i in range(size):
                for j in range(size):
                    count += cells[row * size + i, column * size + j]
            share[row, column] = count / size**2
    return share


@numba.njit(cache=True)
def within(cells: Flags, reach: float) -> Flags:
    """Cells whose centre is within `reach` cells of the centre of one of `cells`."""
    rows, columns = cells.shape
    found = np.zeros_like(cells)
    steps = int(np.floor(reach))
    half = np.array([int(np.floor(np.sqrt(reach**2 - step**2))) for step in range(steps + 1)])
    for row in range(rows):
        for column in range(columns):
            if not cells[row, column]:
                continue
            for step in range(-steps, steps + 1):
                if 0 <= row + step < rows:
                    wide = half[abs(step)]
                    found[row + step, max(column - wide, 0) : column + wide + 1] = True
    return found


@numba.njit(cache=True)
def inner(cells: Flags) -> Flags:
    """Filled cells whose four neighbours are filled too."""
    found = np.zeros_like(cells)
    for row in range(1, cells.shape[0] - 1):
        for column in range(1, cells.shape[1] - 1):
            across = cells[row, column - 1] & cells[row, column] & cells[row, column + 1]
            found[row, column] = across & cells[row - 1, column] & cells[row + 1, column]
    return found


@numba.njit(cache=True)
def without_strips(covered: Flags, pieces: NDArray[np.int32], count: int, width: float) -> Flags:
    """`covered` without those of its `count` numbered pieces that are strips along its edge.

    A strip is up to `width` cells wide on average: it has at most width/2 cells per border cell.
    """
    rows, columns = pieces.shape
    cells, border, at_edge = np.zeros(count + 1, np.int64), np.zeros(count + 1, np.int64), np.zeros(count + 1, np.bool_)
    for row in range(rows):
        for column in range(columns):
            piece = pieces[row, column]
            if piece == 0:
                continue
            cells[piece] += 1
            is_inner = is_covered = 0 < row < rows - 1 and 0 < column < columns - 1
            if is_inner:
                for i, j in ((row, column - 1), (row, column + 1), (row - 1, column), (row + 1, column)):
                    is_inner &= pieces[i, j] > 0
                    is_covered &= covered[i, j]
            border[piece] += not is_inner
            at_edge[piece] |= not is_covered
    left = covered.copy()
    strip = at_edge & (2 * cells <= width * border)
    if strip.any():
        for row in range(rows):
            for column in range(columns):
                left[row, column] &= not strip[pieces[row, column]]
    return left
