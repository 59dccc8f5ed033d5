"""Low-discrepancy sequences, and the warps that map them to the hemisphere."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats


def radical_inverse(index: NDArray[np.integer], base: int) -> Floats:
    """Digits of `index` in `base`, mirrored about the radix point: values in [0, 1)."""
    rest, scale = np.array(index, dtype=np.int64), 1.0 / base
    value = np.zeros(rest.shape)
    while rest.any():
        value += scale * (rest % base)
        rest //= base
        scale /= base
    return value


def hammersley(n: int) -> Floats:
    """(n, 2) Hammersley points in [0, 1)^2: (k + 1/2)/n and the base-2 radical inverse of k."""
    k = np.arange(n)
    return np.stack([(k + 0.5) / n, radical_inverse(k, 2)], axis=-1)


def r2(n: int, offset: tuple[float, float] = (0.5, 0.5)) -> Floats:
    """(n, 2) points of the additive R2 sequence, based on the plastic number (Roberts 2018), in [0, 1)^2."""
    plastic = 1.32471795724474602596
    k = np.arange(1, n + 1)[:, None]
    return np.asarray((np.asarray(offset) + k * np.array([1 / plastic, 1 / plastic**2])) % 1.0)


def cosine_hemisphere(u: Floats) -> Floats:
    """Cosine-distributed directions (..., 3) from u (..., 2) in [0, 1)^2; pdf = cos(theta)/pi."""
    r, phi = np.sqrt(u[..., 0]), 2 * np.pi * u[..., 1]
    return np.stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(np.maximum(0, 1 - u[..., 0]))], axis=-1)
