"""What is under the mouse, and what is under the feet: rays against the scene's triangles, on the CPU."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lambent.core.camera import Camera, rays_through
from lambent.store.contract import ObjectRecord
from lambent.viewer.walls import Walls

Floats = NDArray[np.floating]
STEP_M = 0.35  # a floor higher above the feet than this is a table, not a stair


def ray_through(camera: Camera, x: float, y: float, width: int, height: int) -> tuple[Floats, Floats]:
    """Origin and unit direction of the ray through the picture point (x, y) in pixels, y downwards."""
    return np.array(camera.position, float), rays_through(camera, x, y, width, height)


class Geometry:
    """Triangles ready for rays. positions (V, 3), faces (T, 3) sorted by object."""

    def __init__(self, positions: Floats, faces: NDArray[np.integer], objects: Sequence[ObjectRecord]) -> None:
        self._objects = tuple(objects)
        self._triangles = positions[faces].astype(np.float32)
        normals = np.cross(self._triangles[:, 1] - self._triangles[:, 0], self._triangles[:, 2] - self._triangles[:, 0])
        lengths = np.linalg.norm(normals, axis=-1)
        # Floors are what one can stand on: not steeper than 45 degrees, on either side (some floors are modelled upside
        # down).
        level = np.abs(normals[:, 1]) > np.cos(np.pi / 4) * np.maximum(lengths, 1e-20)
        self._level = self._triangles[level]
        self._walls = Walls(self._triangles)
        self._level_low, self._level_high = self._level.min(axis=1), self._level.max(axis=1)

    def pick(self, origin: Floats, direction: Floats) -> ObjectRecord | None:
        """The first object that the ray meets."""
        nearest, chosen = math.inf, None
        for item in self._objects:
            entry = _box_entry(origin, direction, np.array(item.bounds))
            if entry < nearest:
                triangles = self._triangles[item.first_face : item.first_face + item.face_count]
                distance = first_hit(origin, direction, triangles)
                if distance < nearest:
                    nearest, chosen = distance, item
        return chosen

    def allowed(self, eye: Floats, step: Floats, eye_height_m: float) -> Floats:
        """The part of a walker's step that nothing stands in the way of."""
        return self._walls.allowed(eye, step, knee_y=eye[1] - eye_height_m + STEP_M)

    def floor_below(self, eye: Sequence[float], eye_height_m: float) -> float | None:
        """Height of the highest floor under the eye that one could step on; None where there is none."""
        x, y, z = eye
        reach = y - eye_height_m + STEP_M
        near = (
            (self._level_low[:, 0] <= x) & (x <= self._level_high[:, 0])
            & (self._level_low[:, 2] <= z) & (z <= self._level_high[:, 2]) & (self._level_low[:, 1] <= reach)
        )  # fmt: skip
        from_above = np.array([x, reach, z])
        distance = first_hit(from_above, np.array([0.0, -1.0, 0.0]), self._level[near])
        return None if math.isinf(distance) else reach - distance


def first_hit(origin: Floats, direction: Floats, triangles: Floats) -> float:
    """Distance to the nearest of triangles (T, 3, 3), on either side; inf for none (Moller & Trumbore 1997)."""
    edge1, edge2 = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    p = np.cross(direction, edge2)
    det = np.sum(edge1 * p, axis=-1)
    flat = np.abs(det) < 1e-20
    inverse = 1 / np.where(flat, 1, det)
    s = origin - triangles[:, 0]
    u = np.sum(s * p, axis=-1) * inverse
    q = np.cross(s, edge1)
    v = np.sum(direction * q, axis=-1) * inverse
    t = np.sum(edge2 * q, axis=-1) * inverse
    hit = ~flat & (u >= -1e-6) & (v >= -1e-6) & (u + v <= 1 + 1e-6) & (t > 1e-6)
    return float(t[hit].min()) if hit.any() else math.inf


def _box_entry(origin: Floats, direction: Floats, box: Floats) -> float:
    """Distance at which the ray enters the box (2, 3); 0 from inside, inf when it misses."""
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (box - origin) / direction
    t = np.where(np.isnan(t), np.array([[-np.inf], [np.inf]]), t)  # in a face's plane, parallel to it
    enter, leave = np.minimum(*t).max(), np.maximum(*t).min()
    return math.inf if leave < max(enter, 0) - 1e-6 else max(float(enter), 0.0)
