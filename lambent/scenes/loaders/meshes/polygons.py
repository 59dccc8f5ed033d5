"""Triangulation of polygons, and normals for files without them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.geometry.directions import basis, normalize
from lambent.core.geometry.triangles import area_vectors, corner_angles, cross_2d


def triangulate(positions: Floats, corners: Indices, sizes: Indices) -> tuple[Indices, Indices]:
    """Triangles of polygons.

    Parameters
    ----------
    positions : (V, 3)
    corners : (C,) int64
        Vertex of every corner, polygon after polygon.
    sizes : (F,) int64
        Number of corners of each polygon; polygons of fewer than three give no triangle.

    Returns
    -------
    triangles : (T, 3) int64
        Places in `corners`, in each polygon's own sense.
    polygon : (T,) int64
        The polygon of each, ascending.
    """
    starts = np.cumsum(sizes) - sizes
    triangles, polygon = [np.zeros((0, 3), np.int64)], [np.zeros(0, np.int64)]
    for size in np.unique(sizes[sizes >= 3]):
        which = np.flatnonzero(sizes == size)
        places = starts[which][:, None] + np.arange(size)
        if size > 3:
            hollow = ~_convex(positions[corners[places]])
            for row in np.flatnonzero(hollow):
                cut = _clipped(positions[corners[places[row]]])
                triangles.append(places[row][cut])
                polygon.append(np.full(len(cut), which[row]))
            which, places = which[~hollow], places[~hollow]
        triangles.append(places[:, _fan(size)].reshape(-1, 3))
        polygon.append(np.repeat(which, size - 2))
    order = np.argsort(np.concatenate(polygon), kind="stable")
    return np.concatenate(triangles)[order], np.concatenate(polygon)[order]


def _newell(points: Floats) -> Floats:
    """Normal (..., 3), twice the area long, of polygons (..., n, 3)."""
    relative = points - points[..., :1, :]
    normal: Floats = np.cross(relative, np.roll(relative, -1, axis=-2)).sum(axis=-2)
    return normal


def _convex(points: Floats) -> Flags:
    """(F,) whether polygons (F, n, 3) turn one way at every corner; nonfinite ones count as convex."""
    with np.errstate(invalid="ignore", over="ignore"):
        edges = np.roll(points, -1, axis=1) - points
        turns = np.sum(np.cross(edges, np.roll(edges, -1, axis=1)) * _newell(points)[:, None], axis=-1)
        hollow = (turns < -1e-9 * np.abs(turns).max(axis=1, keepdims=True)).any(axis=1)
    return np.asarray(~hollow)


def _clipped(points: Floats) -> Indices:
    """Triangles (T, 3) of one polygon (n, 3) by ear clipping in its own plane."""
    from mapbox_earcut import triangulate_float64

    t, b = basis(normalize(_newell(points)))
    flat = np.ascontiguousarray(np.stack([points @ t, points @ b], axis=-1))
    cut = triangulate_float64(flat, np.array([len(points)], np.uint32)).reshape(-1, 3).astype(np.int64)
    if not len(cut):
        return _fan(len(points))
    a, b, c = (flat[cut[:, i]] for i in range(3))
    return np.where((cross_2d(b - a, c - a) < 0)[:, None], cut[:, ::-1], cut)


def _fan(corners: int) -> Indices:
    """Triangles (corners - 2, 3) of a convex polygon."""
    return np.stack([np.zeros(corners - 2, int), np.arange(1, corners - 1), np.arange(2, corners)], axis=-1)


def ranges(counts: Indices) -> Indices:
    """0, 1, ..., c - 1 for each c of counts, concatenated."""
    starts = np.cumsum(counts) - counts
    return np.arange(int(counts.sum())) - np.repeat(starts, counts)


def smooth_normals(positions: Floats, triangles: NDArray[np.integer], shared: NDArray[np.integer]) -> Floats:
    """Unit normals (K, 3), each the mean of its triangles' normals weighted by their angles there.

    Parameters
    ----------
    positions : (V, 3)
    triangles : (T, 3) int
        Vertices.
    shared : (T, 3) int
        The normal of each corner, out of K.
    """
    corner = positions[triangles]
    total = np.zeros((int(shared.max()) + 1 if shared.size else 0, 3))
    with np.errstate(invalid="ignore", over="ignore"):
        normal, angles = normalize(np.nan_to_num(area_vectors(corner))), np.nan_to_num(corner_angles(corner))
        for i in range(3):
            for axis in range(3):
                total[:, axis] += np.bincount(shared[:, i], angles[:, i] * normal[:, axis], minlength=len(total))
    return normalize(total)
