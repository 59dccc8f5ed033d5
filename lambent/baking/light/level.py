"""Level correction: a denoised light map keeps the light of its samples, as a whole, in its charts and in its regions.

Samples of a room lit through windows are skewed: many are dark, few very bright. The denoiser treats some bright ones
as outliers, and darkens a region the more, the noisier it is. Sums over hundreds of texels have little noise, so light
is scaled by quotients of two sums: of samples, and of denoised light.

Sums over few texels are noisy all the same. Quotients are shrunk towards 1 by the share of noise in their variance: the
posterior mean for normally distributed quotients. Rare bright paths may leave a region noisy that the denoiser has
darkened to a fifth, so the whole map is scaled first, then its charts, then the regions: each corrects what is left.

The noise of a sum follows from the light: the same rare paths that bring it make its variance, as for Poisson's
numbers, in one ratio for the map. The differences of the samples would not do. Where rare paths have found nothing,
samples agree on darkness.
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
    within, counted = labels >= 0, known & (labels >= 0)
    sampled, light = (luminance(np.asarray(one, np.float64)) for one in (noisy, clean))
    scale = np.ones(light.shape)
    for sums_of in (_sums_of_map, _sums_of_charts, _sums_of_regions):
        shown = light * scale
        of_samples, of_light = sums_of(np.stack([sampled, shown], axis=-1), counted, labels)
        total = shown[counted].sum()
        ratio = ((sampled - shown)[counted] ** 2).sum() / total if total > 0 else 0.0
        lit = within & (of_light > 0)
        quotient = np.divide(of_samples, of_light, out=np.ones_like(light), where=lit)
        variance = np.divide(ratio, of_light, out=np.full_like(light, np.inf), where=lit)
        scale = np.where(lit, scale * (1 + SPREAD**2 / (SPREAD**2 + variance) * (quotient - 1)), scale)
    return np.asarray(clean * scale[..., None], clean.dtype)


def _sums_of_map(values: Floats, counted: Flags, labels: Indices) -> tuple[Floats, Floats]:
    """Sums of two channels (H, W, 2) over the map, at each texel (H, W)."""
    one, other = (np.full(labels.shape, values[counted, channel].sum()) for channel in (0, 1))
    return one, other


def _sums_of_charts(values: Floats, counted: Flags, labels: Indices) -> tuple[Floats, Floats]:
    """Likewise over the charts."""
    numbers, chart = np.unique(labels, return_inverse=True)  # labels of hidden texels are large
    chart = chart.reshape(labels.shape)
    one, other = (np.bincount(chart[counted], values[counted, c], len(numbers))[chart] for c in (0, 1))
    return one, other


def _sums_of_regions(values: Floats, counted: Flags, labels: Indices) -> tuple[Floats, Floats]:
    """Likewise over the texels of the same chart within REACH."""
    means, count = chart_means(values.astype(np.float32), counted, labels, REACH)
    return means[..., 0] * count, means[..., 1] * count
