"""Noise of the light map: the relative standard error of each texel's irradiance, before denoising.

Both halves of a texel's samples are estimates of the same irradiance E, so that |E_0 - E_1|/2 estimates the standard
error of their mean. A single difference is a poor estimate (with a deviation of 70 %), so squares are averaged over
nearby texels of the same chart: with 25 of them the deviation is some 14 %.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.bake.light.denoise import fill
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.colour import HALF_MAX, luminance

REACH = 2  # texels to each side: 5 x 5


def noise_map(halves: Floats, known: Flags, labels: Indices) -> NDArray[np.float16]:
    """Relative standard error (H, W) of the luminance of the mean of two halves (2, H, W, 3).

    Parameters
    ----------
    known : (H, W) bool
        Texels that were sampled; others take the noise of their neighbours. Black ones have none: 0.
    labels : (H, W) int
        Chart of each texel, -1 in gutters.
    """
    light = luminance(np.asarray(halves, np.float32))
    squares, mean = np.where(known, (light[0] - light[1]) ** 2 / 4, 0), np.where(known, light.mean(axis=0), 0)
    around = chart_means(np.stack([squares, mean], axis=-1), known, labels)
    total, level = around[..., 0], around[..., 1]
    error = np.divide(np.sqrt(total), level, out=np.zeros_like(level), where=level > 0)
    filled = fill(error[..., None], known, labels)[..., 0]
    return np.minimum(filled, HALF_MAX).astype(np.float16)


def chart_means(values: Floats, known: Flags, labels: Indices) -> Floats:
    """Means of values (H, W, C) over the known texels of the same chart within REACH."""
    rim = ((REACH, REACH), (REACH, REACH))
    there, chart = np.pad(known, rim), np.pad(labels, rim, constant_values=-1)
    padded, count = np.pad(values, (*rim, (0, 0))), np.zeros(known.shape, np.float32)
    total = np.zeros_like(values)
    height, width = known.shape
    for row in range(2 * REACH + 1):
        for column in range(2 * REACH + 1):
            window = slice(row, row + height), slice(column, column + width)
            same = there[window] & (chart[window] == labels)
            total += padded[window] * same[..., None]
            count += same
    return np.asarray(total / np.maximum(count, 1)[..., None])
