"""The environment as a cube map, sun disc included."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.baking.engine import engine
from lambent.baking.sky.daylight import lone_emitter, radiance_from
from lambent.baking.tracing.scene_builder import environment_dict
from lambent.core.arrays import Floats, Indices
from lambent.core.geometry.cubemap import directions_at, face_directions
from lambent.core.geometry.directions import normalize
from lambent.scenes.scene import Environment, SunSky

GRID, FINE_GRID = 4, 64  # samples per texel and axis; the fine grid covers texels that may show the sun
TEXELS_AT_ONCE = 1 << 16


def environment_cube(environment: Environment | None, n: int) -> NDArray[np.float32]:
    """(6, n, n, 3) float32 mean radiance of each texel, W/(sr m^2); black without an environment."""
    cube = np.zeros((6 * n * n, 3))
    if environment is not None:
        engine()
        emitter = lone_emitter(environment_dict(environment))
        for start in range(0, len(cube), TEXELS_AT_ONCE):
            texels = np.arange(start, min(start + TEXELS_AT_ONCE, len(cube)))
            cube[texels] = _means(emitter, texels, n, GRID)
        if isinstance(environment, SunSky):
            sun = normalize(np.array(environment.sun_direction, float))
            near = np.cos(np.radians(environment.sun_radius_deg) + 2 * np.sqrt(2) / n)  # texels that may show the disc
            sunny = np.flatnonzero(normalize(face_directions(n)).reshape(-1, 3) @ sun > near)
            cube[sunny] = _means(emitter, sunny, n, FINE_GRID)
    return cube.reshape(6, n, n, 3).astype(np.float32)


def _means(emitter: Any, texels: Indices, n: int, grid: int) -> Floats:
    """Mean radiance (k, 3) over a regular grid of samples in each texel."""
    face, row, column = np.unravel_index(texels, (6, n, n))
    sub = (np.arange(grid) + 0.5) / grid
    s = (column[:, None, None] + sub[None, None, :]) / n * 2 - 1
    t = (row[:, None, None] + sub[None, :, None]) / n * 2 - 1
    s, t = np.broadcast_arrays(s, t)
    w = normalize(directions_at(np.broadcast_to(face[:, None, None], s.shape), s, t)).reshape(-1, 3)
    return np.asarray(radiance_from(emitter, w).reshape(len(texels), -1, 3).mean(axis=1))
