"""Shadow rays for selected pairs of a point and a distant light, in batches."""

from __future__ import annotations

import time
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.bake.tiles import slices
from lambent.bake.tracing.rays import array_of, has_holes, in_shadow, intersect, leaving, vectors
from lambent.bake.transport.view_points import ViewPoints
from lambent.core.arrays import Flags, Floats, Indices

RAYS_AT_ONCE = 1 << 22


class ShadowRays:
    """Rays from the points of a view to lights in unit `directions` (M, 3).

    Attributes
    ----------
    facing : (P, M) bool
        Whether a light is on the side of a point's surface that the viewer sees; only those count.
    count : int
        Number of rays so far.
    seconds : float
        Time for them.
    """

    def __init__(self, scene: Any, points: ViewPoints, directions: Floats) -> None:
        self._scene, self._holes = scene, has_holes(scene)
        self._p, self._n = vectors(mi.Point3f, points.p), vectors(mi.Vector3f, points.flat)
        self._w = vectors(mi.Vector3f, directions)
        side = np.sign((points.flat * points.n).sum(axis=1, keepdims=True))
        self.facing = np.asarray((points.flat * side) @ np.asarray(directions, np.float32).T > 0)
        self.count, self.seconds = 0, 0.0

    def blocked(self, point: Indices, light: Indices) -> Flags:
        """(n,) bool: whether the light is occluded from the point."""
        found = np.zeros(len(point), bool)
        began = time.perf_counter()
        for some in slices(len(point), RAYS_AT_ONCE):
            found[some] = np.array(
                in_shadow(self._scene, self._rays(point[some], light[some]), mi.Bool(True), self._holes)
            )
        self._note(len(point), began)
        return found

    def blockers(self, point: Indices, light: Indices) -> tuple[Flags, NDArray[np.float32]]:
        """(n,) bool as `blocked`, and the position of the blocker (n, 3), undefined if there is none."""
        found, place = np.zeros(len(point), bool), np.zeros((len(point), 3), np.float32)
        began = time.perf_counter()
        for some in slices(len(point), RAYS_AT_ONCE):
            si = intersect(self._scene, self._rays(point[some], light[some]), mi.Bool(True), self._holes)
            hit = si.is_valid()
            place[some] = array_of(si.p)
            found[some] = np.array(hit)
        self._note(len(point), began)
        return found, place

    def _rays(self, point: Indices, light: Indices) -> Any:
        at, m = mi.UInt32(point.astype(np.uint32)), mi.UInt32(light.astype(np.uint32))
        p, n = dr.gather(mi.Point3f, self._p, at), dr.gather(mi.Vector3f, self._n, at)
        return leaving(self._scene, p, n, dr.gather(mi.Vector3f, self._w, m))

    def _note(self, rays: int, began: float) -> None:
        self.count += rays
        self.seconds += time.perf_counter() - began
