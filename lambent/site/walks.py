"""Recorded walks of a site: cameras along each path, which the page joins by straight lines."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.core.views.camera import CameraPath
from lambent.scenes.camera_paths import camera_at

WALK_FPS = 30  # cameras of a second: at 2 m/s around a bend of 1 m, a chord is less than 1 mm beside the curve


def walk_of(path: CameraPath) -> NDArray[np.float32]:
    """(N, 10) position, target, up and vertical field of view in degrees, from start to end at equal intervals."""
    count = max(2, round(path.seconds * WALK_FPS) + 1)
    cameras = [camera_at(path, float(time_s)) for time_s in np.linspace(0.0, path.seconds, count)]
    return np.array([[*one.position, *one.target, *one.up, one.fov_y_deg] for one in cameras], np.float32)
