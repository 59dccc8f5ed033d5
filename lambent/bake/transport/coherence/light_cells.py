"""Cells of distant lights: each is the directions that are nearest to its light, a Voronoi cell on the sphere."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats, Indices
from lambent.core.octahedral import texel_directions, to_square

TABLE = 512  # texels of an edge of the octahedral map by which cells are looked up


def neighbours(directions: Floats) -> NDArray[np.int64]:
    """Lights whose cells touch that of each light, (M, K): a light itself fills the places that are left in its row.

    Two cells touch where the Delaunay triangulation, of points on a sphere their convex hull, has an edge.

    Parameters
    ----------
    directions : (M, 3)
        Unit directions of the lights, all different; at least four, not all in one plane.
    """
    from scipy.spatial import ConvexHull

    corners = ConvexHull(np.asarray(directions, float)).simplices
    both = np.concatenate([corners[:, [i, j]] for i in range(3) for j in range(3) if i != j])
    edges = np.unique(both, axis=0)
    count = np.bincount(edges[:, 0], minlength=len(directions))
    table = np.repeat(np.arange(len(directions))[:, None], count.max(), axis=1)
    place = np.arange(len(edges)) - np.repeat(np.cumsum(count) - count, count)
    table[edges[:, 0], place] = edges[:, 1]
    return table


class CellTable:
    """Which light's cell a direction lies in, by an octahedral map."""

    def __init__(self, directions: Floats) -> None:
        from scipy.spatial import cKDTree

        self._cell = cKDTree(directions).query(texel_directions(TABLE).reshape(-1, 3))[1]

    def at(self, w: Floats) -> Indices:
        """Lights (n,) in whose cells the directions w (n, 3), of any length, lie."""
        column, row = np.clip((to_square(w) * TABLE).astype(np.int64), 0, TABLE - 1).T
        return np.asarray(self._cell[row * TABLE + column])
