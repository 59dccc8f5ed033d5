"""Reproject a picture to another camera by its surfaces: without flicker, it stays fixed on them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lambent.core.arrays import Flags, Floats
from lambent.core.views.camera import Camera, clip_from_world, pixel_rays

if TYPE_CHECKING:
    from lambent.baking.reference.surfaces import Surfaces

NEAR_M = 1e-3
HIDDEN = 2e-3  # relative distance by which a point may lie behind the surface that the other camera sees


def reprojected(picture: Floats, before: Camera, after: Camera, surfaces: Surfaces) -> tuple[Floats, Flags]:
    """A picture (H, W, 3) of camera `before` reprojected to `after`, and (H, W) whether both see the same surface."""
    height, width = picture.shape[:2]
    rays = pixel_rays(after, width, height).reshape(-1, 3)
    points = np.asarray(after.position) + rays * surfaces.distance(np.asarray(after.position), rays)[:, None]
    offset = points - np.asarray(before.position)
    distance = np.linalg.norm(offset, axis=1)
    seen = surfaces.distance(np.asarray(before.position), offset / distance[:, None]) > distance * (1 - HIDDEN)
    clip = (
        np.concatenate([points, np.ones((len(points), 1))], axis=1) @ clip_from_world(before, width, height, NEAR_M).T
    )
    w = np.where(clip[:, 3] > NEAR_M, clip[:, 3], np.inf)
    column, row = (clip[:, 0] / w + 1) / 2 * width - 0.5, (1 - clip[:, 1] / w) / 2 * height - 0.5
    seen &= np.isfinite(w) & (column >= 0) & (column <= width - 1) & (row >= 0) & (row <= height - 1)
    c, r = column.clip(0, width - 1 - 1e-6), row.clip(0, height - 1 - 1e-6)
    left, top = c.astype(int), r.astype(int)
    x, y = (c - left)[:, None], (r - top)[:, None]
    right, below = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
    upper = picture[top, left] * (1 - x) + picture[top, right] * x
    lower = picture[below, left] * (1 - x) + picture[below, right] * x
    return (upper * (1 - y) + lower * y).reshape(picture.shape), seen.reshape(height, width)
