"""Numbers as the bytes of their steps."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.baked.answering.delta_bytes import delta_bytes, from_delta_bytes


@pytest.mark.parametrize("shape", [(0,), (1,), (5, 8), (6, 4, 4)])
def test_numbers_come_back(shape: tuple[int, ...]) -> None:
    numbers = np.random.default_rng(0).integers(0, 1 << 32, shape, dtype=np.uint32)
    places = delta_bytes(numbers)
    assert places.dtype == np.uint8 and places.shape == (4, *shape)
    assert np.array_equal(from_delta_bytes(places), numbers)
