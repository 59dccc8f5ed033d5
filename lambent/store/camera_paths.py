"""Where a camera path of a store leads at a time: for the window and for films."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from lambent.scenes.paths import sample_path
from lambent.store.contract import CameraRecord, PathRecord, Triple


class TimedPath(PathRecord):
    """A recorded path: every key has a time, so that somebody can stand still and look around.

    `times_s` begins at 0, grows, and ends at `seconds`.
    """

    times_s: tuple[float, ...]


def camera_at(path: PathRecord, time_s: float) -> CameraRecord:
    """Camera of the path at `time_s` seconds, clamped to its ends; see `scenes.paths.sample_path` and `TimedPath`."""
    if len(path.keys) < 2 or path.seconds <= 0:
        return path.keys[0]
    if isinstance(path, TimedPath):
        return _timed(path, time_s)
    return CameraRecord(**asdict(sample_path(path, time_s / path.seconds)))


def _timed(path: TimedPath, time_s: float) -> CameraRecord:
    """Cubic Hermite curve through the keys; the slope at a key is that between its neighbours."""
    times, keys = path.times_s, path.keys
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
    fov = sorted((values[1, 9], values[2, 9]))
    return CameraRecord(
        name=path.name,
        position=_triple(now[0:3]),
        target=_triple(now[3:6]),
        up=_triple(now[6:9]),
        fov_y_deg=float(np.clip(now[9], *fov)),
    )


def _triple(values: np.ndarray) -> Triple:
    x, y, z = (float(v) for v in values)
    return x, y, z
