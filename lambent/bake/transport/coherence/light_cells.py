"""Cells of distant lights: the directions nearest to each light, that is, Voronoi cells on the sphere."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats, Indices
from lambent.core.octahedral import texel_directions, to_square

TABLE = 512  # texels along a side of the octahedral map for looking up cells


def neighbours(directions: Floats) -> NDArray[np.int64]:
    """Lights whose cells are adjacent to each light's, (M, K); unused places hold the light itself.

    Two cells are adjacent if the Delaunay triangulation, for points on a sphere their convex hull, has an edge.

    Parameters
    ----------
    directions : (M, 3)
        Distinct unit directions of the lights; at least four, not all in one plane.
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
    """Looks up the light whose cell contains a direction, by an octahedral map."""

    def __init__(self, directions: Floats) -> None:
        from scipy.spatial import cKDTree

        self._cell = cKDTree(directions).query(texel_directions(TABLE).reshape(-1, 3))[1]

    def at(self, w: Floats) -> Indices:
        """Lights (n,) whose cells contain the directions w (n, 3), of any length."""
        column, row = np.clip((to_square(w) * TABLE).astype(np.int64), 0, TABLE - 1).T
        return np.asarray(self._cell[row * TABLE + column])
