"""Sparse transport rows: wavelets of light, by blocks of pixels.

The entries of a block are contiguous, wavelet after wavelet, so that each block is drawn by one core.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

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

    @property
    def shape(self) -> tuple[int, int, int]:
        return self.spans.shape[1] - 1, 3, self.pixels

    def __getitem__(self, rows: slice) -> SparseRows:
        """A range of consecutive rows."""
        begin, end, step = rows.indices(self.shape[0])
        assert step == 1, "rows next to each other"
        return replace(self, spans=np.ascontiguousarray(self.spans[:, begin : end + 1]))

    def add_to(self, picture: Pixels, rows: NDArray[np.integer], weights: Floats, part: slice = slice(None)) -> None:
        """picture (3, P) += sum over k of weights[k] (3,) rows[k] (3, P), in place, in `part` of the pixels."""
        begin, end, _ = part.indices(self.pixels)
        if begin < end and len(rows):
            _add(
                picture, self.spans, self.points, self.values.view(np.uint16), self.block,
                np.asarray(rows, np.int64), np.asarray(weights, np.float32), begin, end,
            )  # fmt: skip


@numba.njit(parallel=True, cache=True, nogil=True)
def _add(picture, spans, points, values, block, rows, weights, begin, end):  # type: ignore[no-untyped-def]
    first_block, last_block = begin // block, (end - 1) // block
    for b in numba.prange(first_block, last_block + 1):
        start = b * block
        for k in range(len(rows)):
            red, green, blue = weights[k, 0], weights[k, 1], weights[k, 2]
            for e in range(spans[b, rows[k]], spans[b, rows[k] + 1]):
                p = start + points[e]
                if begin <= p < end:
                    picture[0, p] += red * float_of_half(values[e, 0])  # type: ignore[call-arg]
                    picture[1, p] += green * float_of_half(values[e, 1])
                    picture[2, p] += blue * float_of_half(values[e, 2])
