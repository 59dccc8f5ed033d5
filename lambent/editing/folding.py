"""Switching the edited curve: transport over two curves is folded with the idle one (Ben-Artzi 2007, eq. 4.16).

    T_A = U c_B,   T_B = (c_A)^T U

The result is transport over one curve, in wavelets, as `IncrementalPicture` needs it.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from lambent.baked.transport.wavelets import TAPS
from lambent.core.arrays import Floats
from lambent.core.kernels import parallel
from lambent.editing.products import Halves, add_light, half_of_float

TOGETHER = 16  # points whose rows stay in the first-level cache, each in another of its sets


def folded(
    spans: NDArray[np.uint32],
    steps: NDArray[np.uint8],
    values: NDArray[np.uint32],
    idle: Floats,
    edited: int,
    bands: int,
) -> tuple[Halves, float]:
    """Transport over the edited one of two curves, with the other's coefficients folded in.

    Parameters
    ----------
    spans : (P, 2)
        First entry of each point, and the one past its last.
    steps : (N,)
        Difference of each entry's pair of bands to the previous one's. With K bands of the second curve, bands j and k
        are pair j K + k; each point begins at -1.
    values : (N,)
        Transport by these pairs, RGB9E5 (`baked.shared_exponent`).
    idle : (K, 3)
        Means of the idle curve over its bands.
    edited : {0, 1}
        Index of the edited curve.
    bands : int
        Its number of bands, a power of two.

    Returns
    -------
    transport : (bands, 3, P) float16
        By wavelets, for an idle curve scaled to a largest coefficient of 1.
    scale : float
        That coefficient, to multiply transport by. Without scaling, narrow peaks would overflow half floats.
    """
    scale = float(np.abs(idle).max()) or 1.0
    out = np.empty((bands, 3, len(spans)), np.uint16)
    second = bands if edited else len(idle)
    shift, mask = second.bit_length() - 1, second - 1
    places = (0, mask, shift, -1) if edited else (shift, -1, 0, mask)
    means = np.zeros((len(idle), 4), np.float32)
    means[:, :3] = idle / scale
    _fold(out, spans, steps, values, means, places, TAPS.astype(np.float32))
    return out.view(np.float16), scale


@parallel(fastmath=True)
def _fold(out, spans, steps, values, means, places, taps):  # type: ignore[no-untyped-def]
    """`places` locates the bands in a pair's number: shift and mask of the edited curve, then of the idle one."""
    bands, _, points = out.shape
    shift, mask, idle_shift, idle_mask = places
    for block in numba.prange((points + TOGETHER - 1) // TOGETHER):
        first = block * TOGETHER
        rows = np.zeros((bands, TOGETHER, 4), np.float32)
        before = np.empty((bands, TOGETHER, 4), np.float32)
        for i in range(min(TOGETHER, points - first)):
            pair = -1
            for n in range(spans[first + i, 0], spans[first + i, 1]):
                pair += steps[n]
                j, k = pair >> shift & mask, pair >> idle_shift & idle_mask
                add_light(rows, (j * TOGETHER + i) * 4, means, k * 4, values[n])  # type: ignore[call-arg]
        write_wavelets(out, first, rows, before, taps)


@numba.njit(fastmath=True, cache=True)
def write_wavelets(out, first, rows, before, taps):  # type: ignore[no-untyped-def]
    """out[:, :, first:] (J, 3, P) = halves of `wavelets.transformed` of rows (J, TOGETHER, 4); overwrites rows."""
    bands, _, points = out.shape
    a, b, c, d = taps
    size = bands
    wide, narrow = rows.reshape(bands, TOGETHER * 4), before.reshape(bands, TOGETHER * 4)
    while size > 1:
        half = size // 2
        narrow[:size] = wide[:size]
        for i in range(half):
            after = 2 * i + 2 if i + 1 < half else 0
            for x in range(TOGETHER * 4):
                even, odd = narrow[2 * i, x], narrow[2 * i + 1, x]
                next_even, next_odd = narrow[after, x], narrow[after + 1, x]
                wide[i, x] = a * even + b * odd + c * next_even + d * next_odd
                wide[half + i, x] = d * even - c * odd + b * next_even - a * next_odd
        size = half
    for j in range(bands):
        for channel in range(3):
            for i in range(min(TOGETHER, points - first)):
                out[j, channel, first + i] = half_of_float(rows[j, i, channel])  # type: ignore[call-arg]
