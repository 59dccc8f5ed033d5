"""The points of a light field above the horizon of a place on a surface.

Thesis R, section 3: the nearest points p to a place t with n_t . normalize(p - t) > cos 85 deg, nearest first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lambent.baked.light_fields.light_field import CANDIDATES, NO_POINT
from lambent.core.arrays import Flags, Floats, Indices

HORIZON_DEG = 85.0
FIRST_ASKED = 12  # nearest points searched first; most places find their four among them
AT_ONCE = 1 << 16


Sees = Callable[[Floats, Floats, Floats], Flags]  # places, normals, points (n, 3) -> unoccluded (n,)


def nearest_points(places: Floats, normals: Floats, points: Floats, sees: Sees | None = None) -> NDArray[np.uint16]:
    """(n, 4) nearest points (P, 3) above the horizon of places (n, 3) with unit normals (n, 3), padded with NO_POINT.

    With `sees`, occluded points are left out if any of the FIRST_ASKED nearest is visible: a point beyond a wall does
    not know the light on this side.
    """
    from scipy.spatial import cKDTree

    found = np.full((len(places), CANDIDATES), NO_POINT, np.uint16)
    tree = cKDTree(points) if len(points) else None
    for start in range(0, len(places), AT_ONCE):
        left, asked = np.arange(start, min(start + AT_ONCE, len(places))), FIRST_ASKED
        while tree is not None and len(left):
            first, asked = asked == FIRST_ASKED, min(asked, len(points))
            distance, index = tree.query(places[left], asked)
            near = _Near(places[left], normals[left], points, distance.reshape(-1, asked), index.reshape(-1, asked))
            chosen, known = near.chosen(near.above())
            if first and sees is not None:
                seen = near.seen(sees)
                any_seen = seen.any(axis=1)
                chosen[any_seen], known = near.chosen(seen)[0][any_seen], known | any_seen
            found[left[known]] = chosen[known]
            left, asked = left[~known], 4 * asked
    return found


@dataclass(frozen=True)
class _Near:
    """Places and normals (n, 3), all points (P, 3), and each place's nearest by `index` and `distance` (n, k)."""

    places: Floats
    normals: Floats
    points: Floats
    distance: Floats
    index: Indices

    def above(self) -> Flags:
        """(n, k) whether each point is above the horizon."""
        offset = self.points[self.index] - self.places[:, None]
        length = np.linalg.norm(offset, axis=-1)
        return np.asarray((offset * self.normals[:, None]).sum(axis=-1) > np.cos(np.radians(HORIZON_DEG)) * length)

    def seen(self, sees: Sees) -> Flags:
        """(n, k) whether each point is also visible from its place."""
        found = self.above()
        row, column = np.nonzero(found)
        found[row, column] = sees(self.places[row], self.normals[row], self.points[self.index[row, column]])
        return found

    def chosen(self, which: Flags) -> tuple[NDArray[np.uint16], Flags]:
        """The nearest CANDIDATES of the flagged points (n, k), and whether no farther point can replace them (n,)."""
        key = np.where(which, self.distance, np.inf)
        order = np.lexsort((self.index, key))[:, :CANDIDATES]
        best, at = np.take_along_axis(key, order, axis=1), np.take_along_axis(self.index, order, axis=1)
        found = np.full((len(self.places), CANDIDATES), NO_POINT, np.uint16)
        found[:, : at.shape[1]] = np.where(np.isfinite(best), at, NO_POINT)
        everything = self.index.shape[1] == len(self.points)
        known = np.full(len(found), True) if everything else best[:, -1] < self.distance[:, -1]
        return found, known
