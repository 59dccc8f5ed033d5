"""Texels of the light map from which a ray reaches the sun."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.baking.light.noise import chart_means
from lambent.baking.running.tiles import seed_of
from lambent.baking.surfaces.texels import POINTS, Texels
from lambent.baking.tracing.lights.sun import SunRays
from lambent.core.arrays import Floats, Indices
from lambent.core.progress import Progress, silent

LEAST_BEND = 0.85  # cosine between a facet and the smooth surface that it stands for: SUN_LEAST_BEND of sun.wgsl
RAYS = 32  # from each of a texel's points, until one arrives
AROUND = 1  # texels to each side: penumbras cross the borders of texels


def sunlit(
    texels: Texels, geometry: dict[str, Floats], labels: Indices, rays: SunRays, seed: int, progress: Progress = silent
) -> NDArray[np.uint8]:
    """(H, W) 0 where no ray of a texel or of its neighbours reaches the sun's disc, 1 elsewhere.

    Neighbours are of the same chart by `labels` (H, W), which are -1 in gutters. Rays leave surfaces on the side that
    faces the sun: no other is lit. Facets stand for the smooth surface of their normals. `geometry` is that of the
    texels, as in `atlas.merged`.
    """
    starts = on_smooth_surface(texels, geometry, rays.direction)
    lit = np.zeros(len(texels.index), bool)
    for turn in range(RAYS):
        progress(turn, RAYS, "where the sun shines")
        left = np.flatnonzero(~lit)
        if not len(left):
            break
        points, normals = (values[left].reshape(-1, 3) for values in starts)
        lit[left] = rays.arrive(points, normals, seed_of(seed, "sun", turn)).reshape(-1, POINTS).any(axis=1)
    share = np.zeros((texels.height, texels.width, 1), np.float32)
    share.reshape(-1)[texels.index] = lit
    around, _ = chart_means(share, labels >= 0, labels, AROUND)
    return np.asarray((around[..., 0] > 0) | (labels < 0), np.uint8)


def on_smooth_surface(texels: Texels, geometry: dict[str, Floats], direction: Floats) -> tuple[Floats, Floats]:
    """Where rays in `direction` (3,) leave points, and the normals there: both (K, POINTS, 3) float32.

    On facets that turn away although their smooth surface does not, this is above the facet by the height of the
    highest tangent plane of its vertices, which is no lower than the smooth surface. Elsewhere it is the facet.
    """
    turned = (texels.flat @ direction < 0) & (texels.normals @ direction > 0)
    turned &= np.sum(texels.flat * texels.normals, axis=-1) > LEAST_BEND
    corner = geometry["faces"][texels.face[turned]]
    from_point = geometry["positions"][corner] - texels.positions[turned][:, None]
    above_m = np.sum(from_point * geometry["normals"][corner], axis=-1).max(axis=-1).clip(0)
    points, normals = texels.positions.copy(), texels.flat.copy()
    points[turned] += above_m[:, None] * texels.normals[turned]
    normals[turned] = texels.normals[turned]
    return points, normals
