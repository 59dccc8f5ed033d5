"""One device for all tests of the renderer, and a wall whose every pixel's wo is known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lambent.bench.specular_scene import baked_scene, wall
from lambent.core.cubemap import face_directions
from lambent.core.frames import normalize
from lambent.materials.document import Material
from lambent.realtime.baked import BakedScene
from lambent.realtime.camera import image_plane
from lambent.realtime.device import open_device
from lambent.store.contract import CameraRecord

Floats = NDArray[np.floating]
OBLIQUE = CameraRecord(name="oblique", position=(1.5, 0.8, 2.0), target=(0.2, 0.1, 0.0), fov_y_deg=30.0)


@pytest.fixture(scope="session")
def device(adapter: None) -> Any:
    return open_device()


def pixel_rays(camera: CameraRecord, width: int, height: int) -> Floats:
    """(height, width, 3) unit directions through the pixel centres."""
    across, up, forward = image_plane(camera, width, height)
    x = (np.arange(width) + 0.5) / width * 2 - 1
    y = 1 - (np.arange(height) + 0.5) / height * 2
    return normalize(forward + x[None, :, None] * across + y[:, None, None] * up)


def smooth_light(w: Floats) -> Floats:
    """Radiance (..., 3) of unit directions: smooth, of three colours, without symmetry."""
    lamps = ((1.0, 0.2, 0.6), (-0.5, 0.9, -0.3), (0.1, -0.8, 0.7))
    return np.stack([0.2 + 2 * np.exp(3 * (w @ normalize(np.array(lamp)) - 1)) for lamp in lamps], axis=-1)


def cube_of(light: Any, n: int = 64) -> Floats:
    return np.asarray(light(normalize(face_directions(n))), np.float32)


def wall_scene(material: Material, environment: Floats, **more: Any) -> BakedScene:
    """A wide wall at z = 0 that faces +z, brushed along +x."""
    return baked_scene(wall(20, 20), material, environment, **more)
