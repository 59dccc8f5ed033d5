"""Sums over the stored entries: whole pixels, or rows over the curve that is edited (Ben-Artzi 2007, eqs 6.6, 6.7)."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats, Indices
from lambent.core.wavelets import TAPS
from lambent.editing.folding import TOGETHER, write_wavelets
from lambent.editing.interreflection.stored import TermLight
from lambent.editing.products import Halves, Pixels, unit_of
from lambent.editing.rows import LARGEST


def pixels(light: TermLight, band: Floats, tail: Floats, power: Indices, powers: int) -> Pixels:
    """(powers, 3, P) light by the power of each tail.

    Parameters
    ----------
    band : (J, 3)
        Coefficients of the bands.
    tail : (Z, 3)
        Factors of the tails.
    power : (Z,)
        Number of the sum that each tail belongs to.
    """
    out = np.zeros((powers, 3, len(light.units)), np.float32)
    _pixels(out, light.ends, light.codes, light.values, light.units, *_tables(band, tail, power))
    return out


def rows(
    light: TermLight, band: Floats, tail: Floats, power: Indices, powers: int, row: Indices, count: int
) -> tuple[list[Halves], float]:
    """Rows (count, 3, P) of wavelets for each power, and their unit in W/(sr m^2); as `pixels`.

    Parameters
    ----------
    row : (J,)
        Row of each band: its band of the curve that is edited. `band` has the coefficients of the other curve.
    """
    out = np.empty((powers, count, 3, len(light.units)), np.uint16)
    # No sum is larger than that of all entries of a point.
    bound = pixels(light, np.abs(band), np.abs(tail), power, powers).sum(axis=0).max(initial=0.0)
    unit = float(2.0 ** np.ceil(np.log2(max(float(bound), 1e-30) / LARGEST)))
    tables = _tables(band, tail, power)
    _rows(
        out, light.ends, light.codes, light.values, (light.units / unit).astype(np.float32), *tables,
        np.asarray(row, np.int64), TAPS.astype(np.float32),
    )  # fmt: skip
    return list(out.view(np.float16)), unit


def _tables(
    band: Floats, tail: Floats, power: Indices
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int64]]:
    return (
        np.ascontiguousarray(band, np.float32), np.ascontiguousarray(tail, np.float32), np.asarray(power, np.int64),
    )  # fmt: skip


@numba.njit(parallel=True, fastmath=True, cache=True, nogil=True)
def _pixels(out, ends, codes, values, units, band, tail, power):  # type: ignore[no-untyped-def]
    bands = np.uint32(len(band))
    for p in numba.prange(len(units)):
        for n in range(ends[p], ends[p + 1]):
            z, j = codes[n] // bands, codes[n] % bands
            bits = values[n]
            unit = units[p] * unit_of(bits)
            q = power[z]
            out[q, 0, p] += unit * np.float32(bits & 511) * band[j, 0] * tail[z, 0]
            out[q, 1, p] += unit * np.float32(bits >> 9 & 511) * band[j, 1] * tail[z, 1]
            out[q, 2, p] += unit * np.float32(bits >> 18 & 511) * band[j, 2] * tail[z, 2]


@numba.njit(parallel=True, fastmath=True, cache=True, nogil=True)
def _rows(out, ends, codes, values, units, band, tail, power, row, taps):  # type: ignore[no-untyped-def]
    powers, count, _, points = out.shape
    bands = np.uint32(len(band))
    for block in numba.prange((points + TOGETHER - 1) // TOGETHER):
        first = block * TOGETHER
        sums = np.zeros((powers, count, TOGETHER, 4), np.float32)
        before = np.empty((count, TOGETHER, 4), np.float32)
        for i in range(min(TOGETHER, points - first)):
            p = first + i
            for n in range(ends[p], ends[p + 1]):
                z, j = codes[n] // bands, codes[n] % bands
                bits = values[n]
                unit = units[p] * unit_of(bits)
                at = sums[power[z], row[j], i]
                at[0] += unit * np.float32(bits & 511) * band[j, 0] * tail[z, 0]
                at[1] += unit * np.float32(bits >> 9 & 511) * band[j, 1] * tail[z, 1]
                at[2] += unit * np.float32(bits >> 18 & 511) * band[j, 2] * tail[z, 2]
        for q in range(powers):
            write_wavelets(out[q], first, sums[q], before, taps)
