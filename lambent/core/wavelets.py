"""Daubechies' orthonormal wavelets with four taps, periodic (Daubechies 1988; Ben-Artzi 2007, table 4.1).

Coefficients are ordered by level, coarse to fine: the mean, then 1, 2, 4, ... details. The transform is orthonormal and
preserves dot products: c . T = transformed(c) . transformed(T) (Ben-Artzi 2007, eqs 4.18, 4.19).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats

ROOT3 = np.sqrt(3)
TAPS = np.array([1 + ROOT3, 3 + ROOT3, 3 - ROOT3, 1 - ROOT3]) / (4 * np.sqrt(2))


def transformed(values: Floats) -> Floats:
    """Wavelet coefficients of `values` (J, ...) along the first axis; J must be a power of two."""
    a, b, c, d = TAPS.astype(values.dtype)
    out, size = np.array(values), _power_of_two(len(values))
    while size > 1:
        even, odd = out[:size:2].copy(), out[1:size:2].copy()
        even_next, odd_next = np.roll(even, -1, axis=0), np.roll(odd, -1, axis=0)
        out[: size // 2] = a * even + b * odd + c * even_next + d * odd_next
        out[size // 2 : size] = d * even - c * odd + b * even_next - a * odd_next
        size //= 2
    return out


def restored(coefficients: Floats) -> Floats:
    """Values (J, ...) of wavelet coefficients: the inverse of `transformed`."""
    a, b, c, d = TAPS.astype(coefficients.dtype)
    out, length, half = np.array(coefficients), _power_of_two(len(coefficients)), 1
    while half < length:
        low, high = out[:half].copy(), out[half : 2 * half].copy()
        low_before, high_before = np.roll(low, 1, axis=0), np.roll(high, 1, axis=0)
        out[: 2 * half : 2] = a * low + d * high + c * low_before + b * high_before
        out[1 : 2 * half : 2] = b * low - c * high + d * low_before - a * high_before
        half *= 2
    return out


def levels(length: int) -> NDArray[np.int64]:
    """(length,) level of each coefficient: 0 for the mean, then 1, 2, ... for its details, coarse to fine."""
    return np.array([j.bit_length() for j in range(_power_of_two(length))])


def _power_of_two(length: int) -> int:
    if length < 1 or length & (length - 1):
        raise ValueError(f"wavelets need a power of two, not {length} bands")
    return length
