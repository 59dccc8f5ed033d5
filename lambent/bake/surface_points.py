"""Random points on triangles, for pilots that ask what light arrives there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.core.directions import normalize

Array = NDArray[np.floating]


def face_areas(corners: Array) -> Array:
    """Areas (F,), m^2, of triangles with corners (F, 3, 3)."""
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(np.linalg.norm(cross, axis=1) / 2)


def points_in(corners: Array, face: NDArray[np.integer], rng: np.random.Generator) -> tuple[Array, Array]:
    """A point (K, 3) in each of the triangles `face` (K,), uniform by area, and the unit normals (K, 3) there.

    `corners` (F, 3, 3) are those of all triangles; none of those chosen may be without area.
    """
    weights = rng.dirichlet((1, 1, 1), size=len(face))
    mine = corners[face]
    normal = normalize(np.cross(mine[:, 1] - mine[:, 0], mine[:, 2] - mine[:, 0]))
    return np.einsum("kcx,kc->kx", mine, weights), normal
