"""Distances to the surfaces of a scene: all its triangles in one mesh, without materials or lights."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.baking.tracing.rays import distances, rays_from
from lambent.baking.tracing.scene_builder import bare_scene
from lambent.core.arrays import Floats
from lambent.store.contract import FAR


class Surfaces:
    """Triangles of a scene, for rays from its cameras."""

    def __init__(self, positions: Floats, faces: NDArray[np.uint32]) -> None:
        """`positions` (V, 3), `faces` (T, 3)."""
        self._scene = bare_scene(np.asarray(positions)[faces])

    def distance(self, origin: Floats, directions: Floats) -> Floats:
        """Metres (n,) from a point (3,) along unit directions (n, 3), FAR without a hit."""
        return np.minimum(distances(self._scene, rays_from(origin, directions)), FAR)
