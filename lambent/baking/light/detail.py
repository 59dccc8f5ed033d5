"""Detail that denoising loses: samples count where they differ from the filter by more than their noise explains.

The filter carries light into gaps, and knows objects of few texels badly. Where it does, samples and filtered light are
mixed by Wiener's rule, in proportion to the part of their squared difference that is not noise. Squares are relative to
the light nearby: otherwise a bright neighbour would decide for a dark gap, and a dark room beside a bright one would
have no detail.

Two halves know the noise of rare bright paths badly: in a few of many texels such a path arrives in both, and where
none arrives, samples agree on darkness. The mean square therefore counts as far as it exceeds its own standard error:
not at all where one texel makes it, fully where four do. And noise is at least that of the mean of the texels nearby,
if their relative noise is that of a wider region.
"""

from __future__ import annotations

import numpy as np

from lambent.baking.light.level import REACH
from lambent.baking.light.noise import chart_means
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.light.colour import luminance

DOUBT = 4.0  # times their noise: smaller squared differences are noise, whose estimate has heavy tails
DARK = 0.1  # relative to the mean light nearby: darker light is compared as if it were this bright


def with_detail(clean: Floats, noisy: Floats, variance: Floats, known: Flags, labels: Indices) -> Floats:
    """Denoised light (H, W, 3) with the detail of its samples `noisy` (H, W, 3).

    Parameters
    ----------
    variance : (H, W)
        Squared standard error of the luminance of `noisy`, or more.
    known : (H, W) bool
        Sampled texels; others are unchanged.
    labels : (H, W) int
        Chart of each texel, -1 in gutters.
    """
    light = luminance(np.asarray(clean, np.float32))
    nearby = chart_means(light[..., None], known, labels)[0][..., 0]
    squared = np.maximum(np.maximum(light, DARK * nearby), 1e-12) ** 2  # the least: black texels
    difference = luminance(np.asarray(noisy, np.float32)) - light
    square = difference**2 / squared
    noise = np.minimum(variance / squared, 1e12).astype(np.float32)  # above, quotients overflow
    widely = chart_means(noise[..., None], known, labels, REACH)[0][..., 0]
    parts = np.stack([square, square**2, noise], axis=-1)
    means, count = chart_means(parts.astype(np.float32), known, labels)
    found, fourth, of_halves = np.moveaxis(means, -1, 0)
    expected = np.maximum(DOUBT * of_halves, widely / np.maximum(count, 1))
    error = np.sqrt(fourth / np.maximum(count, 1))
    trust = np.clip(1 - expected / np.maximum(found, 1e-12), 0, 1) * known
    trust *= np.clip(found / np.maximum(error, 1e-12) - 1, 0, 1)
    return np.asarray(clean + trust[..., None] * (noisy - clean), clean.dtype)
