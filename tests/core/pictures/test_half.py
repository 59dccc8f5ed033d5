"""Bits of half floats as numpy has them."""

from __future__ import annotations

import numba
import numpy as np

from lambent.core.light.colour import HALF_MAX
from lambent.core.pictures.half import half_bits, put_sums


@numba.njit
def _all(values, found):  # type: ignore[no-untyped-def]
    for i in range(len(values)):
        found[i] = half_bits(values[i])


def bits(values: np.ndarray) -> np.ndarray:
    """Of float32 values (n,)."""
    found = np.zeros(len(values), np.uint16)
    _all(values, found)
    return found


def test_every_half_float_is_itself() -> None:
    each = np.arange(0x7C00, dtype=np.uint16)
    assert np.array_equal(bits(each.view(np.float16).astype(np.float32)), each)


def test_values_between_are_rounded_as_numpy_rounds() -> None:
    rng = np.random.default_rng(0)
    values = np.exp(rng.uniform(np.log(1e-9), np.log(6e4), 100_000)).astype(np.float32)
    middle = (np.arange(0x7BFE, dtype=np.uint16).view(np.float16).astype(np.float32)
              + np.arange(1, 0x7BFF, dtype=np.uint16).view(np.float16).astype(np.float32)) / 2  # fmt: skip
    for one in (values, middle):
        assert np.array_equal(bits(one), one.astype(np.float16).view(np.uint16))


def test_what_no_texture_holds_is_bounded() -> None:
    wild = np.array([-1.0, np.nan, np.inf, 1e9, 0.0], np.float32)
    assert bits(wild).view(np.float16).tolist() == [0, 0, HALF_MAX, HALF_MAX, 0]


def test_sums_of_rows_are_put_where_they_belong() -> None:
    rng = np.random.default_rng(1)
    values, factors = rng.random((3, 9, 3), np.float32), rng.random((3, 3), np.float32)
    rows, places = np.array([8, 0, 4]), np.array([1, 5, 2])
    bits = np.zeros((6, 4), np.uint16)
    put_sums(bits, values, rows, places, factors)
    expected = np.zeros((6, 4))
    expected[places, :3] = np.einsum("ntc,nc->tc", values, factors)[rows]
    assert np.allclose(bits.view(np.float16), expected, rtol=1e-3)
