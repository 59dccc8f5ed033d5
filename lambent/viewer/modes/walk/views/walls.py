"""Floors that carry a walker, and obstacles between knee and eye, seen from above.

The walker is a circle of radius `BODY_M` around the eye; obstacles are the triangles' outlines on the floor plan. A
step into an outline slides along it; a walker who is already too near may always step away.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.geometry.triangles import area_vectors, ray_distances
from lambent.core.plain import Triple
from lambent.viewer.cameras.cameras import NEAREST_M, WALL_M, Bounds, is_within, way_out_m
from lambent.viewer.cameras.picking import first_hit

STEP_M = 0.35  # a floor higher above the feet than this is a table, not a stair
BODY_M = 0.22
SLIDES = 3  # most slides per step; a corner takes two
_EDGES = ((0, 1), (1, 2), (2, 0))


class Walls:
    """Floors and obstacles from triangles (T, 3, 3)."""

    def __init__(self, triangles: Floats) -> None:
        self._triangles, self._plan = triangles, triangles[:, :, [0, 2]]
        self._low, self._high = triangles.min(axis=1), triangles.max(axis=1)
        normals = self._normals = area_vectors(triangles)
        # Floors have slopes of at most 45 degrees, on either side: some are modelled upside down.
        level = np.abs(normals[:, 1]) > np.cos(np.pi / 4) * np.maximum(np.linalg.norm(normals, axis=-1), 1e-20)
        self._floors, self._floors_low, self._floors_high = triangles[level], self._low[level], self._high[level]

    def floor_below(self, eye: Sequence[float], eye_height_m: float) -> float | None:
        """Height of the highest floor below the eye within reach of a step; None without one."""
        x, y, z = eye
        reach = y - eye_height_m + STEP_M
        low, high = self._floors_low, self._floors_high
        near = (low[:, 0] <= x) & (x <= high[:, 0]) & (low[:, 2] <= z) & (z <= high[:, 2]) & (low[:, 1] <= reach)
        distance = first_hit(np.array([x, reach, z]), np.array([0.0, -1.0, 0.0]), self._floors[near])
        return None if math.isinf(distance) else reach - distance

    def allowed(self, eye: Floats, step: Floats, eye_height_m: float) -> Floats:
        """The permitted part of a horizontal step (3,) from `eye`."""
        knee_y = eye[1] - eye_height_m + STEP_M
        start, move = eye[[0, 2]], step[[0, 2]]
        length = float(np.linalg.norm(move))
        outlines = self._near(start, BODY_M + length, knee_y, eye[1])
        if not len(outlines):
            return step
        pieces = math.ceil(length / (BODY_M / 2))  # shorter than the body, so that no step jumps over a wall
        at = start
        for _ in range(pieces):
            at = at + _slid(at, move / pieces, outlines)
        return np.array([at[0] - start[0], 0.0, at[1] - start[1]])

    def share(self, pivot: Triple, before: Triple, after: Triple, bounds: Bounds) -> float:
        """Permitted share of the distance from `pivot` to the eye `after`, for an eye that comes from `before`.

        It ends `WALL_M` before the bounds, and before a triangle that the eye would pass through.
        """
        way = np.subtract(after, pivot)
        arm_m = max(float(np.linalg.norm(way)), 1e-9)
        open_m = arm_m
        if is_within(pivot, bounds):
            open_m = min(arm_m, way_out_m(np.array(pivot), way / arm_m, bounds) - WALL_M)
        start, step = np.array(before), np.subtract(after, before)
        length_m = max(float(np.linalg.norm(step)), 1e-9)
        step = step / length_m * (length_m + WALL_M)
        low, high = np.minimum(start, start + step), np.maximum(start, start + step)
        near = np.flatnonzero(np.all((self._low <= high) & (self._high >= low), axis=1))
        if len(near):
            t = ray_distances(start, step, self._triangles[near])
            nearest = near[np.argmin(t)]
            if t.min() <= 1:
                corner, normal = self._triangles[nearest, 0], self._normals[nearest]
                along = float(normal @ way) / arm_m
                if abs(along) > 1e-9:
                    plane_m = float(normal @ (corner - np.array(pivot))) / along
                    open_m = min(open_m, plane_m - WALL_M) if plane_m > 0 else open_m
        return max(open_m, NEAREST_M) / arm_m if open_m < arm_m else 1.0

    def _near(self, centre: Floats, reach: float, knee_y: float, eye_y: float) -> Floats:
        low, high = self._low, self._high
        near = (low[:, 1] < eye_y) & (high[:, 1] > knee_y)
        for axis, c in ((0, centre[0]), (2, centre[1])):
            near &= (low[:, axis] < c + reach) & (high[:, axis] > c - reach)
        return np.asarray(self._plan[near], np.float64)


def _slid(at: Floats, move: Floats, outlines: Floats) -> Floats:
    """`move` without its part into outlines; zero in a dead end."""
    before, _ = nearest_points(at, outlines)
    for _ in range(SLIDES):
        distances, points = nearest_points(at + move, outlines)
        blocking = (distances < BODY_M) & (distances < before - 1e-9)
        if not blocking.any():
            return move
        index = np.flatnonzero(blocking)[np.argmin(distances[blocking])]
        # Inside an outline the nearest point lies ahead; move back to where the walker came from.
        away = at + move - points[index] if distances[index] > 0 else at - points[index]
        away = away / max(float(np.linalg.norm(away)), 1e-9)
        move = move - min(float(move @ away), 0.0) * away
    return np.zeros(2)


def nearest_points(p: Floats, outlines: Floats) -> tuple[Floats, Floats]:
    """Distances (T,) from p (2,) to triangles (T, 3, 2), 0 inside, and the nearest points (T, 2) of their outlines."""
    best, points = np.full(len(outlines), np.inf), np.zeros((len(outlines), 2))
    sides = []
    for i, j in _EDGES:
        a, edge = outlines[:, i], outlines[:, j] - outlines[:, i]
        length2 = np.maximum(np.sum(edge * edge, axis=-1), 1e-20)
        share = np.clip(np.sum((p - a) * edge, axis=-1) / length2, 0, 1)
        on_edge = a + share[:, None] * edge
        distance = np.linalg.norm(p - on_edge, axis=-1)
        nearer = distance < best
        best, points = np.where(nearer, distance, best), np.where(nearer[:, None], on_edge, points)
        sides.append(edge[:, 0] * (p[1] - a[:, 1]) - edge[:, 1] * (p[0] - a[:, 0]))
    low, high = np.min(sides, axis=0), np.max(sides, axis=0)
    inside = ((low > 0) & (high > 0)) | ((low < 0) & (high < 0))
    return np.where(inside, 0.0, best), points
