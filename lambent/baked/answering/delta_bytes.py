"""Delta coding: slowly changing integers as the bytes of their differences, which compress well."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

PLACES = 4


def delta_bytes(numbers: NDArray[np.integer]) -> NDArray[np.uint8]:
    """(4, ...) bytes, lowest first, of the differences between successive numbers (...) below 2^32, row by row."""
    steps = np.diff(numbers.astype(np.uint32).reshape(-1), prepend=np.uint32(0))
    places = steps.astype("<u4").view(np.uint8).reshape(-1, PLACES)
    return np.ascontiguousarray(places.T).reshape(PLACES, *numbers.shape)


def from_delta_bytes(places: NDArray[np.uint8]) -> NDArray[np.uint32]:
    """Inverse of `delta_bytes`: numbers (...) of bytes (4, ...)."""
    steps = np.ascontiguousarray(places.reshape(PLACES, -1).T).view("<u4")[:, 0]
    return np.cumsum(steps, dtype=np.uint32).reshape(places.shape[1:])
