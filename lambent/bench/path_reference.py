"""The bench's pictures path traced: with the light that the shapes throw at each other, which a probe leaves out."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lambent.core.camera import Camera
from lambent.core.cubemap import sample
from lambent.core.images import write_image
from lambent.core.latlong import lat_long_directions
from lambent.materials.document import Material
from lambent.scenes.scene import ImageEnvironment, Mesh, Scene, SceneObject

Floats = NDArray[np.floating]


def to_lat_long(cube: Floats, height: int = 512) -> Floats:
    """Lat-long picture (height, 2 height, 3) of an environment (6, N, N, 3): top +y, middle column -z."""
    return sample(cube, lat_long_directions(height, 2 * height))


def path_traced(
    meshes: Mapping[str, Mesh], material: Material, environment: Floats, camera: Camera, size: int, spp: int
) -> Floats:
    """Radiance (size, size, 3) of `meshes` in `material` under `environment` (6, N, N, 3), the sky behind them."""
    from lambent.bake.reference import render_reference

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "environment.exr"
        write_image(file, to_lat_long(environment))
        objects = tuple(SceneObject(name, mesh, material.name) for name, mesh in meshes.items())
        scene = Scene("bench", objects, {material.name: material}, ImageEnvironment(file))
        view = Camera(camera.name, camera.position, camera.target, camera.up, camera.fov_y_deg)
        return render_reference(scene, view, size, size, spp)[0]
