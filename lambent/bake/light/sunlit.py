"""Texels of the light map from which a ray reaches the sun."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.bake.light.noise import chart_means
from lambent.bake.surfaces.texels import POINTS, Texels
from lambent.bake.tiles import seed_of
from lambent.bake.tracing.sun import SunRays
from lambent.core.arrays import Indices
from lambent.core.progress import Progress, silent

RAYS = 32  # from each of a texel's points, until one arrives
AROUND = 1  # texels to each side: penumbras cross the borders of texels


def sunlit(texels: Texels, labels: Indices, rays: SunRays, seed: int, progress: Progress = silent) -> NDArray[np.uint8]:
    """(H, W) 0 where no ray of a texel or of its neighbours reaches the sun's disc, 1 elsewhere.

    Neighbours are of the same chart by `labels` (H, W), which are -1 in gutters. Rays leave surfaces on the side that
    faces the sun: no other is lit.
    """
    lit = np.zeros(len(texels.index), bool)
    for turn in range(RAYS):
        progress(turn, RAYS, "where the sun shines")
        left = np.flatnonzero(~lit)
        if not len(left):
            break
        points, normals = (values[left].reshape(-1, 3) for values in (texels.positions, texels.flat))
        lit[left] = rays.arrive(points, normals, seed_of(seed, "sun", turn)).reshape(-1, POINTS).any(axis=1)
    share = np.zeros((texels.height, texels.width, 1), np.float32)
    share.reshape(-1)[texels.index] = lit
    around, _ = chart_means(share, labels >= 0, labels, AROUND)
    return np.asarray((around[..., 0] > 0) | (labels < 0), np.uint8)
