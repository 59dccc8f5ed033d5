"""What a planar reflector costs: mirror picture, its MIP levels and shading, against the diffuse floor (spec: bench).

A floor fills the picture, or half of it, and mirrors the room that planar_scene sets up. All rows are measured in
turns, round after round, so that whatever slows the machine slows them alike.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from lambent.bench import planar_scene
from lambent.bench.machine import inputs_of, machine
from lambent.bench.planar_quality import lobe_of
from lambent.bench.walk_cube import SIZES, Measured, measure, row_of, scaled_size, summary_of
from lambent.core.camera import Camera
from lambent.core.errors import UserError
from lambent.core.progress import Progress, silent
from lambent.realtime.device import open_device
from lambent.realtime.frame import FrameState, Renderer

NAME = "walk-planar"
NS = (3, 5, 7, 9, 11, 13, 15, 17, 19)
BY_N = ("rings", "lobe-4.25", "fis")  # split-sum leaves planes to the probes, diffuse knows no light of them
# From above, so that the floor fills the picture; and lower, so that the wall fills the upper half.
CAMERAS = {
    "full": Camera(name="full", position=(-2.4, 1.6, 3.2), target=(-2.4, 0.0, 2.2), fov_y_deg=40.0),
    "half": Camera(name="half", position=(-2.0, 1.2, 3.2), target=(-2.0, -0.05, -1.0), fov_y_deg=40.0),
}


def run(quick: bool, inputs: list[Path], progress: Progress = silent) -> dict[str, Any]:
    """Rows integrator x coverage x n; `quick` draws a ninth of the pixels. It reads no inputs."""
    if inputs:
        raise UserError("this bench reads no inputs", got=inputs[0])
    device = open_device()
    renderer = Renderer(device, planar_scene.planar_scene(lobe_of(0.1, 0.1)))
    rows = [
        _measured(renderer, integrator, coverage, n, *SIZES[quick])
        for coverage in CAMERAS
        for integrator, n in [("diffuse", None), ("split-sum", None), *((name, n) for n in NS for name in BY_N)]
    ]
    scaled = [_measured(renderer, "rings", "full", 7, *scaled_size(SIZES[quick], factor)) for factor in (0.5, 2.0)]
    measure([*rows, *scaled], progress)
    floors = {m.coverage: m for m in rows if m.integrator == "diffuse"}
    return {
        "machine": machine(device),
        "inputs": inputs_of(inputs),
        "rows": [row_of(m, floors[m.coverage]) for m in rows],
        "summary": summary_of(rows, scaled),
    }


def _measured(renderer: Renderer, integrator: str, coverage: str, n: int | None, width: int, height: int) -> Measured:
    state = FrameState(CAMERAS[coverage], width, height, integrator=integrator, n=n, antialias=False)
    return Measured(integrator, coverage, n, renderer, replace(state, lookup="plain"), [], [])
