"""Numbers as the bytes of their steps."""

from __future__ import annotations

import zlib

import numpy as np
import pytest

from lambent.baked.answering.delta_bytes import delta_bytes, from_delta_bytes


@pytest.mark.parametrize("shape", [(0,), (1,), (5, 8), (6, 4, 4)])
def test_numbers_come_back(shape: tuple[int, ...]) -> None:
    numbers = np.random.default_rng(0).integers(0, 1 << 32, shape, dtype=np.uint32)
    places = delta_bytes(numbers)
    assert places.dtype == np.uint8 and places.shape == (4, *shape)
    assert np.array_equal(from_delta_bytes(places), numbers)


def test_steps_pack_better_than_numbers() -> None:
    numbers = np.cumsum(np.random.default_rng(1).integers(0, 9, 10_000)) + 100_000
    whole, steps = zlib.compress(numbers.astype(np.uint32).tobytes()), zlib.compress(delta_bytes(numbers).tobytes())
    assert len(steps) < len(whole) / 2
