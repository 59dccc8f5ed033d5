"""Sums over stored entries: whole pixels, or rows over the edited curve (Ben-Artzi 2007, eqs 6.6, 6.7)."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from lambent.baked.transport.wavelets import TAPS
from lambent.core.arrays import Floats, Indices
from lambent.editing.folding import TOGETHER, write_wavelets
from lambent.editing.interreflection.entries import TermLight
from lambent.editing.interreflection.powers import Powers
from lambent.editing.packed_light import add_weighted_light
from lambent.editing.products import Halves, Pixels, half_of_float
from lambent.editing.rows import LARGEST

AT_ONCE = 32 * TOGETHER  # points that a thread processes with the same sums

APART = 4  # accumulators used in turn, so that no addition waits for the previous one


@dataclass(frozen=True)
class Cells:
    """The sums that some pixels need: one cell for each monomial and row (`Powers`) among their tails.

    Attributes
    ----------
    number : (Z,)
        Cell of each tail; 0 also for tails without one.
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
    _rows(out, *_entries(light), units, *_tables(band, tail, cells), np.asarray(row, np.int64), TAPS.astype(np.float32))
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


@numba.njit(parallel=True, fastmath=True, cache=True, nogil=True)
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


@numba.njit(parallel=True, fastmath=True, cache=True, nogil=True)
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


@numba.njit(parallel=True, cache=True, nogil=True)
def _halve(out, sums, factor):  # type: ignore[no-untyped-def]
    for n in numba.prange(len(out)):
        out[n] = half_of_float(sums[n] * factor)  # type: ignore[call-arg]
