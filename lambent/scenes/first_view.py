"""Cameras of a scene that has none: within its room, where it is one, and from outside at all that stands in it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from lambent.core.arrays import Flags, Floats
from lambent.core.geometry.triangles import area_vectors, ray_distances, triangle_areas
from lambent.core.plain import triple
from lambent.core.views.camera import Camera, overview
from lambent.scenes.mesh import boxes_of, corners_of
from lambent.scenes.scene import EYE_HEIGHT_M, SceneObject

GROUND, FLAT = 4.0, 0.05  # a ground is this many times as large as all others together, and this flat
PLACES, MOST_TRIED = 11, 25  # candidates per side of the floor, and number of those with a floor and a ceiling
ROOM_HEIGHT_M, ELBOW_ROOM_M = (1.9, 30.0), 0.5
MOST_TRIANGLES = 4000  # the largest, which represent walls
AROUND = 24  # rays at each of these elevations: walls, things on the floor, and ceiling
LEVEL, FLOORWARDS, UPWARDS = 0.0, math.radians(-30), math.radians(60)
WALLED, ROOFED, UNEVEN = 0.45, 0.8, 0.25  # least shares of rays that hit; tolerance of ceilings about their median
INWARDS, FURNITURE = 0.7, 3  # least share of rays that hit front faces; least number of free-standing objects
LONG_M, OBJECT_M = 5.0, 0.5  # longer views are no better; a visible object is worth this much length
MARGIN = 0.03  # relative to the room, between walls and free-standing objects
FOV_Y_DEG, SIDES, PITCH = 60.0, 3, 0.08  # rays to each side in view; radians downwards


def first_views(objects: Sequence[SceneObject]) -> tuple[Camera, ...]:
    """`inside`, where the objects enclose a place to stand, then `overview`. Scenes are in metres, +y is up."""
    found, whole = inside(objects), overview(*content_bounds(objects))
    return (whole,) if found is None else (found, whole)


def content_bounds(objects: Sequence[SceneObject]) -> tuple[Floats, Floats]:
    """Corners (3,), (3,) of the box around the objects, without flat grounds and skies that dwarf all others."""
    boxes = boxes_of([o.mesh for o in objects])
    size = np.linalg.norm(boxes[:, 0] - boxes[:, 1], axis=1)
    boxes = boxes[np.argsort(size, kind="stable")]
    while len(boxes) > 1 and _surrounds(boxes[-1], boxes[:-1, 0].min(axis=0), boxes[:-1, 1].max(axis=0)):
        boxes = boxes[:-1]
    return np.asarray(boxes[:, 0].min(axis=0), float), np.asarray(boxes[:, 1].max(axis=0), float)


def _surrounds(box: Floats, low: Floats, high: Floats) -> bool:
    (near, far), size = box, np.linalg.norm(box[0] - box[1])
    flat, around = (far - near)[1] <= FLAT * size, (near < low).all() and (far > high).all()
    return bool((flat or around) and size > GROUND * np.linalg.norm(high - low))


def inside(objects: Sequence[SceneObject]) -> Camera | None:
    """A camera at eye height that faces most objects; None without a floor, walls and a ceiling.

    A place is in a room if the surrounding surfaces face it, or if furniture stands free in it: closed solids and empty
    shells of buildings are not rooms.
    """
    low, high = content_bounds(objects)
    if not ROOM_HEIGHT_M[0] <= high[1] - low[1] or min((high - low)[[0, 2]]) < 4 * ELBOW_ROOM_M:
        return None
    walls = _Walls(objects)
    x, z = ((grid.ravel() + 0.5) / PLACES for grid in np.mgrid[:PLACES, :PLACES])
    eyes = low + np.stack([x, np.zeros_like(x), z], axis=1) * (high - low) + [0.0, EYE_HEIGHT_M, 0.0]
    up, down = (walls.hit(eyes, np.broadcast_to([0.0, y, 0.0], eyes.shape))[0] for y in (1.0, -1.0))
    stands = (down < 1.5 * EYE_HEIGHT_M) & (down > 0.3 * EYE_HEIGHT_M)
    height = up + down
    indoors = np.flatnonzero(stands & (height >= ROOM_HEIGHT_M[0]) & (height <= ROOM_HEIGHT_M[1]))
    eyes[indoors, 1] += EYE_HEIGHT_M - down[indoors]
    ways, best = np.concatenate([_around(tilt) for tilt in (LEVEL, FLOORWARDS, UPWARDS)]), None
    for eye in eyes[indoors[:: -(-len(indoors) // MOST_TRIED) or 1]]:
        distance, inwards, hits = walls.hit(np.broadcast_to(eye, ways.shape), ways)
        level, above = distance[:AROUND], distance[-AROUND:] * math.sin(UPWARDS)
        ceiling = np.median(np.minimum(above, ROOM_HEIGHT_M[1]))
        roofed = np.abs(above - ceiling) < UNEVEN * ceiling
        if np.isfinite(level).mean() < WALLED or level.min() < ELBOW_ROOM_M or roofed.mean() < ROOFED:
            continue
        if inwards.mean() < INWARDS * np.isfinite(distance).mean() and _free(objects, hits, low, high) < FURNITURE:
            continue
        worth = _worth(np.minimum(level, LONG_M), hits[: 2 * AROUND].reshape(2, AROUND))
        if best is None or worth.max() > best[0]:
            best = worth.max(), eye, ways[worth.argmax()] - [0.0, PITCH, 0.0]
    if best is None:
        return None
    _, eye, forward = best
    return Camera("inside", triple(eye), triple(eye + forward), fov_y_deg=FOV_Y_DEG)


def _worth(length_m: Floats, hits: Floats) -> Floats:
    """(AROUND,) value of each direction, from view lengths (AROUND,) and the objects (rows, AROUND) that rays hit."""
    turns = range(-SIDES, SIDES + 1)
    ahead = np.mean([np.roll(length_m, turn) for turn in turns], axis=0)
    objects = np.concatenate([np.roll(hits, turn, axis=1) for turn in turns])
    return np.asarray(ahead + [OBJECT_M * len(set(column)) for column in objects.T])


def _around(tilt_rad: float) -> Floats:
    """(AROUND, 3) directions at an elevation of `tilt_rad`."""
    angle, across = np.arange(AROUND) * 2 * math.pi / AROUND, math.cos(tilt_rad)
    return np.stack([across * np.cos(angle), np.full(AROUND, math.sin(tilt_rad)), across * np.sin(angle)], axis=1)


class _Walls:
    """The largest triangles of objects, for few rays."""

    def __init__(self, objects: Sequence[SceneObject]) -> None:
        corners = corners_of([o.mesh for o in objects])
        of_object = np.repeat(np.arange(len(objects)), [len(o.mesh.faces) for o in objects])
        largest = np.argsort(triangle_areas(corners))[-MOST_TRIANGLES:]
        self._object, self._corners = of_object[largest], corners[largest].astype(float)

    def hit(self, origins: Floats, directions: Floats) -> tuple[Floats, Flags, Floats]:
        """Distance (R,) of each ray's first triangle, inf without one, whether it is a front, and its object, or -1."""
        found = np.full(len(origins), np.inf), np.zeros(len(origins), bool), np.full(len(origins), -1)
        for ray, (origin, w) in enumerate(zip(origins, directions, strict=True)):
            distance = ray_distances(origin, w, self._corners)
            first = distance.argmin()
            if np.isfinite(distance[first]):
                is_front = area_vectors(self._corners[first]) @ w < 0
                for values, value in zip(found, (distance[first], is_front, self._object[first]), strict=True):
                    values[ray] = value
        return found


def _free(objects: Sequence[SceneObject], hits: Floats, low: Floats, high: Floats) -> int:
    """Number of the given objects that stand away from the walls."""
    gap = MARGIN * (high - low)[[0, 2]]

    def stands_free(o: SceneObject) -> bool:
        near, far = (np.asarray(corner, float)[[0, 2]] for corner in o.mesh.bounds)
        return bool((near > low[[0, 2]] + gap).all() and (far < high[[0, 2]] - gap).all())

    return sum(stands_free(objects[number]) for number in set(hits[hits >= 0]))
