"""The direct part of a light map, from samples of the same paths: its share of the light is denoised, not the light.

Both parts of a path's light have much of their noise in common, so that shares are smoother than light; and a share of
the finished map follows it along edges of shadows and seams. The mean of quotients is not the quotient of means: shares
are scaled so that some texels together have the direct light of their samples.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.bake.light.denoise import denoise_charts, fill
from lambent.bake.light.noise import chart_means
from lambent.core.arrays import Flags, Floats, Indices

MOST_BIAS = 1.5  # of a share, that is mended


def direct_part(
    direct: Floats, whole: Floats, light: NDArray[np.float16], known: Flags, labels: Indices, smooth: int
) -> NDArray[np.float16]:
    """Direct light (H, W, 3) of a finished light map `light` (H, W, 3), nowhere more than that.

    Parameters
    ----------
    direct, whole : (H, W, 3)
        Samples of direct and of all light, where `known` (H, W).
    labels : (H, W) int
        Chart of each texel.
    smooth : int
        As `fill` takes it.
    """
    if not direct.any():
        return np.zeros(light.shape, np.float16)
    share = np.divide(direct, whole, out=np.zeros(whole.shape, np.float32), where=whole > 0).clip(0, 1)
    clean = denoise_charts(share, known, labels, smooth=smooth).clip(0, 1)
    around, _ = chart_means(np.concatenate([direct, clean * whole], -1), known, labels)
    of_samples, of_share = np.split(around, 2, axis=-1)
    level = np.divide(of_samples, of_share, out=np.ones_like(of_share), where=of_share > 0)
    clean = fill(clean * level.clip(1 / MOST_BIAS, MOST_BIAS), known, labels).clip(0, 1)
    return np.asarray(np.minimum(clean.astype(np.float32) * light, light), np.float16)
