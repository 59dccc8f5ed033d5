"""Half floats in compiled loops: numba has no such type, so functions work on their bits."""

from __future__ import annotations

import numba
import numpy as np

from lambent.core.kernels import parallel
from lambent.core.light.colour import HALF_MAX

LEAST_NORMAL = np.float32(2.0**-14)
TINY = np.float32(2.0**24)  # reciprocal of the smallest half float
LARGEST = np.float32(HALF_MAX)


@numba.njit(cache=True, inline="always")
def half_bits(value):  # type: ignore[no-untyped-def]
    """Bits (uint16) of the half float nearest to a float32, ties to even; negative values and NaN give 0."""
    if not value > np.float32(0):
        return np.uint16(0)
    if value < LEAST_NORMAL:
        return np.uint16(np.rint(value * TINY))
    bits = np.uint32(np.float32(min(value, LARGEST)).view(np.uint32))
    return np.uint16(
        (bits + np.uint32(0xFFF) + ((bits >> np.uint32(13)) & np.uint32(1)) - np.uint32(112 << 23)) >> np.uint32(13)
    )


@parallel()
def put_sums(bits, values, rows, places, factors):  # type: ignore[no-untyped-def]
    """Write sums over n of values (n, T, 3) x factors (n, 3), at `rows` (K,), to bits (m, 4) at `places` (K,)."""
    for k in numba.prange(len(rows)):
        for c in range(3):
            total = np.float32(0)
            for number in range(values.shape[0]):
                total += values[number, rows[k], c] * factors[number, c]
            bits[places[k], c] = half_bits(total)
