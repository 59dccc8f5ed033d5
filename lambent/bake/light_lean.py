"""Where the light of a texel comes from on the whole: what diffuse light on a bent normal is computed from.

The lean of light is the mean of its directions w, weighted by what each adds to the irradiance E, by luminance:

    D = integral of L(w) cos w dw / E

2/3 n under a uniform sky, of length 1 from a single lamp. It is baked where materials have normal maps, in world space.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.bake import paths
from lambent.bake.denoise import fill
from lambent.bake.light_map import Sampling
from lambent.bake.noise_map import chart_means
from lambent.core.colour import luminance

Array = NDArray[np.floating]
SAMPLES = 64  # per texel, then averaged with its neighbours


def leaning(cache: paths.Cache, max_depth: int) -> Sampling:
    """Moments of light, sampled once like irradiance; surfaces show the finished light map."""
    return Sampling((SAMPLES, SAMPLES), 0.0, max_depth, SAMPLES // 2, cache, paths.moment)


def lean_of(raw: Array, irradiance: Array, labels: NDArray[np.integer]) -> NDArray[np.float16]:
    """Lean (H, W, 3) of light from sums of moments (2, H, W, 4) and irradiance (H, W, 3); 0 where it was not asked.

    Moments and irradiance are averaged over the same texels of a chart before the one is divided by the other, so that
    light that changes from texel to texel leans no other way for it.
    """
    count = raw[..., 3].sum(axis=0)
    known = count > 0
    moment = raw[..., :3].sum(axis=0) / np.maximum(count, 1)[..., None]
    light = np.where(known, luminance(np.asarray(irradiance, np.float32)), 0)
    means = chart_means(np.concatenate([moment, light[..., None]], axis=-1), known, labels)
    lean = means[..., :3] / np.maximum(means[..., 3:], 1e-12)
    lean /= np.maximum(np.linalg.norm(lean, axis=-1, keepdims=True), 1)
    bent = np.isin(labels, np.unique(labels[known])) & (labels >= 0)
    return np.where(bent[..., None], fill(lean, known, labels), 0).astype(np.float16)
