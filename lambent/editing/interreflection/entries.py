"""Sparse light of one term of a view: band and tail numbers are stored as differences between entries.

A difference has one byte or two. A larger gap is bridged by entries without light. Sums over entries are of whole
pixels, or rows over the edited curve (Ben-Artzi 2007, eqs 6.6, 6.7).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from lambent.baked.transport.wavelets import TAPS
from lambent.core.arrays import Floats, Indices
from lambent.core.kernels import parallel
from lambent.editing.folding import TOGETHER, write_wavelets
from lambent.editing.interreflection.powers import Powers
from lambent.editing.products import Halves, Pixels, add_weighted_light, half_of_float, unit_of
from lambent.editing.rows import LARGEST

Entries = tuple[NDArray[np.integer], NDArray[np.unsignedinteger[Any]], NDArray[np.uint32]]
"""Entries of each of a tile's points: counts; their numbers, ascending within a point; their values."""
WIDTHS: tuple[type[np.unsignedinteger[Any]], ...] = np.uint8, np.uint16  # of a difference
BYTES = 4  # of a value
AT_ONCE = 32 * TOGETHER  # points that a thread processes with the same sums
APART = 4  # accumulators used in turn, so that no addition waits for the previous one


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


@parallel()
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


@parallel()
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


@parallel(fastmath=True)
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


@parallel()
def _mark(met, codes, bands):  # type: ignore[no-untyped-def]
    for n in numba.prange(len(codes)):
        met[codes[n] // bands] = True


@dataclass(frozen=True)
class Cells:
    """The sums that some pixels need: one cell for each monomial and row (`Powers`) among their tails.

    Attributes
    ----------
    number : (Z,)
        Cell of each tail; 0 also for tails without one, to which nothing is then added.
    power, row : (C,)
        Of each cell; sorted by monomial, then by row.
    """

    number: Indices
    power: Indices
    row: Indices

    @classmethod
    def of(cls, power: Powers, met: Indices) -> Cells:
        """Cells for the given tails."""
        met = power.weighing(met)
        pairs, found = np.unique(np.column_stack([power.power[met], power.row[met]]), axis=0, return_inverse=True)
        number = np.zeros(len(power.tails), np.int64)
        number[met] = found.reshape(-1)
        return cls(number, pairs[:, 0], pairs[:, 1])

    def __len__(self) -> int:
        return len(self.power)


def add_pixels(
    out: Pixels, light: TermLight, band: Floats, tail: Floats, cells: Cells, factor: Floats | Pixels
) -> None:
    """out (C, 3, P) += light by cells, times `factor` (3, P) or (3, 1).

    Parameters
    ----------
    band : (J, 3)
        Coefficients of the bands.
    tail : (Z, 3)
        Factors of the tails.
    """
    if len(cells):
        _pixels(out, *_entries(light), light.units, *_tables(band, tail, cells), np.asarray(factor, np.float32))


def rows(light: TermLight, band: Floats, tail: Floats, cells: Cells, row: Indices, count: int) -> tuple[Halves, float]:
    """Rows (C, count, 3, P) of wavelets for each cell, and their unit in W/(sr m^2); parameters as in `add_pixels`.

    Parameters
    ----------
    row : (J,)
        Row of each band: its band of the edited curve. `band` has the coefficients of the other curve.
    """
    out = np.zeros((len(cells), count, 3, len(light.units)), np.uint16)
    # No sum exceeds that of all entries of a point.
    unit = unit_for(light.largest * float(np.abs(band).max() * np.abs(tail).max()))
    units = (light.units / np.float32(unit)).astype(np.float32)
    if len(cells):
        rows_of = np.asarray(row, np.int64), TAPS.astype(np.float32)
        _rows(out, *_entries(light), units, *_tables(band, tail, cells), *rows_of)
    return out.view(np.float16), unit


def halves(sums: Pixels) -> tuple[Halves, float]:
    """Sums (C, 3, P) as rows (C, 1, 3, P), and their unit."""
    unit = unit_for(float(sums.max(initial=0.0)))
    out = np.empty(sums.shape, np.uint16)
    _halve(out.reshape(-1), sums.reshape(-1), np.float32(1 / unit))
    return out.view(np.float16)[:, None], unit


def unit_for(largest: float) -> float:
    """Power of two to divide rows by, so that half floats can hold them."""
    return float(2.0 ** np.ceil(np.log2(max(largest, 1e-30) / LARGEST)))


def _entries(light: TermLight) -> tuple[NDArray[np.int64], NDArray[np.unsignedinteger], NDArray[np.uint32], int]:
    return light.ends, light.steps, light.values, light.bits_of_bands


def _tables(
    band: Floats, tail: Floats, cells: Cells
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int64]]:
    band, tail = (np.pad(np.asarray(table, np.float32), ((0, 0), (0, 1))) for table in (band, tail))
    return band, tail, cells.number


