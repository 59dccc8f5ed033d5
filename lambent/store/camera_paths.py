"""Where a camera path leads at a time: shared by the window and by films."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.store.contract import CameraRecord, PathRecord

Floats = NDArray[np.floating]
STEPS = 32  # chords that measure the length of a segment


def camera_at(path: PathRecord, time_s: float) -> CameraRecord:
    """Camera of the path at `time_s` seconds, clamped to its ends.

    Every segment between two keys takes the same time and is passed at constant speed; position, target, up and field
    of view follow one Catmull-Rom spline (Catmull & Rom 1974) through the keys.
    """
    segments = len(path.keys) - 1
    if segments < 1 or path.seconds <= 0:
        return path.keys[0]
    passed = float(np.clip(time_s / path.seconds, 0, 1)) * segments
    segment = min(int(passed), segments - 1)
    rows = np.array([(*key.position, *key.target, *key.up, key.fov_y_deg) for key in path.keys])
    before, after = rows[max(segment - 1, 0)], rows[min(segment + 2, segments)]
    corners = np.stack([before, rows[segment], rows[segment + 1], after])
    x = _hermite(corners, _at_constant_speed(corners, passed - segment))
    (px, py, pz), (tx, ty, tz), (ux, uy, uz), fov = x[:3].tolist(), x[3:6].tolist(), x[6:9].tolist(), float(x[9])
    return CameraRecord(name=path.name, position=(px, py, pz), target=(tx, ty, tz), up=(ux, uy, uz), fov_y_deg=fov)


def _hermite(corners: Floats, u: float) -> Floats:
    """Point (D,) at u in [0, 1] between corners[1] and corners[2] of (4, D)."""
    p0, p1, p2, p3 = corners
    m1, m2 = (p2 - p0) / 2, (p3 - p1) / 2
    a, b = 2 * u**3 - 3 * u**2 + 1, u**3 - 2 * u**2 + u
    return np.asarray(a * p1 + b * m1 + (1 - a) * p2 + (u**3 - u**2) * m2)


def _at_constant_speed(corners: Floats, share: float) -> float:
    """Spline parameter where `share` of the position's way is done; `share` itself where the position rests."""
    u = np.linspace(0, 1, STEPS + 1)
    points = np.stack([_hermite(corners, float(v))[:3] for v in u])
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=-1))])
    return float(np.interp(share * way[-1], way, u)) if way[-1] > 1e-9 else share
