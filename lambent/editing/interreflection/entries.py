"""Sparse light of one term of a view: band and tail numbers are stored as differences between entries.

A difference has one byte or two. A larger gap is bridged by entries without light.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Indices
from lambent.editing.products import unit_of

Entries = tuple[NDArray[np.integer], NDArray[np.unsignedinteger[Any]], NDArray[np.uint32]]
"""Entries of each of a tile's points: counts; their numbers, ascending within a point; their values."""
WIDTHS: tuple[type[np.unsignedinteger[Any]], ...] = np.uint8, np.uint16  # of a difference
BYTES = 4  # of a value


@dataclass(frozen=True)
class TermLight:
    """Light of one term of a material by bands and tails; for an uneditable material, all its light.

    Attributes
    ----------
    ends : (P + 1,) int64
        Entries of point p are ends[p] to ends[p + 1].
    steps : (N,) uint8 or uint16
        Difference of each entry's number to the previous one's; each point begins at 0. A number is the tail times the
        number of bands, plus the band.
    values : (N,) uint32
        RGB9E5 (`baked.shared_exponent`), times `units` of the point.
    units : (P,) float32
        W/(sr m^2).
    counts : tuple of int
        Bands of each of the term's curves, powers of two; empty without curves.
    met : (T,) int64
        Numbers of the tails that have an entry, ascending.
    largest : float
        Largest sum, over all points and channels, of a point's entries.
    """

    ends: NDArray[np.int64]
    steps: NDArray[np.uint8] | NDArray[np.uint16]
    values: NDArray[np.uint32]
    units: NDArray[np.float32]
    counts: tuple[int, ...]
    met: Indices
    largest: float

    @property
    def bands(self) -> int:
        return int(np.prod(self.counts, dtype=int))

    @property
    def bits_of_bands(self) -> int:
        """Bits of an entry's number that hold its band."""
        assert self.bands & (self.bands - 1) == 0, "numbers of bands are powers of two"
        return self.bands.bit_length() - 1

    @cached_property
    def codes(self) -> NDArray[np.int64]:
        """(N,) number of each entry."""
        sums = np.cumsum(self.steps, dtype=np.int64)
        before = np.concatenate([[0], sums])[self.ends[:-1]]
        return np.asarray(sums - np.repeat(before, np.diff(self.ends)))

    @classmethod
    def of_tiles(cls, tiles: Iterable[Entries], units: NDArray[np.float32], counts: tuple[int, ...]) -> TermLight:
        """Concatenate tiles of points."""
        bands, dtype = int(np.prod(counts, dtype=int)), None
        made, met = [], [np.zeros(0, int)]
        for tile in tiles:
            dtype = dtype or (_narrowest(tile) if len(tile[1]) else None)
            made.append(_stepped(tile, dtype or np.uint8))  # uint8 joins with either type
            met.append(_tails(tile[1], bands))
        room, steps, values = (np.concatenate(parts) for parts in zip(*made, strict=True))
        ends = _ends(room)
        largest = float(_largest(ends, values, units))
        return cls(ends, steps, values, units, counts, np.unique(np.concatenate(met)), largest)


def _narrowest(tile: Entries) -> type[np.unsignedinteger[Any]]:
    """The type in which the tile's steps take the fewest bytes."""
    room = {of: _room(_ends(tile[0]), tile[1], np.iinfo(of).max).sum() for of in WIDTHS}
    return min(WIDTHS, key=lambda of: room[of] * (of().nbytes + BYTES))


def _tails(codes: NDArray[np.unsignedinteger[Any]], bands: int) -> Indices:
    met = np.zeros(int(codes.max(initial=0)) // bands + 1, bool)
    _mark(met, codes, bands)
    return np.flatnonzero(met)


def _stepped(tile: Entries, dtype: type[np.unsignedinteger[Any]]) -> Entries:
    """Entries of each point, steps and values, including entries that bridge gaps."""
    each, codes, values = tile
    ends, most = _ends(each), np.iinfo(dtype).max
    room = _room(ends, codes, most)
    begins = _ends(room)
    steps, out = np.empty(begins[-1], dtype), np.zeros(begins[-1], np.uint32)
    _step(ends, codes, values, begins, steps, out, most)
    return room, steps, out


def _ends(each: NDArray[np.integer]) -> NDArray[np.int64]:
    return np.concatenate([[0], np.cumsum(each, dtype=np.int64)])


@numba.njit(parallel=True, cache=True, nogil=True)
def _room(ends, codes, most):  # type: ignore[no-untyped-def]
    """(P,) entries of each point, including those that bridge gaps."""
    room = np.empty(len(ends) - 1, np.int64)
    for p in numba.prange(len(room)):
        count, before = ends[p + 1] - ends[p], np.int64(0)
        for n in range(ends[p], ends[p + 1]):
            count += max(0, np.int64(codes[n]) - before - 1) // most
            before = np.int64(codes[n])
        room[p] = count
    return room


@numba.njit(parallel=True, cache=True, nogil=True)
def _step(ends, codes, values, begins, steps, out, most):  # type: ignore[no-untyped-def]
    for p in numba.prange(len(ends) - 1):
        at, before = begins[p], np.int64(0)
        for n in range(ends[p], ends[p + 1]):
            step = np.int64(codes[n]) - before
            before = np.int64(codes[n])
            while step > most:
                steps[at] = most
                step -= most
                at += 1
            steps[at], out[at] = step, values[n]
            at += 1


@numba.njit(parallel=True, fastmath=True, cache=True, nogil=True)
def _largest(ends, values, units):  # type: ignore[no-untyped-def]
    largest = np.float32(0)
    for p in numba.prange(len(units)):
        red, green, blue = np.float32(0), np.float32(0), np.float32(0)
        for n in range(ends[p], ends[p + 1]):
            unit = unit_of(values[n])
            red += unit * np.float32(values[n] & 511)
            green += unit * np.float32(values[n] >> 9 & 511)
            blue += unit * np.float32(values[n] >> 18 & 511)
        largest = max(largest, units[p] * max(red, green, blue))
    return largest


@numba.njit(parallel=True, cache=True, nogil=True)
def _mark(met, codes, bands):  # type: ignore[no-untyped-def]
    for n in numba.prange(len(codes)):
        met[codes[n] // bands] = True
