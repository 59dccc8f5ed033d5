"""The cells of a plan that triangles fill, compiled: plans have millions of cells, and floors many triangles."""

from __future__ import annotations

import numba
import numpy as np

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
