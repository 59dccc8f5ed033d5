"""The direct part of a light map, from few samples of direct light."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.bake.light.denoise import denoise_charts
from lambent.core.arrays import Flags, Floats, Indices


def cleaned_direct(direct: Floats, known: Flags, light: Floats, labels: Indices) -> NDArray[np.float16]:
    """Direct light (H, W, 3) of a light map (H, W, 3): denoised, at most all of it.

    Samples above the light map itself are cut first: lobes focus light on few of them, which no filter takes for noise.

    Parameters
    ----------
    direct : (H, W, 3)
        Noisy direct irradiance, where `known`.
    labels : (H, W) int
        Chart of each texel.
    """
    given = np.asarray(light, np.float32)
    clean = denoise_charts(np.minimum(direct, given) * known[..., None], known, labels)
    return np.asarray(np.minimum(clean.astype(np.float16), given.astype(np.float16)), np.float16)
