"""Switching curves: transport of two curves folded with the one that stays (Ben-Artzi 2007, eq. 4.16).

    T_A = U c_B,   T_B = (c_A)^T U

The result is transport of one curve, in the wavelets that `IncrementalPicture` wants.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.wavelets import TAPS
from lambent.editing.products import Halves, half_of_float, unit_of

TOGETHER = 32  # points whose rows stay in the second-level cache


def folded(
    spans: NDArray[np.uint32],
    steps: NDArray[np.uint8],
    values: NDArray[np.uint32],
    idle: Floats,
    edited: int,
    bands: int,
) -> tuple[Halves, float]:
    """Transport of the edited one of two curves, with the other's coefficients folded in.

    Parameters
    ----------
    spans : (P, 2)
        First entry of each point, and the one past its last.
    steps : (N,)
        From each entry's pair of bands to the next entry's. With K bands of the second curve, bands j and k are pair
        j K + k; each point begins at -1.
    values : (N,)
        Transport by these, RGB9E5 (`core.shared_exponent`).
    idle : (K, 3)
        Means of the curve that stays over its bands.
    edited : {0, 1}
        Which of the two is edited.
    bands : int
        Its number of bands, a power of two.

    Returns
    -------
    transport : (bands, 3, P) float16
        By wavelets, for an idle curve whose largest coefficient is 1.
    scale : float
        That coefficient: what transport is to be multiplied by. Half floats would overflow with narrow peaks.
    """
    scale = float(np.abs(idle).max()) or 1.0
    out = np.empty((bands, 3, len(spans)), np.uint16)
    second = bands if edited else len(idle)
    shift, mask = second.bit_length() - 1, second - 1
    places = (0, mask, shift, -1) if edited else (shift, -1, 0, mask)
    _fold(out, spans, steps, values, (idle / scale).astype(np.float32), places, TAPS.astype(np.float32))
    return out.view(np.float16), scale


@numba.njit(parallel=True, fastmath=True, cache=True)
def _fold(out, spans, steps, values, idle, places, taps):  # type: ignore[no-untyped-def]
    """`places` are the bits of a pair's number that are bands of the edited curve, and of the idle one: shift, mask."""
    bands, _, points = out.shape
    shift, mask, idle_shift, idle_mask = places
    for block in numba.prange((points + TOGETHER - 1) // TOGETHER):
        first = block * TOGETHER
        count = min(TOGETHER, points - first)
        rows = np.zeros((TOGETHER, bands, 4), np.float32)
        before = np.empty((bands, 4), np.float32)
        for i in range(count):
            row, pair, last = rows[i], -1, 0
            red, green, blue = np.float32(0), np.float32(0), np.float32(0)
            for n in range(spans[first + i, 0], spans[first + i, 1]):
                pair += steps[n]
                j, k = pair >> shift & mask, pair >> idle_shift & idle_mask
                if j != last:  # sums stay in registers: most entries have the band of the one before
                    row[last, 0] += red
                    row[last, 1] += green
                    row[last, 2] += blue
                    red, green, blue = np.float32(0), np.float32(0), np.float32(0)
                    last = j
                bits = values[n]
                unit = unit_of(bits)
                red += idle[k, 0] * unit * np.float32(bits & 511)
                green += idle[k, 1] * unit * np.float32(bits >> 9 & 511)
                blue += idle[k, 2] * unit * np.float32(bits >> 18 & 511)
            row[last, 0] += red
            row[last, 1] += green
            row[last, 2] += blue
            to_wavelets(row, before, taps)
        for j in range(bands):
            for c in range(3):
                for i in range(count):
                    out[j, c, first + i] = half_of_float(rows[i, j, c])  # type: ignore[call-arg]


@numba.njit(fastmath=True, cache=True)
def to_wavelets(row, before, taps):  # type: ignore[no-untyped-def]
    """`core.wavelets.transformed` of one row (J, 4), in place."""
    a, b, c, d = taps
    size = len(row)
    while size > 1:
        half = size // 2
        before[:size] = row[:size]
        for i in range(half):
            after = 2 * i + 2 if i + 1 < half else 0
            for x in range(4):
                even, odd = before[2 * i, x], before[2 * i + 1, x]
                next_even, next_odd = before[after, x], before[after + 1, x]
                row[i, x] = a * even + b * odd + c * next_even + d * next_odd
                row[half + i, x] = d * even - c * odd + b * next_even - a * next_odd
        size = half
