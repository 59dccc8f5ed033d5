"""The level of denoised light: regions of a light map keep the light of their samples.

Samples of a room lit through windows are skewed, many dark and few very bright ones. The denoiser takes the bright ones
for outliers in part: it returns the less light, the noisier a region is. Sums over hundreds of texels have little
noise left, so each texel is scaled by the quotient of two sums around it, of samples and of denoised light.

A quotient of a small chart still has noise. It is drawn towards 1 by the share of its variance: the mean of a normal
distribution of quotients after one measurement.
"""

from __future__ import annotations

import numpy as np

from lambent.bake.light.noise import chart_means
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.colour import luminance

REACH = 12  # texels to each side: 25 x 25
SPREAD = 0.3  # standard deviation of true quotients about 1


def with_level(clean: Floats, noisy: Floats, known: Flags, labels: Indices) -> Floats:
    """Denoised light (H, W, 3), scaled to the level of its samples `noisy` (H, W, 3), by the luminance of both.

    Parameters
    ----------
    known : (H, W) bool
        Texels that were sampled.
    labels : (H, W) int
        Chart of each texel, -1 in gutters, which stay as they are.
    """
    denoised, sampled = (luminance(np.asarray(light, np.float32)) for light in (clean, noisy))
    parts = np.stack([sampled, denoised, (sampled - denoised) ** 2], axis=-1)
    means, count = chart_means(parts, known, labels, REACH)
    of_samples, of_clean, square = np.moveaxis(means, -1, 0)
    lit = (labels >= 0) & (of_clean > 0) & (count > 0)
    quotient = np.divide(of_samples, of_clean, out=np.ones_like(of_clean), where=lit)
    variance = np.divide(square, of_clean**2 * count, out=np.full_like(of_clean, np.inf), where=lit)
    trust = SPREAD**2 / (SPREAD**2 + variance)
    scale = np.where(lit, 1 + trust * (quotient - 1), 1.0)
    return np.asarray(clean * scale[..., None], clean.dtype)
