"""Sparse transport rows: wavelets of light, by blocks of pixels.

The entries of a block are contiguous, wavelet after wavelet, so that each block is drawn by one core.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.editing.products import Halves, Pixels, float_of_half


@dataclass(frozen=True)
class SparseRows:
    """Rows (J, 3, P).

    Attributes
    ----------
    spans : (B, J + 1) int64
        First entry of each row in each block, and one past the last.
    points : (E,) uint16
        Pixel of each entry within its block, ascending in each row.
    values : (E, 3) float16
    block : int
        Pixels per block; the last block may have fewer.
    pixels : int
        P.
    """

    spans: NDArray[np.int64]
    points: NDArray[np.uint16]
    values: Halves
    block: int
    pixels: int

    def summed(self, weights: Floats) -> Pixels:
        """(3, P) sum of the rows, each times its weights (J, 3)."""
        picture, rows = np.zeros((3, self.pixels), np.float32), np.flatnonzero(weights.any(axis=1))
        values = self.values.view(np.uint16)
        _add(picture, self.spans, self.points, values, self.block, rows, np.asarray(weights[rows], np.float32))
        return picture


@numba.njit(parallel=True, cache=True, nogil=True)
def _add(picture, spans, points, values, block, rows, weights):  # type: ignore[no-untyped-def]
    for b in numba.prange(len(spans)):
        start = b * block
        for k in range(len(rows)):
            red, green, blue = weights[k, 0], weights[k, 1], weights[k, 2]
            for e in range(spans[b, rows[k]], spans[b, rows[k] + 1]):
                p = start + points[e]
                picture[0, p] += red * float_of_half(values[e, 0])  # type: ignore[call-arg]
                picture[1, p] += green * float_of_half(values[e, 1])
                picture[2, p] += blue * float_of_half(values[e, 2])
