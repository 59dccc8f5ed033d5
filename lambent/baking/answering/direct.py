"""The direct part of a light map, from few samples of direct light."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.baking.light.denoise import denoise_charts
from lambent.baking.light.noise import chart_means
from lambent.core.arrays import Flags, Floats, Indices

SAME = 0.2  # of their sum: the most that the halves' local means differ by in plain noise


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
