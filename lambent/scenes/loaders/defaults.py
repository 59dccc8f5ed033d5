"""What a bare geometry file lacks: daylight, a camera, an exposure."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from lambent.scenes.loaders.parts import Parts
from lambent.scenes.scene import Camera, Scene, SunSky, Triple

DAYLIGHT = SunSky(sun_direction=(0.4558, 0.7597, 0.4637))
EXPOSURE_EV = 2.0  # sunlit white is about .25 W/(sr m^2) in the sky model's units
FROM = np.array([0.5, 0.35, 0.8])
FOV_Y_DEG = 45.0


def with_defaults(name: str, parts: Parts) -> Scene:
    """A scene of one geometry file under clear daylight; its own lights and cameras stay."""
    scene = Scene(
        name=name,
        objects=parts.objects,
        materials=parts.materials,
        environment=DAYLIGHT,
        lights=parts.lights,
        cameras=parts.cameras,
        exposure_ev=EXPOSURE_EV,
        sources=parts.sources,
        warnings=parts.warnings,
    )
    if parts.cameras:
        return scene
    return replace(scene, cameras=(overview(*scene.bounds),))


def overview(low: np.ndarray, high: np.ndarray) -> Camera:
    """Camera that sees the whole of a box's bounding sphere, from the front, the right and a little above."""
    centre, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    distance = radius / math.sin(math.radians(FOV_Y_DEG) / 2)
    position = centre + FROM / np.linalg.norm(FROM) * distance
    return Camera("overview", _triple(position), _triple(centre), fov_y_deg=FOV_Y_DEG)


def _triple(values: np.ndarray) -> Triple:
    x, y, z = (float(v) for v in values)
    return x, y, z
