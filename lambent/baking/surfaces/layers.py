"""Layers of a chart: within a layer, distant places of the surface never touch the same texel.

Faces projected onto a merged chart land in the same texels if one lies behind another. Parts of a chart by xatlas may
pass each other at less than a texel. Layers are peeled off: the first takes the first face in each texel and all faces
close to it, the next does the same with the rest.
"""

from __future__ import annotations

from functools import partial

import numba
import numpy as np

from lambent.baking.surfaces.packing import meets, near, snapped
from lambent.core.arrays import Flags, Floats, Indices, sums_of

BEHIND = 2.0  # largest difference in depth, in texels, of projected faces that share a texel
REACH = 3.6  # largest distance in texels, with margin, between places from which look-ups touch one texel
APART = 4.0  # largest distance in texels, along each axis, between places of one surface that share a texel


def layers_of(corners: Floats, depths: Floats) -> list[Indices]:
    """Faces projected onto a chart, in layers, nearest first.

    Parameters
    ----------
    corners : (F, 3, 2) of triangles on the chart, in texels.
    depths : (F, 3) of the same corners along the projection, in texels.
    """
    if np.ptp(depths) <= BEHIND:  # no face lies far behind another
        return [np.arange(len(depths))]
    left = np.argsort(depths.min(axis=1), kind="stable")
    found = []
    while len(left):
        first = in_first_layer(corners[left], depths[left, :, None], BEHIND)
        found.append(np.sort(left[first]))
        left = left[~first]
    return found


def lie_flat(corners: Floats, places: Floats, chart: Indices) -> Flags:
    """Flags of charts (max + 1,) that are certainly one layer, because an affine map takes them to the surface.

    `chart` (F,) is the chart of each face; `corners` (F, 3, 2) and `places` (F, 3, 3) are in texels. Look-ups touch a
    texel from within REACH of each other, so places in one texel are at most |A| REACH plus twice the residual apart,
    for the least squares map A.
    """
    if not len(chart):
        return np.zeros(0, bool)
    of, count = np.repeat(chart, 3), int(chart.max()) + 1
    number = np.maximum(np.bincount(of, minlength=count), 1)
    summed = partial(sums_of, of=of, count=count)
    uv, xyz = corners.reshape(-1, 2), places.reshape(-1, 3)
    uv = uv - (summed(uv) / number[:, None])[of]
    xyz = xyz - (summed(xyz) / number[:, None])[of]
    uu, uv_, vv = summed(np.stack([uv[:, 0] ** 2, uv[:, 0] * uv[:, 1], uv[:, 1] ** 2], axis=1)).T
    ux, vx = summed(uv[:, :1] * xyz), summed(uv[:, 1:] * xyz)
    determinant = uu * vv - uv_**2
    found = determinant > 1e-9 * uu * vv
    scale = np.where(found, 1 / np.where(found, determinant, 1), 0)[:, None]
    along_u, along_v = (ux * vv[:, None] - vx * uv_[:, None]) * scale, (vx * uu[:, None] - ux * uv_[:, None]) * scale
    remainder = np.zeros(count)
    np.maximum.at(remainder, of, np.abs(uv[:, :1] * along_u[of] + uv[:, 1:] * along_v[of] - xyz).max(axis=1))
    longest = np.sqrt(along_u**2 + along_v**2).max(axis=1)
    return np.asarray(found & (longest * REACH + 2 * remainder <= APART))


def in_first_layer(corners: Floats, places: Floats, most: float = APART) -> Flags:
    """Flags of faces (F,) of a chart that touch no texel that an earlier face touches from more than `most` away.

    `corners` (F, 3, 2) and `places` (F, 3, D), along D axes, are in texels. The first face is always included.
    """
    local, (columns, rows) = snapped(corners)
    return np.asarray(_first(local, np.ascontiguousarray(places, dtype=float), columns, rows, most))


@numba.njit(cache=True)
def _first(corners: Floats, places: Floats, width: int, height: int, most: float) -> Flags:
    axes = places.shape[2]
    low, high = np.full((width * height, axes), np.inf), np.full((width * height, axes), -np.inf)
    found = np.ones(len(corners), np.bool_)
    for f in range(len(corners)):
        t = corners[f]
        rows, columns = near(t, width, height)
        for taking in (False, True):
            for row in range(rows[0], rows[1]):
                for column in range(columns[0], columns[1]):
                    if not found[f] or not meets(t, column + 0.5, row + 0.5):
                        continue
                    cell, weights = row * width + column, _nearest(t, column + 0.5, row + 0.5)
                    for axis in range(axes):
                        at = (weights * places[f, :, axis]).sum()
                        if taking:
                            low[cell, axis], high[cell, axis] = min(low[cell, axis], at), max(high[cell, axis], at)
                        elif max(high[cell, axis], at) - min(low[cell, axis], at) > most:
                            found[f] = False
    return found


@numba.njit(cache=True)
def _nearest(t: Floats, x: float, y: float) -> Floats:
    """(3,) barycentric weights of the point on a triangle (3, 2) nearest to (x, y)."""
    weights = np.zeros(3)
    for i in range(3):
        b, c = t[(i + 1) % 3], t[(i + 2) % 3]
        weights[i] = (c[0] - b[0]) * (y - b[1]) - (c[1] - b[1]) * (x - b[0])
    total = weights.sum()
    if total != 0 and (weights / total).min() >= 0:
        return np.asarray(weights / total)
    nearest = np.inf
    for i in range(3):
        a, b = t[i], t[(i + 1) % 3]
        length = (b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2
        along = (x - a[0]) * (b[0] - a[0]) + (y - a[1]) * (b[1] - a[1])
        s = min(max(along / length, 0.0), 1.0) if length > 0 else 0.0
        away = (a[0] + s * (b[0] - a[0]) - x) ** 2 + (a[1] + s * (b[1] - a[1]) - y) ** 2
        if away < nearest:
            nearest = away
            weights[:] = 0
            weights[i], weights[(i + 1) % 3] = 1 - s, s
    return weights
