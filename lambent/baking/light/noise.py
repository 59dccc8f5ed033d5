"""Noise of the light map: the relative standard error of each texel's irradiance, before denoising.

The two halves of a texel's samples estimate the same irradiance E, so |E_0 - E_1|/2 estimates the standard error of
their mean. A single difference is a poor estimate (70 % deviation), so squares are averaged over nearby texels of the
same chart: with 25 of them the deviation is about 14 %.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from lambent.baking.light.denoise import fill
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.kernels import parallel
from lambent.core.light.colour import HALF_MAX, luminance

REACH = 2  # texels to each side: 5 x 5


def noise_map(halves: Floats, known: Flags, labels: Indices) -> NDArray[np.float16]:
    """Relative standard error (H, W) of the luminance of the mean of two halves (2, H, W, 3).

    Parameters
    ----------
    known : (H, W) bool
        Sampled texels; others take the noise of their neighbours. Black texels have noise 0.
    labels : (H, W) int
        Chart of each texel, -1 in gutters.
    """
    light = luminance(np.asarray(halves, np.float32))
    squares, mean = np.where(known, (light[0] - light[1]) ** 2 / 4, 0), np.where(known, light.mean(axis=0), 0)
    around, _ = chart_means(np.stack([squares, mean], axis=-1), known, labels)
    total, level = around[..., 0], around[..., 1]
    error = np.divide(np.sqrt(total), level, out=np.zeros_like(level), where=level > 0)
    filled = fill(error[..., None], known, labels)[..., 0]
    return np.minimum(filled, HALF_MAX).astype(np.float16)


def chart_means(values: Floats, known: Flags, labels: Indices, reach: int = REACH) -> tuple[Floats, Floats]:
    """Means of values (H, W, C) over the known texels of the same chart within `reach`, and their counts (H, W)."""
    means, count = _chart_means(np.ascontiguousarray(values), known, np.ascontiguousarray(labels), reach)
    return np.asarray(means), np.asarray(count)


@parallel()
def _chart_means(values, known, labels, reach):  # type: ignore[no-untyped-def]
    height, width, channels = values.shape
    means, counts = np.zeros_like(values), np.zeros((height, width), np.float32)
    for row in numba.prange(height):
        for column in range(width):
            count = np.float32(0)
            for y in range(max(row - reach, 0), min(row + reach + 1, height)):
                for x in range(max(column - reach, 0), min(column + reach + 1, width)):
                    if known[y, x] and labels[y, x] == labels[row, column]:
                        count += 1
                        for channel in range(channels):
                            means[row, column, channel] += values[y, x, channel]
            counts[row, column] = count
            for channel in range(channels):
                means[row, column, channel] /= max(count, np.float32(1))
    return means, counts
