"""Ways of cameras: smooth curves through key cameras, passed at constant speed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from lambent.core.frames import Floats, normalize
from lambent.scenes.geometry.curves import catmull_rom, centripetal_knots
from lambent.scenes.scene import Camera, Triple

STEPS = 256  # chords per segment that measure the curve's length


class CameraLike(Protocol):
    """A camera, or the store's record of one."""

    @property
    def position(self) -> Triple: ...
    @property
    def target(self) -> Triple: ...
    @property
    def up(self) -> Triple: ...
    @property
    def fov_y_deg(self) -> float: ...


class PathLike(Protocol):
    """A camera path, or the store's record of one."""

    @property
    def name(self) -> str: ...
    @property
    def keys(self) -> Sequence[Any]: ...


def sample_path(path: PathLike, t: float) -> Camera:
    """Camera at share t in [0, 1] of a path's time.

    Positions lie on a centripetal Catmull-Rom curve through the keys and move at constant speed over the whole path;
    target, up and field of view follow the same parameter. Values of t beyond the ends give the ends.
    """
    keys = path.keys
    positions, targets, ups = (
        np.array([getattr(k, what) for k in keys], float) for what in ("position", "target", "up")
    )  # fmt: skip
    fov = np.array([[k.fov_y_deg] for k in keys], float)
    knots = centripetal_knots(positions)
    u = np.array([_parameter(positions, knots, float(np.clip(t, 0, 1)))])
    position, target, up, angle = (catmull_rom(p, u, knots=knots)[0][0] for p in (positions, targets, ups, fov))
    fov_y_deg = float(np.clip(angle[0], fov.min(), fov.max()))
    return Camera(path.name, _triple(position), _triple(target), _triple(normalize(up)), fov_y_deg)


def path_length(path: PathLike) -> float:
    """Length of the way in metres."""
    positions = np.array([k.position for k in path.keys], float)
    return float(_lengths(positions, centripetal_knots(positions))[1][-1])


def _lengths(points: Floats, knots: Floats) -> tuple[Floats, Floats]:
    """Parameters, STEPS per segment, and the length of the curve up to each."""
    u = np.interp(np.linspace(0, len(knots) - 1, (len(knots) - 1) * STEPS + 1), np.arange(len(knots)), knots)
    chords = np.linalg.norm(np.diff(catmull_rom(points, u, knots=knots)[0], axis=0), axis=-1)
    return u, np.concatenate([[0.0], np.cumsum(chords)])


def _parameter(points: Floats, knots: Floats, share: float) -> float:
    """Curve parameter at a share of the length; of a path that stands still, that share of the parameters."""
    u, lengths = _lengths(points, knots)
    if lengths[-1] == 0:
        return float(share * knots[-1])
    return float(np.interp(share * lengths[-1], lengths, u))


def _triple(values: Floats) -> Triple:
    x, y, z = (float(v) for v in values)
    return x, y, z
