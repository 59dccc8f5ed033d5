"""Camera position that frames an object: it fills the picture, and nothing stands in between."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import product

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.plain import triple
from lambent.core.views.camera import Camera
from lambent.viewer.cameras.cameras import NEAREST_M, WALL_M, Bounds, direction, yaw_pitch

FILLS = 0.75  # share of the picture's width or height that the object fills
TURNS_DEG = (0, 30, -30, 60, -60, 90, -90, 120, -120, 150, -150, 180)  # from the present line of sight
PITCHES_DEG = (-50.0, -5.0)  # steepest and flattest
OTHER_PITCH_DEG = -25.0


def framed(camera: Camera, bounds: Bounds, aspect: float, free_m: Callable[[Floats, Floats], float]) -> Camera:
    """The camera turned to the middle of the box `bounds`, at the distance at which the box fills the picture.

    Parameters
    ----------
    camera, aspect : Camera, float
        The present camera, and width / height of the picture.
    bounds : (low, high)
        Box of the object, in metres.
    free_m : callable
        (point (3,), unit direction (3,)) -> metres without an obstacle. Of the lines of sight that are long enough, the
        one nearest to the present one is taken; without any, the longest relative to the needed distance.
    """
    low, high = np.array(bounds)
    centre, corners = (low + high) / 2, np.array(list(product(*np.stack([low, high]).T))) - (low + high) / 2
    yaw, pitch = yaw_pitch(camera)
    level = np.clip(pitch, *np.radians(PITCHES_DEG))
    best, chosen = -1.0, camera
    for steep, turn in product((level, math.radians(OTHER_PITCH_DEG)), TURNS_DEG):
        ahead = direction(yaw + math.radians(turn), steep)
        wanted_m = max(_filling_m(corners, ahead, camera.fov_y_deg, aspect), NEAREST_M)
        there_m = max(min(wanted_m, free_m(centre, -ahead) - WALL_M), NEAREST_M)
        if there_m / wanted_m > best + 1e-6:
            eye = centre - ahead * there_m
            best, chosen = there_m / wanted_m, Camera("free", triple(eye), triple(centre), fov_y_deg=camera.fov_y_deg)
        if best >= 1:
            break
    return chosen


def _filling_m(corners: Floats, ahead: Floats, fov_y_deg: float, aspect: float) -> float:
    """Least distance of the eye from the box's middle at which all corners (8, 3), seen along `ahead`, are in view."""
    right = np.cross(ahead, (0.0, 1.0, 0.0))
    right /= np.linalg.norm(right)
    half = FILLS * math.tan(math.radians(fov_y_deg) / 2)
    across, up = abs(corners @ right) / (half * aspect), abs(corners @ np.cross(right, ahead)) / half
    return float((np.maximum(across, up) - corners @ ahead).max())
