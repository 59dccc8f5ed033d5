"""Pinhole cameras for loaders, bake, renderer and window: the record, its axes, its projection and its rays.

Clip space is WebGPU's with reversed depth (1 at the near plane, 0 at infinity). World space is right-handed, y up,
metres.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from lambent.core.geometry.directions import Floats, normalize
from lambent.core.plain import Triple, triple

FARTHEST_M = 1e9  # from the origin: in float32, squares of larger distances overflow
OVERVIEW_FROM = np.array([0.5, 0.35, 0.8])
OVERVIEW_FOV_Y_DEG = 45.0


@dataclass(frozen=True)
class Camera:
    """Pinhole camera. `fov_y_deg` is the full vertical field of view."""

    name: str
    position: Triple
    target: Triple
    up: Triple = (0.0, 1.0, 0.0)
    fov_y_deg: float = 45.0

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012 - read by pydantic: an unknown key in a file is an error


@dataclass(frozen=True)
class CameraPath:
    """Key cameras on a smooth curve, travelled at constant speed or with one time per key.

    `times_s`, if given, has one time per key, starts at 0, increases, and ends at `seconds`.
    """

    name: str
    keys: tuple[Camera, ...]
    seconds: float = 20.0
    times_s: tuple[float, ...] | None = None

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012

    def frames(self, fps: float) -> int:
        """Number of frames of a film along the path, at least 2."""
        return max(2, round(self.seconds * fps))


def camera_axes(camera: Camera) -> tuple[Floats, Floats, Floats]:
    """Unit vectors (right, up, forward); looking along -z with up +y, right is +x.

    A camera whose target is its position looks along -z. An `up` parallel to the view is replaced by +z, or by +x if
    the view is along z.
    """
    forward = normalize(np.subtract(camera.target, camera.position).astype(float))
    if not forward.any():
        forward = np.array([0.0, 0.0, -1.0])
    right = np.cross(forward, camera.up)
    if np.linalg.norm(right) < 1e-6 * max(1e-30, float(np.linalg.norm(camera.up))):
        right = np.cross(forward, [0.0, 0.0, 1.0] if abs(forward[2]) < 0.9 else [1.0, 0.0, 0.0])
    right = right / np.linalg.norm(right)
    return right, np.cross(right, forward), forward


def image_plane(camera: Camera, width: int, height: int) -> tuple[Floats, Floats, Floats]:
    """Vectors (across, up, forward), (3,) each: the ray of clip position (x, y) is forward + x across + y up.

    `width` and `height` are the image's size in pixels; only their ratio matters.
    """
    right, up, forward = camera_axes(camera)
    half = np.tan(np.radians(camera.fov_y_deg) / 2)
    return right * half * width / height, up * half, forward


def rays_through(camera: Camera, x_px: ArrayLike, y_px: ArrayLike, width: int, height: int) -> Floats:
    """Unit directions (..., 3) of the rays through points of an image of `width` x `height` pixels.

    `x_px` and `y_px` (...) are in pixels from the top left corner, y downwards.
    """
    across, up, forward = image_plane(camera, width, height)
    x, y = 2 * np.asarray(x_px, float) / width - 1, 1 - 2 * np.asarray(y_px, float) / height
    return normalize(forward + x[..., None] * across + y[..., None] * up)


def pixel_rays(camera: Camera, width: int, height: int) -> Floats:
    """Unit directions (height, width, 3) of the rays through the pixels' centres, row 0 on top."""
    columns, rows = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    return rays_through(camera, columns, rows, width, height)


def clip_from_world(
    camera: Camera, width: int, height: int, near_m: float, jitter_px: tuple[float, float] = (0.0, 0.0)
) -> Floats:
    """(4, 4) matrix from world to clip space: infinite far plane, reversed depth near/z, near plane at `near_m` metres.

    `jitter_px` moves the sample within its pixel, x to the right, y down.
    """
    right, up, forward = camera_axes(camera)
    view = np.eye(4)
    view[:3, :3] = [right, up, -forward]
    view[:3, 3] = -view[:3, :3] @ np.asarray(camera.position, dtype=float)
    focal = 1 / np.tan(np.radians(camera.fov_y_deg) / 2)
    projection = np.array(
        [
            [focal * height / width, 0, 2 * jitter_px[0] / width, 0],
            [0, focal, -2 * jitter_px[1] / height, 0],
            [0, 0, 0, near_m],
            [0, 0, -1, 0],
        ]
    )
    return np.asarray(projection @ view)


def overview(low: ArrayLike, high: ArrayLike) -> Camera:
    """Camera that sees the bounding sphere of the box (low, high) from the front, the right and slightly above."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    centre, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    distance = radius / math.sin(math.radians(OVERVIEW_FOV_Y_DEG) / 2)
    position = centre + OVERVIEW_FROM / np.linalg.norm(OVERVIEW_FROM) * distance
    return Camera("overview", triple(position), triple(centre), fov_y_deg=OVERVIEW_FOV_Y_DEG)
