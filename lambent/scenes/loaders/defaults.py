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
    """A scene of one geometry file; its own lights, cameras and environment stay.

    Clear daylight is added where the file does not tell how its scene is lit, or tells of nothing that shines.
    """
    shines = bool(parts.environment or parts.lights or any(any(o.emission) for o in parts.objects))
    own_light = parts.environment is not None or (parts.tells_its_light and shines)
    said = ("nothing in it gives light: it is under daylight",) if parts.tells_its_light and not own_light else ()
    scene = Scene(
        name=name,
        objects=parts.objects,
        materials=parts.materials,
        environment=parts.environment if own_light else DAYLIGHT,
        lights=parts.lights,
        cameras=parts.cameras,
        exposure_ev=0.0 if own_light else EXPOSURE_EV,
        sources=parts.sources,
        warnings=(*parts.warnings, *said),
        textures=parts.textures,
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
