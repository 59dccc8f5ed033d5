"""Distances to the surfaces of a scene: all its triangles in one mesh, without materials or lights."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.bake.tracing.rays import distances, rays_from
from lambent.core.arrays import Floats
from lambent.store.contract import FAR


class Surfaces:
    """Triangles of a scene, for rays from its cameras."""

    def __init__(self, positions: Floats, faces: NDArray[np.uint32]) -> None:
        """`positions` (V, 3), `faces` (T, 3)."""
        mesh = mi.Mesh("all", len(positions), len(faces))
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = mi.Float(np.asarray(positions, np.float32).ravel())
        parameters["faces"] = mi.UInt32(np.asarray(faces, np.uint32).ravel())
        parameters.update()
        dark = {"type": "point", "position": [0.0, 0.0, 0.0], "intensity": 0.0}  # Mitsuba warns without a light
        self._scene = mi.load_dict({"type": "scene", "all": mesh, "dark": dark})

    def distance(self, origin: Floats, directions: Floats) -> Floats:
        """Metres (n,) from a point (3,) along unit directions (n, 3), FAR without a hit."""
        return np.minimum(distances(self._scene, rays_from(origin, directions)), FAR)
