"""The direct part of a light map from the same paths: the direct share is denoised, not the direct light.

Much of the noise of direct and total light is common to both, so shares are smoother than light, and a share of the
finished map follows it along shadow edges and seams. The mean of quotients is not the quotient of means, so shares are
scaled to give groups of texels the direct light of their samples.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.bake.light.denoise import denoise_charts, fill
from lambent.bake.light.noise import chart_means
from lambent.core.arrays import Flags, Floats, Indices

MOST_BIAS = 1.5  # largest correction factor of a share


def direct_part(
    direct: Floats, whole: Floats, light: NDArray[np.float16], known: Flags, labels: Indices, smooth: int
) -> NDArray[np.float16]:
    """Direct light (H, W, 3) of a finished light map `light` (H, W, 3), never above that.

    Parameters
    ----------
    direct, whole : (H, W, 3)
        Samples of direct and of all light, valid where `known` (H, W).
    labels : (H, W) int
        Chart of each texel.
    smooth : int
        As in `fill`.
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
