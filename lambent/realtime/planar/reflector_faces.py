"""How much of a frame the faces of planar reflectors cover, to choose those that get a mirrored view.

Outlines are convex, and say little about scattered faces: in one plane the ledges of eight windows have an outline as
large as the room, and cover a thousandth of it. What stands before the faces is not considered.
"""

from __future__ import annotations

import numpy as np

from lambent.core.arrays import Flags, Floats
from lambent.realtime.gpu.structs import Record
from lambent.realtime.light.baked import BakedScene
from lambent.store.contract import ReflectorRecord

MOST_FACES = 4096  # of a reflector; its outline stands for more
SIDES = np.array([(0, 0, 1), (1, 0, 1), (-1, 0, 1), (0, 1, 1), (0, -1, 1)], float)  # of what a frame shows, (x, y, w)
LEAST_W = 1e-6  # in front of the eye


class ReflectorFaces:
    """The triangles of a scene's reflectors, in their order."""

    def __init__(self, scene: BakedScene) -> None:
        first = {o.name: o.first_face for o in scene.record.objects}

        def of(reflector: ReflectorRecord) -> Floats:
            faces = np.concatenate([first[part.object] + np.array(part.faces, int) for part in reflector.parts])
            if not 0 < len(faces) <= MOST_FACES:
                return outline_triangles(reflector)
            return np.asarray(scene.positions[scene.faces[faces]], float)

        corners = [of(reflector) for reflector in scene.record.reflectors]
        self._starts = np.cumsum([0, *map(len, corners)])[:-1]
        self._corners = np.concatenate(corners) if corners else np.zeros((0, 3, 3))

    def corners(self, number: int) -> Floats:
        """(F, 3, 3) corners, m, of a reflector's triangles."""
        return np.asarray(np.split(self._corners, self._starts[1:])[number])

    def shares(self, frame: Record) -> Floats:
        """(R,) share of a frame (of FRAME_DTYPE) that the faces of each reflector cover, from either side."""
        if not len(self._corners):
            return np.zeros(0)
        return np.asarray(np.add.reduceat(shares_on_screen(frame, self._corners), self._starts))


def outline_triangles(reflector: ReflectorRecord) -> Floats:
    """(P - 2, 3, 3) triangles of a reflector's outline, m."""
    outline = np.asarray(reflector.outline, float)
    middle = outline[1:-1]
    return np.stack([np.broadcast_to(outline[0], middle.shape), middle, outline[2:]], axis=1)


def shares_on_screen(frame: Record, triangles: Floats) -> Floats:
    """(F,) share of a frame that each of the triangles (F, 3, 3), m, covers."""
    clip_from_world = frame["clip_from_world"].T.astype(float)[[0, 1, 3]]
    points = triangles @ clip_from_world[:, :3].T + clip_from_world[:, 3]
    inside: Flags = np.asarray(_heights(points) > 0)  # (F, 3, sides)
    whole = inside.all(axis=(1, 2))
    cut = inside.any(axis=1).all(axis=-1) & ~whole
    shares = np.zeros(len(triangles))
    shares[whole] = _areas(points[whole])
    shares[cut] = _areas(_within_frame(points[cut]))
    return shares / 4  # of the 2 x 2 square


def _heights(points: Floats) -> Floats:
    """(..., sides) of points (..., 3), (x, y, w) of clip space: above 0 within a side of the frame."""
    return np.asarray(points @ SIDES.T - LEAST_W * np.eye(len(SIDES))[0])


def _areas(polygons: Floats) -> Floats:
    """(F,) of convex polygons (F, P, 3), in clip coordinates after the division by w."""
    x, y = np.moveaxis(polygons[..., :2] / polygons[..., 2:], -1, 0)
    return np.asarray(np.abs((x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1)) / 2)


def _within_frame(polygons: Floats) -> Floats:
    for side in range(len(SIDES)):
        polygons = _clipped(polygons, _heights(polygons)[..., side])
    return polygons


def _clipped(polygons: Floats, height: Floats) -> Floats:
    """(F, 2 P, 3) parts of convex polygons (F, P, 3) with a positive height (F, P), linear over each.

    Each edge leaves the ends of its part. Edges without one leave the point where the polygon enters, twice.
    """
    beyond, after = np.roll(polygons, -1, axis=1), np.roll(height, -1, axis=1)
    fall = np.where(height == after, 1.0, height - after)
    on_side = polygons + np.clip(height / fall, 0, 1)[..., None] * (beyond - polygons)
    starts, ends = (height > 0)[..., None], (after > 0)[..., None]
    entering: Flags = (height <= 0) & (after > 0)
    entry = np.take_along_axis(on_side, entering.argmax(axis=1)[:, None, None], axis=1)
    pairs = [np.where(one, point, on_side) for one, point in ((starts, polygons), (ends, beyond))]
    kept = [np.where(starts | ends, point, entry) for point in pairs]
    return np.stack(kept, axis=2).reshape(len(polygons), 2 * height.shape[1], 3)
