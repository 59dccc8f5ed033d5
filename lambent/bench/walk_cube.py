"""What a frame costs: every integrator on curved surfaces, against the diffuse floor (spec: bench).

A bulging wall fills the picture, or half of it, in a room of six bounding planes. All rows are measured in turns,
round after round, so that whatever slows the machine slows them alike.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from lambent.bench import specular_scene
from lambent.bench.machine import inputs_of, machine
from lambent.core.camera import Camera
from lambent.core.directions import normalize
from lambent.core.errors import UserError
from lambent.core.progress import Progress, silent
from lambent.materials.document import Lobe, Material
from lambent.realtime.device import open_device
from lambent.realtime.frame import FrameState, Renderer
from lambent.scenes.geometry import grid
from lambent.scenes.scene import Mesh

NAME = "walk-cube"
NS = (3, 5, 7, 9, 11, 13, 15, 17, 19)
BY_N = ("rings", "lobe-4.25", "fis")  # split-sum and diffuse do not know n
ROUNDS = 5
SIZES = {True: (560, 350), False: (1680, 1050)}  # by quick
MATERIAL = Material(name="shown", lobes=(Lobe(mx=0.1, my=0.1, r0=(0.9, 0.9, 0.9), alpha=0.4),))
CAMERA = Camera(name="front", position=(0.0, 0.0, 1.5), target=(0.0, 0.0, 0.0), fov_y_deg=45.0)
ROOM = np.array([[x, y, z, 3.0] for x, y, z in np.concatenate([np.eye(3), -np.eye(3)])], np.float32)


@dataclass(frozen=True)
class Measured:
    """One row to be: a renderer and the frame it draws, and the times so far."""

    integrator: str
    coverage: str
    n: int | None
    renderer: Renderer
    state: FrameState
    gpu_ms: list[float]
    wall_ms: list[float]


def run(quick: bool, inputs: list[Path], progress: Progress = silent) -> dict[str, Any]:
    """Rows integrator x coverage x n; `quick` draws a ninth of the pixels. It reads no inputs."""
    if inputs:
        raise UserError("this bench reads no inputs", got=inputs[0])
    device = open_device()
    size = SIZES[quick]
    rows = _measurements(device, *size)
    main = next(m for m in rows if (m.integrator, m.coverage, m.n) == ("rings", "full", 7))
    scaled = [_measured(main.renderer, "rings", "full", 7, *scaled_size(size, factor)) for factor in (0.5, 2.0)]
    measure([*rows, *scaled], progress)
    floors = {m.coverage: m for m in rows if m.integrator == "diffuse"}
    return {
        "bench": NAME,
        "machine": machine(device),
        "inputs": inputs_of(inputs),
        "rows": [row_of(m, floors[m.coverage]) for m in rows],
        "summary": summary_of(rows, scaled),
    }


def bulge(x0: float, x1: float, y: float = 1.0) -> Mesh:
    """A sheet at z = 0 from x0 to x1 with the normals of a sphere: reflections go everywhere, nothing is hidden."""
    x, height = np.meshgrid(np.linspace(x0, x1, 33), np.linspace(-y, y, 33))
    positions = np.stack([x, height, np.zeros_like(x)], axis=-1)
    normals = normalize(positions + np.array([0, 0, 1.2]))
    return grid(positions, normals, np.array([1.0, 0, 0]), positions[..., :2])


def _measurements(device: Any, width: int, height: int) -> list[Measured]:
    half_width = 1.5 * np.tan(np.radians(CAMERA.fov_y_deg) / 2) * width / height + 0.1
    rows = []
    for coverage, right in (("full", half_width), ("half", 0.0)):
        scene = specular_scene.baked_scene(
            {"bulge": bulge(-half_width, right)}, MATERIAL, specular_scene.studio(), planes=ROOM
        )
        renderer = Renderer(device, scene)
        for integrator, n in [("diffuse", None), ("split-sum", None), *((name, n) for n in NS for name in BY_N)]:
            rows.append(_measured(renderer, integrator, coverage, n, width, height))
    return rows


def _measured(renderer: Renderer, integrator: str, coverage: str, n: int | None, width: int, height: int) -> Measured:
    # One sample per pixel: what is measured is the integrator, not the edges of triangles.
    state = FrameState(CAMERA, width, height, integrator=integrator, n=n, lookup="planes", antialias=False)
    return Measured(integrator, coverage, n, renderer, state, [], [])


def scaled_size(size: tuple[int, int], factor: float) -> tuple[int, int]:
    return round(size[0] * factor**0.5), round(size[1] * factor**0.5)


def measure(rows: list[Measured], progress: Progress) -> None:
    """Draw all rows once to warm up, then ROUNDS times in turns, every second round backwards."""
    for index in range(ROUNDS + 1):
        for done, row in enumerate(rows if index % 2 else rows[::-1]):
            started = time.perf_counter()
            row.renderer.draw(row.state)
            row.renderer.finish()
            wall_ms = (time.perf_counter() - started) * 1e3
            if index > 0:
                row.wall_ms.append(wall_ms)
                row.gpu_ms.append(sum(row.renderer.statistics["gpu_ms"].values()) or wall_ms)
            progress(index * len(rows) + done + 1, (ROUNDS + 1) * len(rows), f"{row.integrator} n {row.n}")


def row_of(row: Measured, floor: Measured) -> dict[str, Any]:
    width, height = row.state.width, row.state.height
    gpu_ms, wall_ms = median(row.gpu_ms), median(row.wall_ms)
    samples = (row.n or 0) * width * height * (1.0 if row.coverage == "full" else 0.5)
    ratios = [a / b for a, b in zip(row.wall_ms, floor.wall_ms, strict=True)]
    return {
        "integrator": row.integrator,
        "coverage": row.coverage,
        "n": row.n,
        "width": width,
        "height": height,
        "gpu_ms": round(gpu_ms, 3),
        "gpu_ms_spread": [round(min(row.gpu_ms), 3), round(max(row.gpu_ms), 3)],
        "wall_ms": round(wall_ms, 3),
        "wall_ms_spread": [round(min(row.wall_ms), 3), round(max(row.wall_ms), 3)],
        "fps": round(1e3 / wall_ms, 2),
        "samples_per_s": round(samples / wall_ms * 1e3),
        "times_diffuse": round(median(ratios), 3),
        "times_diffuse_spread": [round(min(ratios), 3), round(max(ratios), 3)],
    }


def linear_fit(rows: list[Measured], floor: Measured) -> dict[str, float]:
    """Time = offset + per_sample n, both in diffuse frames, and the largest deviation of a row from that line."""
    n = np.array([row.n for row in rows], float)
    times = np.array([median(a / b for a, b in zip(row.wall_ms, floor.wall_ms, strict=True)) for row in rows])
    slope, offset = np.polyfit(n, times, 1)
    deviation = np.abs(times - offset - slope * n).max()
    return {key: round(float(v), 3) for key, v in (("per_sample", slope), ("offset", offset), ("deviation", deviation))}


def summary_of(rows: list[Measured], scaled: list[Measured]) -> dict[str, Any]:
    """Milliseconds per integrator and n at full coverage, lines through the times, and time's exponent in pixels."""
    small, large = scaled
    growth = np.log(median(large.wall_ms) / median(small.wall_ms)) / np.log(4)
    wall_ms: dict[str, dict[str, float]] = {}
    for row in rows:
        if row.coverage == "full":
            wall_ms.setdefault(row.integrator, {})[str(row.n)] = round(median(row.wall_ms), 2)
    floors = {m.coverage: m for m in rows if m.integrator == "diffuse"}
    linear = {
        coverage: {
            name: linear_fit([m for m in rows if (m.integrator, m.coverage) == (name, coverage)], floor)
            for name in BY_N
        }
        for coverage, floor in floors.items()
    }
    return {"wall_ms_full": wall_ms, "linear_in_diffuse_frames": linear, "growth": round(float(growth), 3)}
