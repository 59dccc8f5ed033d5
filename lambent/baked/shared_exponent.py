"""Colours in 32 bits, RGB9E5: three 9-bit mantissas and a shared exponent.

    value = mantissa 2^(e - 24);   r | g << 9 | b << 18 | e << 27        (OpenGL's EXT_texture_shared_exponent)

Colours range from 0 to `LARGEST`. Rounding changes each channel by at most 1/511 of the largest channel, or by 2^-25.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

LARGEST = 65408.0
ONES = (1 << 27) - 1  # mask of the mantissas: a colour with all of these bits 0 is black
_ROUNDED = 1 << 14  # half of the last float32 bit that a mantissa keeps
_OFFSET = 127 - 16  # subtracted from exponents of float32


def packed_rgb(rgb: NDArray[np.float32]) -> NDArray[np.uint32]:
    """Colours (..., 3), not negative, packed into 32 bits each."""
    r, g, b = np.moveaxis(np.clip(rgb, 0, LARGEST).astype(np.float32), -1, 0)
    bits = packed((r, g, b), lambda x: x.view(np.uint32), lambda x: x.view(np.float32), np.uint32, np)
    return np.asarray(bits, np.uint32)


def packed(rgb: tuple[Any, Any, Any], bits: Any, floats: Any, whole: Any, ops: Any) -> Any:
    """Bits of colours in 0 to `LARGEST`; `bits` views float32 as uint32, `floats` reverses it, `whole` rounds down."""
    largest = ops.maximum(ops.maximum(rgb[0], rgb[1]), rgb[2])
    exponent = ops.maximum((bits(largest) + _ROUNDED) >> 23, _OFFSET) - _OFFSET
    scale = floats((127 + 24 - exponent) << 23)
    red, green, blue = (whole(channel * scale + np.float32(0.5)) for channel in rgb)
    return red | (green << 9) | (blue << 18) | (exponent << 27)


def unpacked_rgb(packed: NDArray[np.uint32]) -> NDArray[np.float32]:
    """Colours (..., 3) float32."""
    mantissas = np.stack([packed >> shift & 511 for shift in (0, 9, 18)], axis=-1)
    return np.ldexp(mantissas.astype(np.float32), (packed >> 27).astype(np.int32)[..., None] - 24).astype(np.float32)
