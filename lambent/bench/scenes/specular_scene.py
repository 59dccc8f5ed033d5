"""The shapes of the real-time benches, and their path traced images."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.geometry.cubemap import sample
from lambent.core.geometry.latlong import lat_long_directions
from lambent.core.pictures.images import write_image
from lambent.core.views.camera import Camera
from lambent.materials.document import Material
from lambent.scenes.geometry import placed, sphere, tube
from lambent.scenes.scene import ImageEnvironment, Mesh, Scene, SceneObject


def torus(radius: float, thickness: float, around: int, section: int) -> Mesh:
    """Torus about the y axis, brushed along its circumference."""
    phi = 2 * np.pi * np.arange(24) / 24
    points = radius * np.stack([np.cos(phi), 0 * phi, np.sin(phi)], axis=-1)
    return tube(points, thickness, around=section, rows=around // 24, closed=True)


def sphere_and_torus(detail: int = 96) -> dict[str, Mesh]:
    """A sphere in a tilted torus: every normal, curvature of both signs. `detail`: segments around the torus."""
    tilt = np.array([[1, 0, 0], [0, np.cos(0.9), -np.sin(0.9)], [0, np.sin(0.9), np.cos(0.9)]])
    ring = torus(1.0, 0.24, around=detail, section=detail // 2)
    return {"sphere": sphere(0.62, around=detail, rows=detail // 2), "torus": placed(ring, rotation=tilt)}


def path_traced(
    meshes: Mapping[str, Mesh], material: Material, environment: Floats, camera: Camera, size: int, spp: int
) -> Floats:
    """Radiance (size, size, 3) of `meshes` in `material` under `environment` (6, N, N, 3), the sky behind them."""
    from lambent.baking.reference.path_traced import render_reference

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "environment.exr"
        write_image(file, sample(environment, lat_long_directions(512, 1024)))
        objects = tuple(SceneObject(name, mesh, material.name) for name, mesh in meshes.items())
        scene = Scene("bench", objects, {material.name: material}, ImageEnvironment(file))
        return render_reference(scene, camera, size, size, spp)[0]
