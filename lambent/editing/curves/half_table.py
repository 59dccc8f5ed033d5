"""Tables with an entry for every half float: any function of one channel, fast enough for each frame of a drag."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Image
from lambent.core.kernels import parallel
from lambent.core.light.colour import HALF_MAX
from lambent.editing.products import half_of_float


def looked_up(radiance: Image, table: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """(H, W, 4): entries of `table` (32768,), by the bits of the half floats nearest to radiance (H, W, 3); alpha 255.

    Values are clamped to the range from 0 to the largest half float.
    """
    out = np.empty((*radiance.shape[:2], 4), np.uint8)
    _look_up(out.reshape(-1, 4), np.ascontiguousarray(radiance, np.float32).reshape(-1, 3), table)
    return out


@parallel()
def _look_up(out, values, table):  # type: ignore[no-untyped-def]
    largest = np.float32(HALF_MAX)
    for p in numba.prange(len(values)):
        for c in range(3):
            value = min(max(values[p, c], np.float32(0)), largest)
            out[p, c] = table[half_of_float(value) & 0x7FFF]  # type: ignore[call-arg]  # -0 is 0
        out[p, 3] = 255
