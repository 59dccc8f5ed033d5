"""Polygons into triangles, and normals where a file has none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lambent.core.directions import Floats, basis, normalize

Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Arrays:
    """positions, normals (V, 3), uv (V, 2), triangles (T, 3); normals and uv may be absent."""

    positions: Floats
    normals: Floats | None
    uv: Floats | None
    triangles: Ints


def triangulate(positions: Floats, corners: Ints, sizes: Ints) -> tuple[Ints, Ints]:
    """Triangles of polygons.

    Parameters
    ----------
    positions : (V, 3)
    corners : (C,) int64
        Vertex of every corner, polygon after polygon.
    sizes : (F,) int64
        Corners of each polygon; those with fewer than three give nothing.

    Returns
    -------
    triangles : (T, 3) int64
        Places in `corners`, in each polygon's own sense.
    polygon : (T,) int64
        Which polygon each came from; ascending.
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
        fans = np.stack([np.zeros(size - 2, int), np.arange(1, size - 1), np.arange(2, size)], axis=-1)
        triangles.append(places[:, fans].reshape(-1, 3))
        polygon.append(np.repeat(which, size - 2))
    order = np.argsort(np.concatenate(polygon), kind="stable")
    return np.concatenate(triangles)[order], np.concatenate(polygon)[order]


def _newell(points: Floats) -> Floats:
    """Normal (..., 3), twice the area long, of polygons (..., n, 3)."""
    relative = points - points[..., :1, :]
    normal: Floats = np.cross(relative, np.roll(relative, -1, axis=-2)).sum(axis=-2)
    return normal


def _convex(points: Floats) -> NDArray[np.bool_]:
    """Which polygons (F, n, 3) turn one way at every corner; one that is not finite counts as convex."""
    with np.errstate(invalid="ignore", over="ignore"):
        edges = np.roll(points, -1, axis=1) - points
        turns = np.sum(np.cross(edges, np.roll(edges, -1, axis=1)) * _newell(points)[:, None], axis=-1)
        hollow: NDArray[np.bool_] = (turns < -1e-9 * np.abs(turns).max(axis=1, keepdims=True)).any(axis=1)
    return ~hollow


def _clipped(points: Floats) -> Ints:
    """Triangles (T, 3) of one polygon (n, 3) by ear clipping in its own plane."""
    from mapbox_earcut import triangulate_float64

    t, b = basis(normalize(_newell(points)))
    flat = np.ascontiguousarray(np.stack([points @ t, points @ b], axis=-1))
    cut = triangulate_float64(flat, np.array([len(points)], np.uint32)).reshape(-1, 3).astype(np.int64)
    if not len(cut):
        n = len(points)
        return np.stack([np.zeros(n - 2, int), np.arange(1, n - 1), np.arange(2, n)], axis=-1)
    a, b2, c = (flat[cut[:, i]] for i in range(3))
    e1, e2 = b2 - a, c - a
    turned = e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0] < 0
    return np.where(turned[:, None], cut[:, ::-1], cut)


def smooth_normals(positions: Floats, triangles: Ints, shared: Ints) -> Floats:
    """Unit normals (K, 3), each the mean of its triangles', weighed by their angles there.

    Parameters
    ----------
    positions : (V, 3)
    triangles : (T, 3) int
        Vertices.
    shared : (T, 3) int
        Which of the K normals each corner has.
    """
    corner = positions[triangles]
    total = np.zeros((int(shared.max()) + 1 if shared.size else 0, 3))
    with np.errstate(invalid="ignore", over="ignore"):
        normal = normalize(np.nan_to_num(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])))
        for i in range(3):
            e1, e2 = (normalize(corner[:, (i + k) % 3] - corner[:, i]) for k in (1, 2))
            angle = np.arccos(np.clip(np.nan_to_num(np.sum(e1 * e2, axis=-1)), -1, 1))
            for axis in range(3):
                total[:, axis] += np.bincount(shared[:, i], angle * normal[:, axis], minlength=len(total))
    return normalize(total)
