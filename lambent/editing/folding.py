"""Switching curves: transport of two curves folded with the one that stays (Ben-Artzi 2007, eq. 4.16).

    T_A = U c_B,   T_B = (c_A)^T U

The result is transport of one curve, in the wavelets that `IncrementalPicture` wants.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.wavelets import TAPS
from lambent.editing.products import Halves, half_of_float

TOGETHER = 16  # points whose rows stay in the first-level cache, in another set of it each


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
    means = np.zeros((len(idle), 4), np.float32)
    means[:, :3] = idle / scale
    _fold(out, spans, steps, values, means, places, TAPS.astype(np.float32))
    return out.view(np.float16), scale


@intrinsic
def _add_light(_typing, sums, at, means, of, bits):  # type: ignore[no-untyped-def]
    """sums[at:at + 4] += means[of:of + 4] times a colour of `core.shared_exponent`, the channels side by side.

    In flat numbers of contiguous arrays. numba does not find this by itself: an entry takes a third of the time.
    """
    word, channels = ir.IntType(32), 4
    whole, real = ir.VectorType(word, channels), ir.VectorType(ir.FloatType(), channels)

    def each(*numbers: int) -> ir.Constant:
        return ir.Constant(whole, list(numbers if len(numbers) == channels else numbers * channels))

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        def place(k: int) -> Any:
            data = context.make_array(signature.args[k])(context, builder, args[k]).data
            return builder.bitcast(builder.gep(data, [args[k + 1]]), real.as_pointer())

        nothing = ir.Constant(whole, ir.Undefined)
        bits = builder.insert_element(nothing, args[4], ir.Constant(word, 0))
        bits = builder.shuffle_vector(bits, nothing, each(0))
        mantissas = builder.and_(builder.lshr(bits, each(0, 9, 18, 27)), each(511, 511, 511, 0))
        exponent = builder.add(builder.lshr(bits, each(27)), each(103))  # as in `products.unit_of`
        unit = builder.bitcast(builder.shl(exponent, each(23)), real)
        to = place(0)
        mean, before = builder.load(place(2), align=4), builder.load(to, align=4)
        light = builder.fmul(builder.uitofp(mantissas, real), unit)
        added = builder.fmul(light, mean, flags=["contract"])
        builder.store(builder.fadd(before, added, flags=["contract"]), to, align=4)
        return context.get_dummy_value()

    return types.void(sums, types.intp, means, types.intp, types.uint32), generate


@numba.njit(parallel=True, fastmath=True, cache=True, nogil=True)
def _fold(out, spans, steps, values, means, places, taps):  # type: ignore[no-untyped-def]
    """`places` are the bits of a pair's number that are bands of the edited curve, and of the idle one: shift, mask."""
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
                _add_light(rows, (j * TOGETHER + i) * 4, means, k * 4, values[n])  # type: ignore[call-arg]
        write_wavelets(out, first, rows, before, taps)


@numba.njit(fastmath=True, cache=True)
def write_wavelets(out, first, rows, before, taps):  # type: ignore[no-untyped-def]
    """out[:, :, first:] (J, 3, P) = halves of `core.wavelets.transformed` of rows (J, TOGETHER, 4), which change."""
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