@parallel(fastmath=True)
def _pixels(out, ends, steps, values, bits_of_bands, units, band, tail, cell, factor):  # type: ignore[no-untyped-def]
    cells, _, points = out.shape
    row, moving = np.arange(len(band)) % APART, 0 if factor.shape[1] == 1 else 1
    for part in numba.prange((points + AT_ONCE - 1) // AT_ONCE):
        sums, met = np.zeros((cells, APART, TOGETHER, 4), np.float32), np.zeros(cells, np.bool_)
        for first in range(part * AT_ONCE, min((part + 1) * AT_ONCE, points), TOGETHER):
            many = min(TOGETHER, points - first)
            _add(sums, met, first, many, ends, steps, values, bits_of_bands, units, band, tail, cell, row)
            for c in range(cells):
                for k in range(3):
                    for i in range(many):
                        out[c, k, first + i] += factor[k, moving * (first + i)] * sums[c, :, i, k].sum()
            sums[:] = 0


@parallel(fastmath=True)
def _rows(out, ends, steps, values, bits_of_bands, units, band, tail, cell, row, taps):  # type: ignore[no-untyped-def]
    cells, count, _, points = out.shape
    for part in numba.prange((points + AT_ONCE - 1) // AT_ONCE):
        sums, met = np.zeros((cells, count, TOGETHER, 4), np.float32), np.zeros(cells, np.bool_)
        before = np.empty((count, TOGETHER, 4), np.float32)
        for first in range(part * AT_ONCE, min((part + 1) * AT_ONCE, points), TOGETHER):
            many = min(TOGETHER, points - first)
            _add(sums, met, first, many, ends, steps, values, bits_of_bands, units, band, tail, cell, row)
            for c in range(cells):
                if met[c]:  # unwritten pages take no memory
                    write_wavelets(out[c], first, sums[c], before, taps)
                    sums[c] = 0
                    met[c] = False


@numba.njit(fastmath=True, cache=True, nogil=True)
def _add(sums, met, first, many, ends, steps, values, bits_of_bands, units, band, tail, cell, row):  # type: ignore[no-untyped-def]
    """sums (C, J, TOGETHER, 4) += light of `many` points from `first` on; sets `met` for cells that receive any."""
    mask, count = (1 << bits_of_bands) - 1, sums.shape[1]
    for i in range(many):
        code, unit = np.int64(0), units[first + i]
        for n in range(ends[first + i], ends[first + i + 1]):
            code += np.int64(steps[n])
            z, j = code >> bits_of_bands, code & mask
            c = cell[z]
            met[c] = True
            add_weighted_light(  # type: ignore[call-arg]
                sums, ((c * count + row[j]) * TOGETHER + i) * 4, band, j * 4, tail, z * 4, unit, values[n]
            )


@parallel()
def _halve(out, sums, factor):  # type: ignore[no-untyped-def]
    for n in numba.prange(len(out)):
        out[n] = half_of_float(sums[n] * factor)  # type: ignore[call-arg]
