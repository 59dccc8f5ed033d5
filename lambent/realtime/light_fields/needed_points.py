"""Points of a light field that a view needs, computed on the CPU: the sample map's points where the object is visible.

An object is visible where it lies in the picture and faces the eye. Its back is visible where no face of the same
object that faces the eye lies before it, as on sheets and inside open vessels. Other objects hide nothing here.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lambent.baked.light_fields.light_field import NO_POINT, LightField
from lambent.core.arrays import Flags, Floats, Indices, sums_of
from lambent.core.geometry.triangles import area_vectors
from lambent.realtime.light_fields.resident_maps import filled

MOST_SIDE = 64  # most samples along a side of a triangle
APART = 0.5  # texels of the sample map between samples
MARGIN = 1.05  # of the picture, relative to its half: antialiasing moves it by parts of pixels


class NeededPoints:
    """Divides the triangles of one object into patches, one for each point they name; ranks the points for views."""

    def __init__(self, triangles: Floats, uv2: Floats, field: LightField) -> None:
        """`triangles` (F, 3, 3) in the world, metres; `uv2` (F, 3, 2) of their corners."""
        self._count = len(field.points)
        face, shares, point = _samples(uv2 * np.array(field.grid[::-1]) - np.array(field.corner[::-1]), field)
        at = np.einsum("sc,scd->sd", shares, triangles[face])
        pairs, patch, size = np.unique(face * NO_POINT + point, return_inverse=True, return_counts=True)
        faces, self._points = np.divmod(pairs, NO_POINT)
        self._at = sums_of(at, patch, len(pairs)) / np.maximum(size, 1)[:, None]
        self._radius_m = np.zeros(len(pairs))
        np.maximum.at(self._radius_m, patch, np.linalg.norm(at - self._at[patch], axis=-1))
        share = size / np.bincount(faces, size, minlength=len(triangles))[faces]
        self._areas = area_vectors(triangles)[faces] * share[:, None]
        if np.einsum("pd,pd", self._areas, field.points[self._points] - self._at) < 0:
            self._areas *= -1  # towards the points, whatever the winding

    def of_view(self, eye: Floats, clip_from_world: Floats) -> NDArray[np.int64]:
        """Points by the solid angle, seen from `eye`, that they serve, largest first.

        `clip_from_world` (4, 4) takes column vectors to WebGPU's clip space.
        """
        x, y, _, w = clip_from_world
        planes = np.stack([MARGIN * w + side for side in (x, -x, y, -y)])
        within = np.einsum("pd,sd->sp", self._at, planes[:, :3]) + planes[:, 3:]  # `@` keeps all cores busy
        beside = self._radius_m * np.linalg.norm(planes[:, :3], axis=1)[:, None]
        seen = np.flatnonzero((within >= -beside).all(axis=0))
        at, points = self._at[seen], self._points[seen]
        towards = eye - at
        away = np.maximum(np.sqrt(np.einsum("pd,pd->p", towards, towards)), 1e-9)
        angle = np.einsum("pd,pd->p", self._areas[seen], towards) / (away * away * away)
        across, up, depth = (np.einsum("pd,d->p", at, row[:3]) + row[3] for row in (x, y, w))
        places = np.stack([across, up], axis=-1) / np.maximum(depth, 1e-9)[:, None]
        shown = np.count_nonzero(np.bincount(points[angle >= 0], minlength=self._count))
        cells = math.ceil(math.sqrt(shown))  # as far apart as points: patches leave none empty
        angles = np.where(_hidden(places, away, angle >= 0, cells), 0.0, np.abs(angle))
        weights = np.bincount(points, angles, minlength=self._count)
        order = np.argsort(-weights, kind="stable")
        return np.asarray(order[weights[order] > 0])


def _hidden(places: Floats, away: Floats, front: Flags, cells: int) -> Flags:
    """Which patches at places (k, 2) of the picture are backs with a front at shorter distance (k,) in the same cell.

    The bounding box of the places has `cells` cells a side.
    """
    if not front.any():
        return np.zeros(len(front), bool)
    low, size = places.min(axis=0), np.maximum(np.ptp(places, axis=0), 1e-9)
    column, row = np.minimum((places - low) / size * cells, cells - 1).astype(np.int64).T
    cell, nearest = row * cells + column, np.full(cells * cells, np.inf)
    np.minimum.at(nearest, cell[front], away[front])
    return np.asarray(~front & (nearest[cell] < away))


def _samples(texels: Floats, field: LightField) -> tuple[Indices, Floats, Indices]:
    """Samples of triangles about APART texels of the sample map apart; `texels` (F, 3, 2) are their corners.

    Returns face (S,), barycentric shares (S, 3) and point (S,): one for each point that a place names.
    """
    sample_map = filled(field.sample_map)
    limits = np.array(sample_map.shape[1::-1]) - 1
    edges = np.linalg.norm(texels - np.roll(texels, 1, axis=1), axis=-1).max(axis=1)
    sides = np.clip(np.ceil(np.nan_to_num(edges) / APART), 1, MOST_SIDE).astype(int)
    faces, shares, points = [np.zeros(0, np.int64)], [np.zeros((0, 3))], [np.zeros(0, np.int64)]
    for side in np.unique(sides):
        of = np.flatnonzero(sides == side)
        i, j = np.indices((side, side)).reshape(2, -1)
        i, j = i[i + j < side], j[i + j < side]
        inside = (np.stack([i, j, side - 1 - i - j], axis=-1) + 1 / 3) / side
        at = np.nan_to_num(np.einsum("mc,fcd->fmd", inside, texels[of]))
        column, row = np.moveaxis(np.clip(np.floor(at), 0, limits).astype(int), -1, 0)
        named = sample_map[row, column].astype(np.int64)
        known = named != NO_POINT
        face, place, _ = np.nonzero(known)
        faces.append(of[face])
        shares.append(inside[place])
        points.append(named[known])
    return np.concatenate(faces), np.concatenate(shares), np.concatenate(points)
