"""Points of a light field that a view needs, computed on the CPU: the sample map's points on visible triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.geometry import area_vectors
from lambent.core.light_field import NO_POINT, LightField
from lambent.realtime.clusters import Ranges
from lambent.realtime.resident_maps import filled

MOST_SIDE = 64  # most samples along a side of a triangle
AWAY = 1e-3  # weight of back faces: sheets, and triangles of reversed winding


class NeededPoints:
    """Finds the points of each triangle of one object once; then ranks the points for each view."""

    def __init__(self, triangles: Floats, uv2: Floats, field: LightField) -> None:
        """`triangles` (F, 3, 3) in the world, metres; `uv2` (F, 3, 2) of their corners."""
        self._centres, self._areas = triangles.mean(axis=1), area_vectors(triangles)
        self._count = len(field.points)
        faces, points = _named(uv2 * np.array(field.grid[::-1]) - np.array(field.corner[::-1]), field)
        pairs, seen = np.unique(faces * NO_POINT + points, return_counts=True)
        self._faces, self._points = np.divmod(pairs, NO_POINT)
        self._shares = seen / np.bincount(self._faces, seen, minlength=len(triangles))[self._faces]

    def of_view(self, eye: Floats, runs: Ranges) -> NDArray[np.int64]:
        """Points by the solid angle, seen from `eye`, that they serve, largest first; `runs` (first, count) in view."""
        inside = np.zeros(len(self._centres), bool)
        for first, count in runs:
            inside[first : first + count] = True
        towards = eye - self._centres
        away = np.maximum(np.linalg.norm(towards, axis=-1), 1e-9)
        angle = (self._areas * towards).sum(axis=-1) / away**3
        weights = np.where(angle > 0, angle, -AWAY * angle) * inside
        weights = np.bincount(self._points, weights[self._faces] * self._shares, minlength=self._count)
        order = np.argsort(-weights, kind="stable")
        return np.asarray(order[weights[order] > 0])


def _named(texels: Floats, field: LightField) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs (triangle, point) of the sample map at samples about a texel apart; `texels` (F, 3, 2) are corners."""
    sample_map = filled(field.sample_map)
    edges = np.linalg.norm(texels - np.roll(texels, 1, axis=1), axis=-1).max(axis=1)
    sides = np.clip(np.ceil(np.nan_to_num(edges)), 1, MOST_SIDE).astype(int)
    faces, points = [], []
    for side in np.unique(sides):
        of = np.flatnonzero(sides == side)
        i, j = np.indices((side + 1, side + 1)).reshape(2, -1)
        i, j = i[i + j <= side], j[i + j <= side]
        shares = np.stack([i, j, side - i - j], axis=-1) / side
        at = np.nan_to_num(np.einsum("mc,fcd->fmd", shares, texels[of]))
        limits = np.array(sample_map.shape[1::-1]) - 1
        column, row = np.moveaxis(np.clip(np.floor(at), 0, limits).astype(int), -1, 0)
        named = sample_map[row, column].astype(np.int64).reshape(len(of), -1)
        faces.append(np.repeat(of, named.shape[1])[named.ravel() != NO_POINT])
        points.append(named.ravel()[named.ravel() != NO_POINT])
    none = np.zeros(0, np.int64)
    return np.concatenate([none, *faces]), np.concatenate([none, *points])
