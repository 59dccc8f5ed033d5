"""Rays against the scene's triangles, on the CPU: the object under the mouse."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lambent.core.arrays import Floats
from lambent.core.geometry.triangles import ray_distances
from lambent.store.contract import ObjectRecord


class Geometry:
    """Objects that can be picked. positions (V, 3), faces (T, 3) sorted by object; `triangles` (T, 3, 3) float32."""

    def __init__(self, positions: Floats, faces: NDArray[np.integer], objects: Sequence[ObjectRecord]) -> None:
        self._objects = tuple(objects)
        self.triangles = positions[faces].astype(np.float32)

    def pick(self, origin: ArrayLike, direction: Floats) -> ObjectRecord | None:
        """The first object on a ray; None without a hit."""
        return self.hit(origin, direction)[0]

    def free_m(self, origin: ArrayLike, direction: Floats, but: str = "") -> float:
        """Free distance along a ray, ignoring the object named `but`."""
        return self.hit(origin, direction, but)[1]

    def hit(self, origin: ArrayLike, direction: Floats, but: str = "") -> tuple[ObjectRecord | None, float]:
        """The first object on a ray, ignoring `but`, and its distance; None and inf without a hit."""
        start = np.asarray(origin, float)
        nearest, chosen = math.inf, None
        for item in self._objects:
            if item.name == but:
                continue
            entry = _box_entry(start, direction, np.array(item.bounds))
            if entry < nearest:
                triangles = self.triangles[item.first_face : item.first_face + item.face_count]
                distance = first_hit(start, direction, triangles)
                if distance < nearest:
                    nearest, chosen = distance, item
        return chosen, nearest


def first_hit(origin: Floats, direction: Floats, triangles: Floats) -> float:
    """Distance to the nearest of triangles (T, 3, 3), on either side; inf for none."""
    return float(ray_distances(origin, direction, triangles).min(initial=math.inf))


def _box_entry(origin: Floats, direction: Floats, box: Floats) -> float:
    """Distance at which the ray enters the box (2, 3); 0 from inside, inf when it misses."""
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (box - origin) / direction
    t = np.where(np.isnan(t), np.array([[-np.inf], [np.inf]]), t)  # in a face's plane, parallel to it
    enter, leave = np.minimum(*t).max(), np.maximum(*t).min()
    return math.inf if leave < max(enter, 0) - 1e-6 else max(float(enter), 0.0)
