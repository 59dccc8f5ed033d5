"""How exact each texel of the light map is: the relative standard error of its irradiance, before denoising.

Both halves of a texel's samples are estimates of the same irradiance E, so that |E_0 - E_1|/2 estimates the standard
error of their mean. One difference says little of one texel (a deviation of 70 %), so squares are averaged over the
texels of the same chart nearby: with 25 of them the result is exact within some 14 %.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.bake.denoise import fill
from lambent.core.colour import HALF_MAX, luminance

Array = NDArray[np.floating]
REACH = 2  # texels to each side: 5 x 5


def sampled_halves(raw: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Irradiance (2, H, W, 3) of both halves of path traced sums (2, H, W, 4), and where there is any (H, W)."""
    count = raw[..., 3:]
    return raw[..., :3] / np.maximum(count, 1), count[0, ..., 0] > 0


def noise_map(halves: Array, known: NDArray[np.bool_], labels: NDArray[np.integer]) -> NDArray[np.float16]:
    """Relative standard error (H, W) of the luminance of the mean of two halves (2, H, W, 3).

    Parameters
    ----------
    known : (H, W) bool
        Texels that were sampled; others take the noise of what is next to them. Black ones have none: 0.
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


def chart_means(values: Array, known: NDArray[np.bool_], labels: NDArray[np.integer]) -> Array:
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
