"""A wall whose every pixel's wo is known, and smooth light on it."""

from __future__ import annotations

from typing import Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.geometry.cubemap import face_directions
from lambent.core.geometry.directions import normalize
from lambent.core.views.camera import Camera
from lambent.materials.document import Material
from lambent.realtime.light.baked import BakedScene
from lambent.realtime.objects.unbaked import unbaked_scene
from lambent.scenes.geometry import patch

OBLIQUE = Camera(name="oblique", position=(1.5, 0.8, 2.0), target=(0.2, 0.1, 0.0), fov_y_deg=30.0)


def smooth_light(w: Floats) -> Floats:
    """Radiance (..., 3) of unit directions: smooth, of three colours, without symmetry."""
    lamps = ((1.0, 0.2, 0.6), (-0.5, 0.9, -0.3), (0.1, -0.8, 0.7))
    return np.stack([0.2 + 2 * np.exp(3 * (w @ normalize(np.array(lamp)) - 1)) for lamp in lamps], axis=-1)


def cube_of(light: Any, n: int = 64) -> Floats:
    return np.asarray(light(normalize(face_directions(n))), np.float32)


def wall_scene(material: Material, environment: Floats, **more: Any) -> BakedScene:
    """A wide wall at z = 0 that faces +z, brushed along +x."""
    return unbaked_scene({"wall": patch((-10, -10, 0), (20, 0, 0), (0, 20, 0))}, material, environment, **more)
