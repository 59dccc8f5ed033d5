"""Level correction: regions of a denoised light map keep the light of their samples.

Samples of a room lit through windows are skewed: many are dark, few very bright. The denoiser treats some bright ones
as outliers, and darkens a region the more, the noisier it is. Sums over hundreds of texels have little noise, so each
texel is scaled by the quotient of two sums around it: of samples, and of denoised light.

In a small chart the quotient is still noisy. It is shrunk towards 1 by the share of noise in its variance: the
posterior mean for normally distributed quotients.
"""

from __future__ import annotations

import numpy as np

from lambent.baking.light.noise import chart_means
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.light.colour import luminance

REACH = 12  # texels to each side: 25 x 25
SPREAD = 0.3  # standard deviation of true quotients about 1


def with_level(clean: Floats, noisy: Floats, known: Flags, labels: Indices) -> Floats:
    """Scale denoised light (H, W, 3) to the level of its samples `noisy` (H, W, 3), by luminance.

    Parameters
    ----------
    known : (H, W) bool
        Sampled texels.
    labels : (H, W) int
        Chart of each texel, -1 in gutters, which are unchanged.
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
