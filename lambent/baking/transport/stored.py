"""Storage format of transport: half floats, wavelets of one curve."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.baked.transport.wavelets import transformed
from lambent.core.light.colour import HALF_MAX

STEPS = 256  # brightest light in stored units: leaves room for quotients above 1 at grazing angles
STEPS_OF_FLOAT = 1024  # exponents of positive floats, with their first two fraction bits


def scale_of(brightest: float) -> float:
    """Unit of stored values, W/(sr m^2), for points that receive at most `brightest`, W/m^2.

    Half floats range from 1e-9 to 250 times that.
    """
    return max(brightest, 1e-30) / STEPS


def wavelet_rows(bands: NDArray[np.float32], scale: float) -> NDArray[np.float16]:
    """(J, 3, P) wavelets, as half floats, of transport (J, 3, P) by bands."""
    return halves(transformed(bands) / np.float32(scale))


def halves(values: NDArray[np.float32]) -> NDArray[np.float16]:
    """The nearest half floats, clamped to their range."""
    return np.asarray(np.clip(values, -HALF_MAX, HALF_MAX), np.float16)


def largest_of_each(rows: NDArray[np.float32], tolerance: float, always: int) -> NDArray[np.bool_]:
    """(N, P) flags of the rows (N, 3, P) that hold, at each point, all but the share `tolerance` of its norm.

    They are the largest, to a quarter of a power of two in their squares, and the first `always` if not 0.
    """
    points = rows.shape[2]
    energy = np.einsum("ncp,ncp->np", rows, rows)
    steps = energy.view(np.uint32) >> 21  # a float's exponent and first two fraction bits
    place = steps + (np.arange(points, dtype=np.uint32) * STEPS_OF_FLOAT)
    histogram = np.bincount(place.ravel(), energy.ravel(), points * STEPS_OF_FLOAT).reshape(points, STEPS_OF_FLOAT)
    dropped = np.cumsum(histogram, axis=1) <= tolerance**2 * histogram.sum(axis=1, keepdims=True)
    kept = (steps >= dropped.sum(axis=1)) & (energy > 0)
    kept[:always] = energy[:always] > 0
    return np.asarray(kept)
