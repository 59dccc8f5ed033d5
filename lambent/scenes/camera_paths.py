"""Cameras along a path: smooth curves through key cameras, at constant speed or by recorded times."""

from __future__ import annotations

import numpy as np

from lambent.core.geometry.directions import Floats, normalize
from lambent.core.plain import triple
from lambent.core.views.camera import Camera, CameraPath
from lambent.scenes.geometry.shapes import catmull_rom, centripetal_knots

STEPS = 256  # chords per segment that measure the curve's length


def camera_at(path: CameraPath, time_s: float) -> Camera:
    """Camera of the path at `time_s` seconds, clamped to its ends; see `sample_path` and `CameraPath.times_s`."""
    if len(path.keys) < 2 or path.seconds <= 0:
        return path.keys[0]
    if path.times_s is not None:
        return _recorded(path, path.times_s, time_s)
    return sample_path(path, time_s / path.seconds)


def sample_path(path: CameraPath, t: float) -> Camera:
    """Camera at share t in [0, 1] of a path's time.

    Positions lie on a centripetal Catmull-Rom curve through the keys and move at constant speed over the whole path;
    target, up and field of view follow the same parameter. Values of t beyond the ends give the ends.
    """
    keys = path.keys
    positions, targets, ups = (np.array([getattr(k, f) for k in keys], float) for f in ("position", "target", "up"))
    fov = np.array([[k.fov_y_deg] for k in keys], float)
    knots = centripetal_knots(positions)
    u = np.array([_parameter(positions, knots, float(np.clip(t, 0, 1)))])
    position, target, up, angle = (catmull_rom(p, u, knots=knots)[0][0] for p in (positions, targets, ups, fov))
    fov_y_deg = float(np.clip(angle[0], fov.min(), fov.max()))
    return Camera(path.name, triple(position), triple(target), triple(normalize(up)), fov_y_deg)


def path_length(path: CameraPath) -> float:
    """Length of the curve in metres."""
    positions = np.array([k.position for k in path.keys], float)
    return float(_lengths(positions, centripetal_knots(positions))[1][-1])


def _lengths(points: Floats, knots: Floats) -> tuple[Floats, Floats]:
    """Parameters, STEPS per segment, and the length of the curve up to each."""
    u = np.interp(np.linspace(0, len(knots) - 1, (len(knots) - 1) * STEPS + 1), np.arange(len(knots)), knots)
    chords = np.linalg.norm(np.diff(catmull_rom(points, u, knots=knots)[0], axis=0), axis=-1)
    return u, np.concatenate([[0.0], np.cumsum(chords)])


def _parameter(points: Floats, knots: Floats, share: float) -> float:
    """Curve parameter at a fraction of the length; for a path without length, at that fraction of the parameters."""
    u, lengths = _lengths(points, knots)
    if lengths[-1] == 0:
        return float(share * knots[-1])
    return float(np.interp(share * lengths[-1], lengths, u))


def _recorded(path: CameraPath, times: tuple[float, ...], time_s: float) -> Camera:
    """Cubic Hermite curve through the keys; the slope at a key is that between its neighbours."""
    keys = path.keys
    time_s = min(max(time_s, times[0]), times[-1])
    here = min(max(int(np.searchsorted(times, time_s, side="right")) - 1, 0), len(keys) - 2)
    near = [min(max(i, 0), len(keys) - 1) for i in range(here - 1, here + 3)]
    values = np.array([(*keys[i].position, *keys[i].target, *keys[i].up, keys[i].fov_y_deg) for i in near], float)
    t = np.array([times[i] for i in near], float)
    length = t[2] - t[1]
    slopes = [(values[k + 2] - values[k]) / (t[k + 2] - t[k]) * length for k in (0, 1)]
    s = (time_s - t[1]) / length
    now = (
        (1 + 2 * s) * (1 - s) ** 2 * values[1] + s * (1 - s) ** 2 * slopes[0]
        + s * s * (3 - 2 * s) * values[2] - s * s * (1 - s) * slopes[1]
    )  # fmt: skip
    fov_y_deg = float(np.clip(now[9], *sorted((values[1, 9], values[2, 9]))))
    return Camera(path.name, triple(now[0:3]), triple(now[3:6]), triple(now[6:9]), fov_y_deg)
