"""The view from the window: a terrace that reflects daylight up to the ceiling, a lawn, a hedge, three trees."""

from __future__ import annotations

import numpy as np

from lambent.scenes.builtin.placing import thing
from lambent.scenes.builtin.shell import THICK, X
from lambent.scenes.geometry import cushion, cylinder, grid, placed
from lambent.scenes.scene import Mesh, SceneObject

GROUND = -0.15
TERRACE, LAWN, HEDGE_HIGH = 5.0, 15.0, 2.3  # radii and height, metres
COARSE = 0.05  # light map density of distant surfaces


def garden() -> list[SceneObject]:
    """A half disc of ground before the east wall, closed by a hedge that hides the horizon."""
    trees = ((8.2, -4.6, 2.7, 1.35), (12.0, 3.4, 3.4, 1.8), (10.5, 8.5, 3.0, 1.5))
    crowns = [placed(cushion((2 * r, 2.2 * r, 2 * r), 2.2, 4), (x, GROUND + y + 0.6, z)) for x, z, y, r in trees]
    trunks = [placed(cylinder(0.11, y, 12), (x, GROUND - 0.05, z)) for x, z, y, _ in trees]
    return [
        thing("terrace", "gravel", _ring(0.0, TERRACE), light_map_scale=COARSE),
        thing("lawn", "grass", _ring(TERRACE, LAWN), light_map_scale=COARSE),
        thing("hedge", "leaves", _hedge(), light_map_scale=COARSE),
        thing("tree_crowns", "leaves", *crowns, light_map_scale=COARSE),
        thing("tree_trunks", "dark_oak", *trunks, light_map_scale=COARSE),
    ]


def _half_circle(steps: int) -> np.ndarray:
    """Directions (steps + 1, 3) from north over east to south."""
    phi = np.linspace(-np.pi / 2, np.pi / 2, steps + 1)
    return np.stack([np.cos(phi), np.zeros_like(phi), np.sin(phi)], axis=-1)


def _ring(inner: float, outer: float) -> Mesh:
    radii = np.linspace(inner, outer, 5)
    origin = np.array([X + THICK - 0.05, GROUND, 0.0])
    positions = origin + radii[:, None, None] * _half_circle(32)
    return grid(positions, np.broadcast_to([0.0, 1.0, 0.0], positions.shape), (1, 0, 0), positions[..., [0, 2]])


def _hedge() -> Mesh:
    """Inner side and rounded top of a hedge with a slightly uneven crown."""
    around = _half_circle(96)
    phi = np.linspace(-np.pi / 2, np.pi / 2, 97)
    crown = HEDGE_HIGH + 0.08 * np.sin(9 * phi) + 0.05 * np.sin(23 * phi + 1)
    arc = np.linspace(0, np.pi / 2, 5)
    inward = np.concatenate([[0.0, 0.0], 0.4 * (1 - np.cos(arc[1:]))])
    share = np.concatenate([[-0.02, 0.82], 0.82 + 0.18 * np.sin(arc[1:])])
    tilt = np.concatenate([[0.0, 0.0], arc[1:]])
    origin = np.array([X + THICK - 0.05, GROUND, 0.0])
    up = np.array([0.0, 1.0, 0.0])
    positions = origin + (LAWN - 0.3 + inward)[:, None, None] * around + (share[:, None] * crown)[..., None] * up
    normals = -np.cos(tilt)[:, None, None] * around + np.sin(tilt)[:, None, None] * up
    uv = np.stack(np.broadcast_arrays(LAWN * phi[None, :], share[:, None] * HEDGE_HIGH), axis=-1)
    return grid(positions, normals, up, uv)
