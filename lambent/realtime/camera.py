"""Pinhole camera matrices. Clip space is WebGPU's, depth reversed (1 at the near plane, 0 at infinity)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.store.contract import CameraRecord

Floats = NDArray[np.floating]


def camera_axes(camera: CameraRecord) -> tuple[Floats, Floats, Floats]:
    """Unit vectors (right, up, forward); looking along -z with up +y, right is +x."""
    forward = np.subtract(camera.target, camera.position).astype(float)
    length = np.linalg.norm(forward)
    forward = forward / length if length > 0 else np.array([0.0, 0.0, -1.0])
    right = np.cross(forward, camera.up)
    if np.linalg.norm(right) < 1e-6 * max(1e-30, float(np.linalg.norm(camera.up))):
        right = np.cross(forward, [0.0, 0.0, 1.0] if abs(forward[2]) < 0.9 else [1.0, 0.0, 0.0])
    right = right / np.linalg.norm(right)
    return right, np.cross(right, forward), forward


def image_plane(camera: CameraRecord, width: int, height: int) -> tuple[Floats, Floats, Floats]:
    """Vectors (across, up, forward): the ray of clip position (x, y) is forward + x across + y up."""
    right, up, forward = camera_axes(camera)
    half = np.tan(np.radians(camera.fov_y_deg) / 2)
    return right * half * width / height, up * half, forward


def clip_from_world(
    camera: CameraRecord, width: int, height: int, near_m: float, jitter_px: tuple[float, float] = (0.0, 0.0)
) -> Floats:
    """(4, 4) matrix to clip space: infinite far plane, reversed depth near/z.

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
