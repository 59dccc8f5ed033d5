"""Level correction: regions of a denoised light map keep the light of their samples.

Samples of a room lit through windows are skewed: many are dark, few very bright. The denoiser treats some bright ones
as outliers, and darkens a region the more, the noisier it is. Sums over hundreds of texels have little noise, so each
texel is scaled by the quotient of two sums around it: of samples, and of denoised light.

Where few paths find the light, or charts are small, the quotient is still noisy. It is shrunk by the share of noise in
its variance: the posterior mean for normally distributed quotients. It shrinks towards the quotient of all that is as
noisy in its chart, since the denoiser may have darkened that to a fifth. Charts are not scaled together: three lucky
paths at a candle would brighten the walls.

The paths that bring light make its variance, as for Poisson's numbers: the variance of a sum is in proportion to its
light, by the light of one path, which is that of the chart, or of the map where few have arrived. A region's own
samples would not do: where none has arrived they agree on darkness, as if they had no noise.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from lambent.baking.light.noise import chart_means
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.light.colour import luminance

REACH = 12  # texels to each side: 25 x 25
SPREAD = 0.3  # standard deviation of true quotients about their mean
FEW = 4.0  # paths: of so many the variance is unknown, of twice as many it is known


def with_level(clean: Floats, noisy: Floats, known: Flags, labels: Indices, variance: Floats | None = None) -> Floats:
    """Scale denoised light (H, W, 3) to the level of its samples `noisy` (H, W, 3), by luminance.

    Parameters
    ----------
    known : (H, W) bool
        Sampled texels.
    labels : (H, W) int
        Chart of each texel, -1 in gutters, which are unchanged.
    variance : (H, W), optional
        Squared standard error of the luminance of `noisy`, or more. Otherwise all that the denoiser changes is noise.
    """
    light, sampled = (luminance(np.asarray(one, np.float64)) for one in (clean, noisy))
    noise = (sampled - light) ** 2 if variance is None else np.asarray(variance, np.float64)
    counted = known & (labels >= 0)
    _, chart = np.unique(labels, return_inverse=True)
    chart = chart.reshape(labels.shape)

    def by_chart(*values: Floats) -> list[Any]:
        """Sums over each chart (C,)."""
        return [np.bincount(chart.reshape(-1), (counted * one).reshape(-1)) for one in values]

    of_samples, of_noise = by_chart(sampled, noise)
    of_path: Any = 0.0
    for some, their_noise in ((of_samples.sum(), of_noise.sum()), (of_samples, of_noise)):
        paths = _share(some**2, their_noise, np.where(some > 0, np.inf, 0.0))
        of_path = of_path + np.clip(paths / FEW - 1, 0, 1) * (_share(their_noise, some, 0.0) - of_path)

    both = np.stack([sampled, light], axis=-1).astype(np.float32)
    means, count = chart_means(both, counted, labels, REACH)
    of_samples, of_light = np.moveaxis(means.astype(float) * count[..., None], -1, 0)
    quotient, trust = _share(of_samples, of_light, 1.0), _trust(of_path[chart], of_light)
    of_samples, of_light = by_chart((1 - trust) * light * quotient, (1 - trust) * light)
    mean = (1 + _trust(of_path, of_light) * (_share(of_samples, of_light, 1.0) - 1))[chart]
    scale = np.where(labels >= 0, mean + trust * (quotient - mean), 1.0)
    return np.asarray(clean * scale[..., None], clean.dtype)


def _share(part: Any, whole: Any, otherwise: Any) -> Floats:
    """Quotients, or `otherwise` of nothing."""
    return np.asarray(
        np.divide(part, whole, out=np.full(np.shape(whole), otherwise, float), where=np.greater(whole, 0))
    )


def _trust(ratio: Floats, light: Floats) -> Floats:
    """Trust in quotients of sums of so much light, whose variance is `ratio` times that."""
    return np.asarray(SPREAD**2 / (SPREAD**2 + _share(ratio, light, np.inf)))
