"""The direct part of a light map, from few samples of direct light."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.bake.light.noise import chart_means
from lambent.core.arrays import Flags, Floats, Indices

MOST = 2.0  # times all light; less would cut the noise of light that is nearly all direct
ROUNDS = 3  # of means over 5 x 5 texels: one leaves noise that strong edits show as blotches


def shared_by_charts(direct: Floats, known: Flags, light: Floats, labels: Indices) -> NDArray[np.float16]:
    """Direct light (H, W, 3) as a share of a light map (H, W, 3), at most all of it.

    Shares are those of the means over nearby texels of a chart: the samples' noise is averaged, and the edges are those
    of the light map, which is denoised already. Far from samples (`known`) there is none. Samples count as MOST times
    the light of their texel at most: a lamp that a lobe meets by chance would be a spot in what stays as baked.

    Parameters
    ----------
    direct : (H, W, 3)
        Noisy direct irradiance, where `known`.
    labels : (H, W) int
        Chart of each texel.
    """
    given = np.asarray(light, np.float32)
    sampled = np.minimum(np.asarray(direct, np.float32), MOST * given)
    both = np.concatenate([sampled, given], axis=-1) * known[..., None]
    means = both
    for _ in range(ROUNDS):
        means = chart_means(means, known, labels)
    part, whole = means[..., :3], means[..., 3:]
    share = np.divide(part, whole, out=np.zeros_like(part), where=whole > 0)
    found = (given * np.clip(share, 0, 1)).astype(np.float16)
    return np.asarray(np.minimum(found, np.asarray(light, np.float16)), np.float16)
