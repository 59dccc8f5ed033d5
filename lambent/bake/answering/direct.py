"""The direct part of a light map, from few samples of direct light."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.bake.light.denoise import denoise_charts
from lambent.bake.light.noise import chart_means
from lambent.core.arrays import Flags, Floats, Indices

MOST = 2.0  # times all light: the noise of light that is all direct
MOST_OF_MEAN = 3.0  # times the direct light around: more than all light is noise only where that is large


def cleaned_direct(direct: Floats, known: Flags, light: Floats, labels: Indices) -> NDArray[np.float16]:
    """Direct light (H, W, 3) of a light map (H, W, 3): denoised, at most all of it.

    Samples far above the light map are cut first: lobes focus light on few of them, which no filter takes for noise.

    Parameters
    ----------
    direct : (H, W, 3)
        Noisy direct irradiance, where `known`.
    labels : (H, W) int
        Chart of each texel.
    """
    given = np.asarray(light, np.float32) * known[..., None]
    around = chart_means(np.minimum(direct, given), known, labels)
    most = np.maximum(given, np.minimum(MOST_OF_MEAN * around, MOST * given))
    clean = denoise_charts(np.minimum(direct, most), known, labels)
    return np.asarray(np.minimum(clean.astype(np.float16), np.asarray(light, np.float16)), np.float16)
