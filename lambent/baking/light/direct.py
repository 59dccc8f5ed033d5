"""The direct part of a light map, from few samples of its own (`cleaned_direct`), or from the same paths.

Of the same paths, the direct share is denoised, not the direct light.

Much of the noise of direct and total light is common to both, so shares are smoother than light, and a share of the
finished map follows it along shadow edges and seams. The mean of quotients is not the quotient of means, so shares are
scaled to give groups of texels the direct light of their samples. Where samples differ from the filter by more than
their noise explains, as beside lamps and on objects of few texels, the filter has lost detail, and samples count
(Wiener's filter).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.baking.light.denoise import denoise_charts, fill
from lambent.baking.light.noise import chart_means
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.light.colour import luminance

MOST_BIAS = 1.5  # largest correction factor of a share
MOST_RELATIVE = 1e6  # squared standard error by squared light
SAME = 0.2  # of their sum: the most that halves' local means differ by in plain noise


def direct_part(
    direct: Floats, whole: Floats, variance: Floats, light: NDArray[np.float16], known: Flags, labels: Indices,
    smooth: int,
) -> NDArray[np.float16]:  # fmt: skip
    """Direct light (H, W, 3) of a finished light map `light` (H, W, 3), never above that.

    Parameters
    ----------
    direct, whole : (H, W, 3)
        Samples of direct and of all light, valid where `known` (H, W).
    variance : (H, W)
        Squared standard error of the luminance of `whole`, or more: see `sampling.variance_of`.
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
    clean = (clean * level.clip(1 / MOST_BIAS, MOST_BIAS)).clip(0, 1)
    clean += (share - clean) * _trust(share, clean, whole, variance, known, labels)
    clean = fill(clean, known, labels).clip(0, 1)
    return np.asarray(np.minimum(clean.astype(np.float32) * light, light), np.float16)


def _trust(share: Floats, clean: Floats, whole: Floats, variance: Floats, known: Flags, labels: Indices) -> Floats:
    """(H, W, 1) how much sampled shares (H, W, 3) count beside denoised ones: 0 where noise explains the difference.

    Noise of direct light changes a share s by 1 - s of the relative noise of all light. It counts twice, since indirect
    light is noisy as well; with equal relative noise of both, this is an upper bound.
    """
    difference = ((share - clean) ** 2).mean(axis=-1)
    noise = np.stack([difference, variance, luminance(np.asarray(whole, np.float32)) ** 2], axis=-1)
    found, squared, of_light = np.moveaxis(chart_means(noise.astype(np.float32), known, labels)[0], -1, 0)
    relative = np.minimum(squared / np.maximum(of_light, 1e-20), MOST_RELATIVE)  # unlit charts must not overflow
    expected = relative * 2 * (1 - clean.mean(axis=-1)) ** 2
    return np.asarray(np.clip(1 - expected / np.maximum(found, 1e-12), 0, 1)[..., None])


def cleaned_direct(halves: Floats, known: Flags, light: Floats, labels: Indices) -> NDArray[np.float16]:
    """Direct light (H, W, 3) of a light map (H, W, 3): denoised, at most all of it.

    Samples above the light map are cut first, at twice its light where both halves agree: light that lobes focus on a
    few samples is in one half alone, and no filter takes it for noise.

    Parameters
    ----------
    halves : (2, H, W, 3)
        Noisy direct irradiance by independent samples, where `known`.
    labels : (H, W) int
        Chart of each texel.
    """
    given = np.asarray(light, np.float32) * known[..., None]
    one, other = (chart_means(np.minimum(half, 2 * given), known, labels)[0] for half in halves)
    same = np.abs(one - other) < SAME * (one + other)
    clean = denoise_charts(np.minimum(halves.mean(axis=0), given * (1 + same)), known, labels)
    return np.asarray(np.minimum(clean.astype(np.float16), np.asarray(light, np.float16)), np.float16)
