"""Numbers that go up and down in small steps, as bytes that files pack well: those of the steps, place by place."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

PLACES = 4


def delta_bytes(numbers: NDArray[np.integer]) -> NDArray[np.uint8]:
    """(4, ...) bytes of numbers (...) below 2^32, lowest first: of the steps from each to the next, row by row."""
    steps = np.diff(numbers.astype(np.uint32).reshape(-1), prepend=np.uint32(0))
    places = steps.astype("<u4").view(np.uint8).reshape(-1, PLACES)
    return np.ascontiguousarray(places.T).reshape(PLACES, *numbers.shape)


def from_delta_bytes(places: NDArray[np.uint8]) -> NDArray[np.uint32]:
    """The numbers (...) of `delta_bytes` (4, ...)."""
    steps = np.ascontiguousarray(places.reshape(PLACES, -1).T).view("<u4")[:, 0]
    return np.cumsum(steps, dtype=np.uint32).reshape(places.shape[1:])
