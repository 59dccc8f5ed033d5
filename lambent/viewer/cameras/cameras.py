"""Camera motion for mouse and keys: pure functions from one camera to the next.

Two modes. Orbiting turns the camera about its target. Walking keeps the eye `EYE_HEIGHT_M` above the floor and inside
the scene's bounds. In both modes the horizon stays level (up is +y) and the pitch stays short of the poles. Angles are
in radians, lengths in metres, mouse distances in pixels of the window (x right, y down).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace

import numpy as np

from lambent.core.plain import Triple, triple
from lambent.core.views.camera import Camera
from lambent.scenes.scene import EYE_HEIGHT_M

Bounds = tuple[Triple, Triple]

WALK_M_S, FAST = 1.4, 3.0
PITCH_LIMIT_RAD = math.radians(85)
TURN_RAD_PX = math.radians(0.3)
ZOOM_PER_STEP = 0.88
NEAREST_M = 0.02
WALL_M = 0.15  # the eye keeps this distance from the scene's bounds
SETTLE_S = 0.12  # time constant of the eye that follows the floor
LONGEST_STEP_S = 0.25  # a stalled frame does not carry the walker across the room

KEYS = {
    "w": (0, 0, 1), "ArrowUp": (0, 0, 1), "s": (0, 0, -1), "ArrowDown": (0, 0, -1),
    "d": (1, 0, 0), "ArrowRight": (1, 0, 0), "a": (-1, 0, 0), "ArrowLeft": (-1, 0, 0),
    "e": (0, 1, 0), " ": (0, 1, 0), "q": (0, -1, 0), "c": (0, -1, 0),
}  # fmt: skip


def yaw_pitch(camera: Camera) -> tuple[float, float]:
    """Heading (0 looks along -z, positive to the right) and elevation of the line of sight."""
    x, y, z = np.subtract(camera.target, camera.position)
    return math.atan2(x, -z), math.atan2(y, math.hypot(x, z))


def orbit(camera: Camera, dx_px: float, dy_px: float, pivot: Triple | None = None) -> Camera:
    """Rotate the camera about `pivot` (default: the target), whose position in the picture does not change."""
    pivot = camera.target if pivot is None else pivot
    yaw, pitch = yaw_pitch(camera)
    before, after = _axes(yaw, pitch), _axes(yaw + TURN_RAD_PX * dx_px, pitch - TURN_RAD_PX * dy_px)
    eye = np.array(pivot) + after.T @ (before @ np.subtract(camera.position, pivot))
    return _placed(camera, eye, pivot if pivot == camera.target else eye + after[2] * _distance(camera))


def pan(camera: Camera, dx_px: float, dy_px: float, height_px: float) -> Camera:
    """Shift the camera in the picture plane, so that the target stays under the mouse."""
    yaw, pitch = yaw_pitch(camera)
    right = np.array([math.cos(yaw), 0, math.sin(yaw)])
    up = np.cross(right, direction(yaw, pitch))
    metres_px = 2 * _distance(camera) * math.tan(math.radians(camera.fov_y_deg) / 2) / height_px
    shift = (dy_px * up - dx_px * right) * metres_px
    return _placed(camera, np.array(camera.position) + shift, np.array(camera.target) + shift)


def zoom(camera: Camera, steps: float, bounds: Bounds, pivot: Triple | None = None) -> Camera:
    """Move `steps` of the wheel towards `pivot` (default: the target; negative: away).

    The camera never passes the pivot and never loses sight of the scene.
    """
    pivot = camera.target if pivot is None else pivot
    before = max(math.dist(pivot, camera.position), NEAREST_M)
    return nearer(camera, pivot, min(max(before * ZOOM_PER_STEP**steps, NEAREST_M), 20 * math.dist(*bounds)) / before)


def nearer(camera: Camera, pivot: Triple, share: float) -> Camera:
    """Move to this share of the distance from `pivot`, whose position in the picture does not change."""
    eye = np.array(pivot) + share * np.subtract(camera.position, pivot)
    ahead = direction(*yaw_pitch(camera)) * max(share * _distance(camera), NEAREST_M)
    return _placed(camera, eye, pivot if pivot == camera.target else eye + ahead)


def look(camera: Camera, dx_px: float, dy_px: float) -> Camera:
    """Turn on the spot, in the direction of the drag."""
    yaw, pitch = yaw_pitch(camera)
    forward = direction(yaw + TURN_RAD_PX * dx_px, pitch - TURN_RAD_PX * dy_px)
    return _placed(camera, camera.position, np.array(camera.position) + forward * _distance(camera))


@dataclass
class Walker:
    """Walking speed in m/s and eye height above the floor in metres."""

    speed_m_s: float
    eye_height_m: float

    @classmethod
    def of(cls, bounds: Bounds) -> Walker:
        """`EYE_HEIGHT_M`, or 60 % of the height of a scene that is too low to stand in; the pace in proportion."""
        height_m = bounds[1][1] - bounds[0][1]
        eye_height_m = EYE_HEIGHT_M if height_m >= EYE_HEIGHT_M + 2 * WALL_M else 0.6 * height_m
        return cls(WALK_M_S * eye_height_m / EYE_HEIGHT_M, eye_height_m)


def walk(
    camera: Camera,
    walker: Walker,
    keys: AbstractSet[str],
    dt_s: float,
    *,
    bounds: Bounds,
    floor_y: float | None,
    flying: bool = False,
    fast: float = 1.0,
    stick: tuple[float, float] = (0.0, 0.0),
    allowed: Callable[[np.ndarray, np.ndarray], np.ndarray] = lambda eye, step: step,
) -> Camera:
    """Move for `dt_s` seconds by the held `keys` (names as in `KEYS`; others are ignored) and a gamepad's stick.

    On foot, the eye moves horizontally as far as `allowed(eye, step)` permits, and settles at eye height above
    `floor_y` (None: the scene's lowest point). Flying, it moves along the line of sight and, by other keys, up and
    down, through all obstacles.
    """
    held = [KEYS[key] for key in keys if key in KEYS]
    right, up, forward = np.sum([(stick[0], 0, stick[1]), *held], axis=0)
    if not (right or forward or (up and flying)):
        return camera
    dt_s = min(dt_s, LONGEST_STEP_S)
    yaw, pitch = yaw_pitch(camera)
    step = right * np.array([math.cos(yaw), 0, math.sin(yaw)]) + forward * direction(yaw, pitch if flying else 0.0)
    step = step + np.array([0, up if flying else 0, 0])
    length = float(np.linalg.norm(step))
    if length > 0:
        step = step / (length if held else max(length, 1.0))
    eye, step = np.array(camera.position), step * (walker.speed_m_s * fast) * dt_s
    eye = eye + (step if flying else allowed(eye, step))
    if not flying:
        eye_y = (bounds[0][1] if floor_y is None else floor_y) + walker.eye_height_m
        eye[1] += (eye_y - eye[1]) * (1 - math.exp(-dt_s / SETTLE_S))
    eye = confined(eye, camera.position, bounds)
    return _placed(camera, eye, eye + direction(yaw, pitch) * _distance(camera))


def standing(camera: Camera, bounds: Bounds, floor_y: float | None, height_m: float) -> Camera:
    """The camera with its eye `height_m` above `floor_y` (None: the scene's lowest point)."""
    return lifted(camera, (bounds[0][1] if floor_y is None else floor_y) + height_m - camera.position[1])


def lifted(camera: Camera, lift_m: float) -> Camera:
    """Raise the camera by `lift_m`."""
    (px, py, pz), (tx, ty, tz) = camera.position, camera.target
    return replace(camera, name="free", position=(px, py + lift_m, pz), target=(tx, ty + lift_m, tz))


def confined(eye: np.ndarray, before: Triple, bounds: Bounds) -> np.ndarray:
    """Keep `eye` inside the bounds; if `before` was outside, let the eye get no farther out."""
    low, high = np.array(bounds)
    margin = np.minimum(WALL_M, 0.1 * (high - low))
    return np.asarray(np.clip(eye, np.minimum(low + margin, before), np.maximum(high - margin, before)))


def is_within(point: Triple, bounds: Bounds) -> bool:
    """Whether a point lies in the bounds."""
    return bool(np.all(np.greater_equal(point, bounds[0]) & np.less_equal(point, bounds[1])))


def way_out_m(point: np.ndarray, towards: np.ndarray, bounds: Bounds) -> float:
    """Distance along a unit direction at which a ray from within the bounds leaves them."""
    ends = np.where(towards > 0, bounds[1], bounds[0]) - point
    return float(np.min(np.divide(ends, towards, out=np.full(3, np.inf), where=np.abs(towards) > 1e-12)))


def _axes(yaw: float, pitch: float) -> np.ndarray:
    """(3, 3) rows to the right, up and ahead of a level camera."""
    right, ahead = np.array([math.cos(yaw), 0, math.sin(yaw)]), direction(yaw, pitch)
    return np.stack([right, np.cross(right, ahead), ahead])


def _distance(camera: Camera) -> float:
    return max(math.dist(camera.target, camera.position), NEAREST_M)


def direction(yaw: float, pitch: float) -> np.ndarray:
    """Line of sight (3,) for a heading and an elevation, clamped short of the poles."""
    pitch = min(max(pitch, -PITCH_LIMIT_RAD), PITCH_LIMIT_RAD)
    return np.array([math.sin(yaw) * math.cos(pitch), math.sin(pitch), -math.cos(yaw) * math.cos(pitch)])


def _placed(camera: Camera, position: np.ndarray | Triple, target: np.ndarray | Triple) -> Camera:
    return Camera("free", triple(position), triple(target), fov_y_deg=camera.fov_y_deg)
