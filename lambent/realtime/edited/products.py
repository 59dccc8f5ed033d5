"""Sums of transport rows on a GPU: `lambent.editing.products` in GPU memory.

WebGPU's default limits allow bindings of 128 MiB, and a layer may have 400 MB of transport, so its pixels are divided
into pieces with separate buffers. Consecutive threads read consecutive pixels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.realtime.edited.commands import GROUP, REACH, Commands

Halves = NDArray[np.float16]
HEAD = np.dtype([("begin", "<u4"), ("end", "<u4"), ("anew", "<u4"), ("count", "<u4")])
ROW = np.dtype([("index", "<u4"), ("weight", "<f4", 3)])
ROWS_AT_ONCE = (REACH - HEAD.itemsize) // ROW.itemsize


@dataclass(frozen=True)
class Piece:
    """Pixels `first`, `first` + 1, ... of a layer, with room for a fixed number of transport rows."""

    first: int
    pixels: int
    about: Any  # uniform with the numbers above
    transport: Any  # (J, 3, words) of two half floats
    picture: Any  # (3, 2 words) float32
    sums: Any  # bind group

    @property
    def words(self) -> int:
        """Words of a row, of two pixels each."""
        return words_of(self.pixels)


def words_of(pixels: int) -> int:
    return (pixels + 1) // 2


def new_piece(commands: Commands, first: int, pixels: int, rows: int) -> Piece:
    """A piece with zero transport and picture."""
    words = words_of(pixels)
    about = commands.buffer(np.array([first, pixels, words, 0], np.uint32), "UNIFORM")
    transport, picture = commands.empty(rows * 3 * words * 4), commands.empty(3 * words * 8)
    return Piece(first, pixels, about, transport, picture, commands.group("sum", about, transport, picture))


class GpuProducts:
    """`lambent.editing.products.Products` for transport (J, 3, P) in pieces."""

    def __init__(self, commands: Commands, pieces: Sequence[Piece], shape: tuple[int, int, int]) -> None:
        self._commands, self._pieces, self.shape = commands, pieces, shape

    @property
    def picture(self) -> NDArray[np.float32]:
        """(3, P), read back from the GPU: for tests and tools."""
        parts = [np.zeros((3, 0), np.float32)]
        for piece in self._pieces:
            whole = self._commands.read(piece.picture, np.float32)[: 6 * piece.words]
            parts.append(whole.reshape(3, -1)[:, : piece.pixels])
        return np.concatenate(parts, axis=1)

    def add_rows(
        self, rows: NDArray[np.integer], weights: Floats, part: slice = slice(None), *, anew: bool = False
    ) -> None:
        """Record picture += sum over k of weights[k] transport[rows[k]] for `part` of the pixels; see `Products`.

        `rows` are (K,), `weights` (K, 3). With `anew` the sum replaces the picture.
        """
        begin, end, _ = part.indices(self.shape[2])
        parameters = np.zeros(len(rows), ROW)
        parameters["index"], parameters["weight"] = rows, weights
        for first in range(0, max(len(rows), int(anew)), ROWS_AT_ONCE):
            some = parameters[first : first + ROWS_AT_ONCE]
            head = np.array([(begin, end, anew and first == 0, len(some))], HEAD)
            self._commands.dispatch("sum", head.tobytes() + some.tobytes(), self._work(begin, end))

    def _work(self, begin: int, end: int) -> list[tuple[Any, int, int]]:
        """Bind groups of the pieces that hold pixels `begin` to `end`, with workgroups for these pixels."""
        work = []
        for piece in self._pieces:
            first, last = max(begin, piece.first) - piece.first, min(end - piece.first, piece.pixels)
            if first < last:
                work.append((piece.sums, -(-(words_of(last) - first // 2) // GROUP), 3))
        return work
