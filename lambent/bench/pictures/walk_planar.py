"""Frame times of a planar reflector: its reflection buffer, MIP levels and shading.

A floor fills the image, or half of it, and mirrors the room of planar_scene. split-sum shows probes on planes, and
diffuse ignores planar reflections.
"""

from __future__ import annotations

from typing import Any

from lambent.bench.measuring.frame_times import FULL, QUICK, Effort, report
from lambent.bench.pictures.planar_quality import lobe_of
from lambent.bench.scenes import planar_scene
from lambent.core.progress import Progress, silent
from lambent.core.views.camera import Camera
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.device import open_device
from lambent.realtime.renderer import Renderer

__all__ = ["FULL", "NAME", "QUICK", "run"]

NAME = "walk-planar"
# From above, so that the floor fills the image; and lower, with the wall in the upper half.
CAMERAS = {
    "full": Camera(name="full", position=(-2.4, 1.6, 3.2), target=(-2.4, 0.0, 2.2), fov_y_deg=40.0),
    "half": Camera(name="half", position=(-2.0, 1.2, 3.2), target=(-2.0, -0.05, -1.0), fov_y_deg=40.0),
}


def run(effort: Effort, progress: Progress = silent) -> dict[str, Any]:
    """Rows integrator x coverage x n."""
    return report(effort, scenes(effort.width, effort.height), progress)


def scenes(width: int, height: int) -> dict[str, tuple[Renderer, FrameState]]:
    """Renderer and frame for each coverage."""
    renderer = Renderer(open_device(), planar_scene.planar_scene(lobe_of(0.1, 0.1)))
    return {
        coverage: (renderer, FrameState(camera, width, height, lookup="plain", antialias=False))
        for coverage, camera in CAMERAS.items()
    }
