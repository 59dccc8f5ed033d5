"""Frame times of every integrator on curved surfaces.

A bulging wall fills the image, or half of it, in a room of six bounding planes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from lambent.bench.measuring.frame_times import FULL, QUICK, Effort, report
from lambent.core.geometry.directions import normalize
from lambent.core.progress import Progress, silent
from lambent.core.views.camera import Camera
from lambent.materials.document import Lobe, Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.device import open_device
from lambent.realtime.objects.unbaked import unbaked_scene
from lambent.realtime.renderer import Renderer
from lambent.scenes.geometry import grid
from lambent.scenes.scene import Mesh
from lambent.scenes.sky.environments import studio

__all__ = ["FULL", "NAME", "QUICK", "run"]

NAME = "walk-cube"
MATERIAL = Material(name="shown", lobes=(Lobe(mx=0.1, my=0.1, r0=(0.9, 0.9, 0.9), alpha=0.4),))
CAMERA = Camera(name="front", position=(0.0, 0.0, 1.5), target=(0.0, 0.0, 0.0), fov_y_deg=45.0)
ROOM = np.array([[x, y, z, 3.0] for x, y, z in np.concatenate([np.eye(3), -np.eye(3)])], np.float32)


def run(effort: Effort, progress: Progress = silent) -> dict[str, Any]:
    """Rows integrator x coverage x n."""
    return report(effort, scenes(effort.width, effort.height), progress)


def scenes(width: int, height: int) -> dict[str, tuple[Renderer, FrameState]]:
    """Renderer and frame for each coverage."""
    half_width = 1.5 * np.tan(np.radians(CAMERA.fov_y_deg) / 2) * width / height + 0.1
    # One sample per pixel: the bench measures the integrator, not the edges of triangles.
    device, state = open_device(), FrameState(CAMERA, width, height, lookup="planes", antialias=False)
    meshes = {"full": bulge(-half_width, half_width), "half": bulge(-half_width, 0.0)}
    return {
        coverage: (Renderer(device, unbaked_scene({"bulge": mesh}, MATERIAL, studio(), planes=ROOM)), state)
        for coverage, mesh in meshes.items()
    }


def bulge(x0: float, x1: float, y: float = 1.0) -> Mesh:
    """A sheet at z = 0 from x0 to x1 with the normals of a sphere: reflections in all directions, no occlusion."""
    x, height = np.meshgrid(np.linspace(x0, x1, 33), np.linspace(-y, y, 33))
    positions = np.stack([x, height, np.zeros_like(x)], axis=-1)
    normals = normalize(positions + np.array([0, 0, 1.2]))
    return grid(positions, normals, np.array([1.0, 0, 0]), positions[..., :2])
