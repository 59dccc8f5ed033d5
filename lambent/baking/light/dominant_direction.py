"""The dominant light direction at a texel, by which the renderer shades with normal maps.

It is the mean of the directions w of incident light, weighted by their luminous share of the irradiance E:

    D = integral of L(w) cos w dw / E

It is 2/3 n under a uniform sky and has length 1 for a single lamp. It is baked for materials with normal maps, in world
space.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.baking.light.denoise import fill
from lambent.baking.light.noise import chart_means
from lambent.baking.light.tiles import Stage
from lambent.core.arrays import Floats, Indices
from lambent.core.light.colour import luminance

SAMPLES = 64  # per texel, before averaging with neighbours


def moments(lit: tuple[Floats, Floats | None], max_depth: int) -> Stage:
    """First moments of incident light, like irradiance; surfaces show the finished light map `lit` of both sides."""
    return Stage((SAMPLES, SAMPLES), 0.0, max_depth, SAMPLES // 2, lit, of_moments=True)


def dominant_direction(raw: Floats, irradiance: Floats, labels: Indices) -> NDArray[np.float16]:
    """(H, W, 3) D from sums of moments (2, H, W, 4) and irradiance (H, W, 3); 0 on charts without moments.

    Moments and irradiance are averaged over the same texels of a chart before division, so that a gradient of the light
    across texels does not tilt the direction.
    """
    count = raw[..., 3].sum(axis=0)
    known = count > 0
    moment = raw[..., :3].sum(axis=0) / np.maximum(count, 1)[..., None]
    light = np.where(known, luminance(np.asarray(irradiance, np.float32)), 0)
    means, _ = chart_means(np.concatenate([moment, light[..., None]], axis=-1), known, labels)
    direction = means[..., :3] / np.maximum(means[..., 3:], 1e-12)
    direction /= np.maximum(np.linalg.norm(direction, axis=-1, keepdims=True), 1)
    bumpy = np.isin(labels, np.unique(labels[known])) & (labels >= 0)
    return np.where(bumpy[..., None], fill(direction, known, labels), 0).astype(np.float16)
