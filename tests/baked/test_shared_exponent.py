"""Colours in 32 bits: known words, rounding, both ends of the range."""

from __future__ import annotations

import numpy as np

from lambent.baked.shared_exponent import LARGEST, ONES, packed_rgb, unpacked_rgb


def test_known_words() -> None:
    """1 is 256 times 2^-8: exponent 16. Half of it keeps the exponent where 1 stands beside it."""
    colours = np.array([[1, 1, 1], [1, 0.5, 0], [LARGEST] * 3, [0, 0, 0]], np.float32)
    ones, mixed, largest = 16 << 27 | 256 << 18 | 256 << 9 | 256, 16 << 27 | 128 << 9 | 256, 31 << 27 | ONES
    assert packed_rgb(colours).tolist() == [ones, mixed, largest, 0]
    assert np.array_equal(unpacked_rgb(packed_rgb(colours)), colours)


def test_rounding_is_below_a_511th_of_the_largest_channel() -> None:
    rng = np.random.default_rng(1)
    colours = (rng.random((20_000, 3)) * 2.0 ** rng.uniform(-14, 15.9, (20_000, 1))).astype(np.float32)
    error = np.abs(unpacked_rgb(packed_rgb(colours)) - colours).max(axis=1)
    assert (error <= np.maximum(colours.max(axis=1) / 511, 2.0**-25)).all()


def test_a_mantissa_that_rounds_up_to_512_takes_the_next_exponent() -> None:
    colours = np.array([[511.9 / 256, 1, 0.1]], np.float32)
    assert np.allclose(unpacked_rgb(packed_rgb(colours)), colours, atol=2 / 512)


def test_what_is_out_of_range_is_clamped() -> None:
    found = unpacked_rgb(packed_rgb(np.array([[1e9, -3.0, 1.0], [1e-9, 0, 0]], np.float32)))
    assert found.tolist() == [[LARGEST, 0.0, 0.0], [0.0, 0.0, 0.0]]
