"""Bevels of planar reflectors: their rims, tilted a little, which show what the reflectors' mirrored views hold.

The cut edge of a mirror is too small for a mirrored view of its own, and a probe has no room for what stands close
before it. Rays of its pixels start a little behind the reflector's plane and leave at another angle; both searches of
the reflector's view (shaders/planar_march.wgsl, planar_search.wgsl) follow any ray.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians

import numpy as np

from lambent.core.arrays import Floats, Indices
from lambent.core.geometry import triangle_normals
from lambent.realtime.baked import BakedScene
from lambent.store.contract import ReflectorRecord

FLAT_COS = 0.998  # least, of normals of the reflector itself: 3.6 degrees
MOST_TILT_DEG = 10.0  # of a bevel: rays of steeper ones leave the mirrored view
DEEPEST_M = 0.02  # below the reflector's plane
TOUCHING_M = 1e-4  # of a bevel's edge and the plane


@dataclass(frozen=True)
class Bevel:
    """How far below the reflector's plane a bevel reaches, m, and the least cosine of its normals to the plane's."""

    depth_m: float = 0.0
    least_cos: float = FLAT_COS


FLAT = Bevel()  # of a reflector without one


class Bevels:
    """The bevels of a scene's reflectors, each found when it is first asked for."""

    def __init__(self, scene: BakedScene) -> None:
        self._scene = scene
        self._objects = {o.name: o for o in scene.record.objects}
        self._found: dict[tuple[float, ...], Bevel] = {}

    def of(self, reflector: ReflectorRecord) -> Bevel:
        """The bevel of a reflector: faces of its objects that belong to no reflector, and fall off from its edge."""
        if reflector.plane not in self._found:
            self._found[reflector.plane] = self._bevel(reflector)
        return self._found[reflector.plane]

    def _bevel(self, reflector: ReflectorRecord) -> Bevel:
        scene, plane = self._scene, np.asarray(reflector.plane)
        faces = np.concatenate([scene.faces[self._others(part.object)] for part in reflector.parts])
        corners = scene.positions[faces].astype(float)
        height = corners @ plane[:3] + plane[3]
        top = reflector.deviation_m + TOUCHING_M
        touches = (np.abs(height) <= top).any(axis=1)
        falls = (height <= top).all(axis=1) & (height >= -DEEPEST_M).all(axis=1)
        near = np.flatnonzero(touches & falls)
        tilted = triangle_normals(corners[near]) @ plane[:3] >= cos(radians(MOST_TILT_DEG))
        mine = near[tilted]
        if not len(mine):
            return FLAT
        cosines: Floats = scene.normals[faces[mine]] @ plane[:3]
        least = float(np.clip(cosines.min() - 1e-3, cos(radians(MOST_TILT_DEG)), FLAT_COS))
        return Bevel(float(-height[mine].min()), least)

    def _others(self, name: str) -> Indices:
        """Numbers of an object's faces that belong to no reflector."""
        record = self._objects[name]
        free = np.ones(record.face_count, bool)
        for reflector in self._scene.record.reflectors:
            for part in reflector.parts:
                if part.object == name:
                    free[list(part.faces)] = False
        return np.asarray(record.first_face + np.flatnonzero(free))
