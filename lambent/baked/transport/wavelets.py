"""Daubechies' orthonormal wavelets with four taps, periodic (Daubechies 1988; Ben-Artzi 2007, table 4.1).

Coefficients are ordered by level, coarse to fine: the mean, then 1, 2, 4, ... details. The transform is orthonormal and
preserves dot products: c . T = transformed(c) . transformed(T) (Ben-Artzi 2007, eqs 4.18, 4.19).
"""

from __future__ import annotations

import numpy as np

from lambent.core.arrays import Floats

ROOT3 = np.sqrt(3)
TAPS = np.array([1 + ROOT3, 3 + ROOT3, 3 - ROOT3, 1 - ROOT3]) / (4 * np.sqrt(2))


def transformed(values: Floats) -> Floats:
    """Wavelet coefficients of `values` (J, ...) along the first axis; J must be a power of two."""
    a, b, c, d = TAPS.astype(values.dtype)
    out, size = np.array(values), len(values)
    if size < 1 or size & (size - 1):
        raise ValueError(f"wavelets need a power of two, not {size} bands")
    while size > 1:
        even, odd = out[:size:2].copy(), out[1:size:2].copy()
        even_next, odd_next = np.roll(even, -1, axis=0), np.roll(odd, -1, axis=0)
        out[: size // 2] = a * even + b * odd + c * even_next + d * odd_next
        out[size // 2 : size] = d * even - c * odd + b * even_next - a * odd_next
        size //= 2
    return out
