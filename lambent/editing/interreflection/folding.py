"""Sums over the stored entries: whole pixels, or rows over the curve that is edited (Ben-Artzi 2007, eqs 6.6, 6.7)."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats, Indices
from lambent.core.wavelets import TAPS
from lambent.editing.folding import TOGETHER, write_wavelets
from lambent.editing.interreflection.entries import TermLight
from lambent.editing.interreflection.powers import Powers
from lambent.editing.products import Halves, Pixels, half_of_float, unit_of
from lambent.editing.rows import LARGEST

AT_ONCE = 32 * TOGETHER  # points that a thread takes with the same sums


@dataclass(frozen=True)
class Cells:
    """The sums that some pixels need: a cell for each monomial and row (`Powers`) that their tails have.

    Attributes
    ----------
    number : (Z,)
        Cell of each tail; 0 too for tails that are not among them.
    power, row : (C,)
        Of each cell; monomials rise, and so do rows within one.
    """

    number: Indices
    power: Indices
    row: Indices

    @classmethod
    def of(cls, power: Powers, met: Indices) -> Cells:
        """Of tails by their numbers."""
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
    """Rows (C, count, 3, P) of wavelets for each cell, and their unit in W/(sr m^2); as `add_pixels`.

    Parameters
    ----------
    row : (J,)
        Row of each band: its band of the curve that is edited. `band` has the coefficients of the other curve.
    """
    out = np.zeros((len(cells), count, 3, len(light.units)), np.uint16)
    entries, tables = _entries(light), _tables(band, tail, cells)
    # No sum is larger than that of all entries of a point.
    unit = unit_for(float(_largest(*entries, light.units, *tables)))
    _rows(
        out, *entries, (light.units / np.float32(unit)).astype(np.float32), *tables, np.asarray(row, np.int64),
        TAPS.astype(np.float32),
    )  # fmt: skip
    return out.view(np.float16), unit


def halves(sums: Pixels) -> tuple[Halves, float]:
    """Sums (C, 3, P) as rows (C, 1, 3, P), and their unit."""
    unit = unit_for(float(sums.max(initial=0.0)))
    out = np.empty(sums.shape, np.uint16)
    _halve(out.reshape(-1), sums.reshape(-1), np.float32(1 / unit))
    return out.view(np.float16)[:, None], unit


def unit_for(largest: float) -> float:
    """The power of two that rows are multiples of, so that half floats hold them."""
    return float(2.0 ** np.ceil(np.log2(max(largest, 1e-30) / LARGEST)))


def _entries(light: TermLight) -> tuple[NDArray[np.int64], NDArray[np.unsignedinteger], NDArray[np.uint32], int]:
    return light.ends, light.steps, light.values, light.bits_of_bands


def _tables(
    band: Floats, tail: Floats, cells: Cells
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int64]]:
    return np.ascontiguousarray(band, np.float32), np.ascontiguousarray(tail, np.float32), cells.number


@numba.njit(parallel=True, fastmath=True, cache=True, nogil=True)
def _pixels(out, ends, steps, values, bits_of_bands, units, band, tail, cell, factor):  # type: ignore[no-untyped-def]
    cells, _, points = out.shape
    mask, moving = (1 << bits_of_bands) - 1, 0 if factor.shape[1] == 1 else 1
    for part in numba.prange((points + AT_ONCE - 1) // AT_ONCE):
        sums = np.zeros((cells, 3, TOGETHER), np.float32)
        for first in range(part * AT_ONCE, min((part + 1) * AT_ONCE, points), TOGETHER):
            many = min(TOGETHER, points - first)
            for i in range(many):
                p, code = first + i, np.int64(0)
                for n in range(ends[p], ends[p + 1]):
                    code += np.int64(steps[n])
                    z, j = code >> bits_of_bands, code & mask
                    bits, at = values[n], sums[cell[z]]
                    unit = units[p] * unit_of(bits)
                    at[0, i] += unit * np.float32(bits & 511) * band[j, 0] * tail[z, 0]
                    at[1, i] += unit * np.float32(bits >> 9 & 511) * band[j, 1] * tail[z, 1]
                    at[2, i] += unit * np.float32(bits >> 18 & 511) * band[j, 2] * tail[z, 2]
            for c in range(cells):
                for k in range(3):
                    for i in range(many):
                        out[c, k, first + i] += factor[k, moving * (first + i)] * sums[c, k, i]
            sums[:] = 0


@numba.njit(parallel=True, fastmath=True, cache=True, nogil=True)
def _largest(ends, steps, values, bits_of_bands, units, band, tail, cell):  # type: ignore[no-untyped-def]
    """Sum of all entries of a point in one channel, the largest of all points."""
    mask, largest = (1 << bits_of_bands) - 1, np.float32(0)
    for p in numba.prange(len(units)):
        code, red, green, blue = np.int64(0), np.float32(0), np.float32(0), np.float32(0)
        for n in range(ends[p], ends[p + 1]):
            code += np.int64(steps[n])
            z, j = code >> bits_of_bands, code & mask
            bits = values[n]
            unit = unit_of(bits)
            red += unit * np.float32(bits & 511) * abs(band[j, 0] * tail[z, 0])
            green += unit * np.float32(bits >> 9 & 511) * abs(band[j, 1] * tail[z, 1])
            blue += unit * np.float32(bits >> 18 & 511) * abs(band[j, 2] * tail[z, 2])
        largest = max(largest, units[p] * max(red, green, blue))
    return largest


@numba.njit(parallel=True, fastmath=True, cache=True, nogil=True)
def _rows(out, ends, steps, values, bits_of_bands, units, band, tail, cell, row, taps):  # type: ignore[no-untyped-def]
    cells, count, _, points = out.shape
    mask = (1 << bits_of_bands) - 1
    for part in numba.prange((points + AT_ONCE - 1) // AT_ONCE):
        sums = np.zeros((cells, count, TOGETHER, 4), np.float32)
        before = np.empty((count, TOGETHER, 4), np.float32)
        met = np.zeros(cells, np.bool_)
        for first in range(part * AT_ONCE, min((part + 1) * AT_ONCE, points), TOGETHER):
            for i in range(min(TOGETHER, points - first)):
                p, code = first + i, np.int64(0)
                for n in range(ends[p], ends[p + 1]):
                    code += np.int64(steps[n])
                    z, j = code >> bits_of_bands, code & mask
                    bits = values[n]
                    unit = units[p] * unit_of(bits)
                    c = cell[z]
                    met[c] = True
                    at = sums[c, row[j], i]
                    at[0] += unit * np.float32(bits & 511) * band[j, 0] * tail[z, 0]
                    at[1] += unit * np.float32(bits >> 9 & 511) * band[j, 1] * tail[z, 1]
                    at[2] += unit * np.float32(bits >> 18 & 511) * band[j, 2] * tail[z, 2]
            for c in range(cells):
                if met[c]:  # what is not written costs no memory either
                    write_wavelets(out[c], first, sums[c], before, taps)
                    sums[c] = 0
                    met[c] = False


@numba.njit(parallel=True, cache=True, nogil=True)
def _halve(out, sums, factor):  # type: ignore[no-untyped-def]
    for n in numba.prange(len(out)):
        out[n] = half_of_float(sums[n] * factor)  # type: ignore[call-arg]
