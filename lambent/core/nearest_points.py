"""The points of a light field that a place on a surface has above its horizon.

Thesis R, section 3: of a place t the nearest points p with n_t . normalize(p - t) > cos 85 deg, nearest first.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.light_field import CANDIDATES, NO_POINT

HORIZON_DEG = 85.0
FIRST_ASKED = 12  # points by distance, of which most places find their four
AT_ONCE = 1 << 16


def nearest_points(places: Floats, normals: Floats, points: Floats) -> NDArray[np.uint16]:
    """(n, 4) the nearest points (P, 3) above the horizon of places (n, 3) of unit normals (n, 3), then NO_POINT."""
    from scipy.spatial import cKDTree

    found = np.full((len(places), CANDIDATES), NO_POINT, np.uint16)
    tree = cKDTree(points) if len(points) else None
    for start in range(0, len(places), AT_ONCE):
        left, asked = np.arange(start, min(start + AT_ONCE, len(places))), FIRST_ASKED
        while tree is not None and len(left):
            asked = min(asked, len(points))
            distance, index = tree.query(places[left], asked)
            distance, index = distance.reshape(-1, asked), index.reshape(-1, asked)
            chosen, known = _chosen(places[left], normals[left], points, distance, index)
            found[left[known]] = chosen[known]
            left, asked = left[~known], 4 * asked
    return found


def _chosen(
    places: Floats, normals: Floats, points: Floats, distance: Floats, index: Indices
) -> tuple[NDArray[np.uint16], Flags]:
    """The nearest CANDIDATES of the points asked for that are above the horizon, and where no other can be nearer."""
    offset = points[index] - places[:, None]
    length = np.linalg.norm(offset, axis=-1)
    above = (offset * normals[:, None]).sum(axis=-1) > np.cos(np.radians(HORIZON_DEG)) * length
    key = np.where(above, length, np.inf)
    order = np.lexsort((index, key))[:, :CANDIDATES]
    best, at = np.take_along_axis(key, order, axis=1), np.take_along_axis(index, order, axis=1)
    chosen = np.full((len(places), CANDIDATES), NO_POINT, np.uint16)
    chosen[:, : at.shape[1]] = np.where(np.isfinite(best), at, NO_POINT)
    everything = index.shape[1] == len(points)
    return chosen, np.full(len(places), True) if everything else best[:, -1] < distance[:, -1]
