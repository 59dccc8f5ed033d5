"""Transport as it is stored: half floats, wavelets of one curve."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.core.wavelets import transformed

STEPS = 256  # parts of the scale that half floats have left above 1: quotients are larger than 1 at grazing angles
STEPS_OF_FLOAT = 1024  # exponents of positive floats, and their first two digits
HALF_MAX = float(np.finfo(np.float16).max)


def scale_of(brightest: float) -> float:
    """What stored values are multiples of, W/(sr m^2), where points get so much light at most, W/m^2.

    Half floats reach from 1e-9 to 250 times as much.
    """
    return max(brightest, 1e-30) / STEPS


def wavelet_rows(bands: NDArray[np.float32], scale: float) -> NDArray[np.float16]:
    """(J, 3, P) half floats, wavelets, of transport (J, 3, P) by bands."""
    return halves(transformed(bands) / np.float32(scale))


def halves(values: NDArray[np.float32]) -> NDArray[np.float16]:
    """Half floats, as near as they come."""
    return np.asarray(np.clip(values, -HALF_MAX, HALF_MAX), np.float16)


def largest_of_each(rows: NDArray[np.float32], tolerance: float, always: int) -> NDArray[np.bool_]:
    """Which of the rows (N, 3, P) hold, at each point, all but a share `tolerance` of its norm: (N, P).

    They are the largest, to a quarter of a power of two in their squares, and the first `always` where they are not 0.
    """
    points = rows.shape[2]
    energy = np.einsum("ncp,ncp->np", rows, rows)
    steps = energy.view(np.uint32) >> 21  # a float's exponent and first two digits
    place = steps + (np.arange(points, dtype=np.uint32) * STEPS_OF_FLOAT)
    histogram = np.bincount(place.ravel(), energy.ravel(), points * STEPS_OF_FLOAT).reshape(points, STEPS_OF_FLOAT)
    dropped = np.cumsum(histogram, axis=1) <= tolerance**2 * histogram.sum(axis=1, keepdims=True)
    kept = (steps >= dropped.sum(axis=1)) & (energy > 0)
    kept[:always] = energy[:always] > 0
    return np.asarray(kept)
