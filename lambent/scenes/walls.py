"""Walls that stand on the edges of a planar reflector, as those of a room do on its floor.

Seen from below its floor, a room ends at the foot of its walls; past it the mirrored eye looks outside, where nothing
that the floor mirrors lies. Past the edge of a table it sees what the table's points see, too. So edges are told apart.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating]
POINTS = 24  # along an edge
HEIGHTS = (0.01, 0.03)  # over the reflector at which a wall is looked for; as all lengths here, of its size
INWARDS, OUTWARDS = 0.1, 0.03  # how far before and behind the edge
LEAST_EDGE = 0.05
SHARE = 0.6  # of the points and heights, behind which something stands


def walled_edges(outline: Floats, normal: Floats, corners: Floats) -> tuple[bool, ...]:
    """Which edges of a convex outline (P, 3), counter-clockwise about its normal (3,), something closes.

    Edge i leads from outline[i] to the next; `corners` (F, 3, 3) are the triangles of the scene. The size of a
    reflector is the root of its outline's area.
    """
    edges = np.roll(outline, -1, axis=0) - outline
    fan = np.cross(outline[1:-1] - outline[0], outline[2:] - outline[0])
    size = float(np.sqrt(max(fan.sum(axis=0) @ normal / 2, 1e-12)))
    near = _touching(corners, _swept(outline, (-OUTWARDS * size, OUTWARDS * size, max(HEIGHTS) * size * normal)))
    share = (np.arange(POINTS) + 0.5)[:, None] / POINTS
    found = []
    for start, edge in zip(outline, edges, strict=True):
        length = float(np.linalg.norm(edge))
        if length < LEAST_EDGE * size:
            found.append(False)
            continue
        inwards = np.cross(normal, edge / length)
        feet = np.concatenate([start + share * edge + height * size * normal for height in HEIGHTS])
        ray = -(INWARDS + OUTWARDS) * size * inwards
        feet += INWARDS * size * inwards
        found.append(bool(_crossed(feet, ray, _touching(near, _swept(feet, (0.0, ray)))).mean() >= SHARE))
    return tuple(found)


def _swept(points: Floats, steps: tuple[Floats | float, ...]) -> tuple[Floats, Floats]:
    """Least and largest coordinates (3,) of points (n, 3) moved by any of the steps."""
    moved = np.concatenate([points + step for step in steps])
    return moved.min(axis=0), moved.max(axis=0)


def _touching(corners: Floats, box: tuple[Floats, Floats]) -> Floats:
    """Triangles (F, 3, 3) that may cross a box."""
    return corners[((corners.max(axis=1) >= box[0]) & (corners.min(axis=1) <= box[1])).all(axis=1)]


def _crossed(origins: Floats, ray: Floats, corners: Floats) -> NDArray[np.bool_]:
    """(n,) whether segments from `origins` (n, 3) along `ray` (3,) cross a triangle (Moeller & Trumbore 1997)."""
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    across = np.cross(ray, second)
    determinant = (first * across).sum(axis=1)
    kept = np.abs(determinant) > 1e-15
    corner, first, second, across = corners[kept, 0], first[kept], second[kept], across[kept]
    scale = 1 / determinant[kept]
    found = np.zeros(len(origins), bool)
    for i, origin in enumerate(origins):
        offset = origin - corner
        u = scale * (offset * across).sum(axis=1)
        turned = np.cross(offset, first)
        v = scale * (turned @ ray)
        t = scale * (turned * second).sum(axis=1)
        found[i] = ((u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0) & (t <= 1)).any()
    return found
