"""The scenes of the real-time benches, in memory: a few shapes under an environment, with no other light."""

from __future__ import annotations

import numpy as np

from lambent.realtime.unbaked import CAMERA
from lambent.realtime.unbaked import unbaked_scene as baked_scene
from lambent.scenes.environments import dusk, from_lat_long, night, studio
from lambent.scenes.geometry import patch, placed, sphere, tube
from lambent.scenes.scene import Mesh

__all__ = [
    "CAMERA", "baked_scene", "dusk", "from_lat_long", "night", "sphere_and_torus", "studio", "torus", "wall",
]  # fmt: skip


def torus(radius: float, thickness: float, around: int, section: int) -> Mesh:
    """Torus about the y axis, brushed along its length."""
    phi = 2 * np.pi * np.arange(24) / 24
    points = radius * np.stack([np.cos(phi), 0 * phi, np.sin(phi)], axis=-1)
    return tube(points, thickness, around=section, rows=around // 24, closed=True)


def sphere_and_torus(detail: int = 96) -> dict[str, Mesh]:
    """A sphere in a tilted torus: every normal, curvature of both signs. `detail`: steps round the torus."""
    tilt = np.array([[1, 0, 0], [0, np.cos(0.9), -np.sin(0.9)], [0, np.sin(0.9), np.cos(0.9)]])
    ring = torus(1.0, 0.24, around=detail, section=detail // 2)
    return {"sphere": sphere(0.62, around=detail, rows=detail // 2), "torus": placed(ring, rotation=tilt)}


def wall(width: float, height: float) -> dict[str, Mesh]:
    """A rectangle at z = 0 that faces +z, centred at the origin."""
    return {"wall": patch((-width / 2, -height / 2, 0), (width, 0, 0), (0, height, 0))}
