"""`load`: how long a command takes to its first frame from a cold start, and the memory it peaks at.

Every run is a process of its own, so that imports, pipelines and reading the store are all in the figure. `render` ends
with its frame; `walk` is a window that closes after one frame and needs a display; `--help` is the start-up alone.
`gpu_mb` is what buffers and textures of that frame hold, counted where they are made: no driver is asked.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from lambent.core.errors import UserError
from lambent.core.progress import Progress

NAME = "load"
RUNS = 5
SIZE, QUICK_SIZE = (1680, 1050), (640, 400)
TIMEOUT_S = 300

_TIMED = """
import json, subprocess, sys, time
began = time.perf_counter()
code = subprocess.call(sys.argv[1:], stdout=subprocess.DEVNULL)
seconds = time.perf_counter() - began
try:
    import resource
    peak_mb = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)
except ImportError:
    peak_mb = None
print(json.dumps([seconds, peak_mb]))
sys.exit(code)
"""
_WALK = "import sys; from lambent.viewer.app import run; run(sys.argv[1], size=({0}, {1}), frames=1)"
_GPU = """
import sys
import wgpu
from lambent.realtime.device import open_device
from lambent.realtime.frame import FrameState, Renderer
from lambent.store.contract import scene_record
from lambent.store.store import Store
store = Store.open(sys.argv[1])
renderer = Renderer(open_device(), store)
renderer.display_image(FrameState(scene_record(store).cameras[0], {0}, {1}))
print("bytes", wgpu.diagnostics.object_counts.get_dict()["total"]["resource_mem"])
"""


def run(quick: bool, inputs: Sequence[Path], progress: Progress) -> dict[str, Any]:
    """Rows per command on the first input, a baked store; without one, on the built-in box baked here."""
    with tempfile.TemporaryDirectory() as folder:
        store = inputs[0] if inputs else _box(Path(folder) / "box.store", progress)
        size = QUICK_SIZE if quick else SIZE
        commands = _commands(store, Path(folder) / "frame.png", size)
        measured: dict[str, list[tuple[float, float | None]]] = {name: [] for name in commands}
        for turn in range(RUNS):
            for index, (name, command) in enumerate(commands.items()):
                progress(turn * len(commands) + index, RUNS * len(commands), f"load: {name}")
                measured[name].append(timed(command))
        gpu_mb = _gpu_mb(store, size)
    rows = [_row(name, runs, gpu_mb if name != "--help" else None) for name, runs in measured.items()]
    return {"rows": rows, "summary": {"width": size[0], "height": size[1], "runs": RUNS, "store": store.name}}


def timed(command: list[str]) -> tuple[float, float | None]:
    """(seconds, peak resident memory in MB or None where the system does not tell) of one process."""
    # Through a small process of its own: a child's peak starts at what its parent held when it was forked.
    done = subprocess.run([sys.executable, "-c", _TIMED, *command], capture_output=True, text=True, timeout=TIMEOUT_S)
    if done.returncode != 0:
        last = done.stderr.strip().splitlines()[-1:] or [f"code {done.returncode}"]
        raise UserError(f"command failed ({last[0]})", field=" ".join(command[2:5]))
    seconds, peak = json.loads(done.stdout.splitlines()[-1])
    return seconds, peak


def _commands(store: Path, frame: Path, size: tuple[int, int]) -> dict[str, list[str]]:
    lambent = [sys.executable, "-m", "lambent.cli.main"]
    still = ["render", str(store), "-o", str(frame), "--size", f"{size[0]}x{size[1]}"]
    commands = {"--help": [*lambent, "--help"], "render": [*lambent, *still]}
    if _has_display():
        commands["walk"] = [sys.executable, "-c", _WALK.format(*size), str(store)]
    return commands


def _has_display() -> bool:
    return not sys.platform.startswith("linux") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _gpu_mb(store: Path, size: tuple[int, int]) -> float:
    command = [sys.executable, "-c", _GPU.format(*size), str(store)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, check=True)
    return float(done.stdout.split()[-1]) / 1e6


def _row(name: str, runs: list[tuple[float, float | None]], gpu_mb: float | None) -> dict[str, Any]:
    seconds = [run[0] for run in runs]
    peaks = [run[1] for run in runs if run[1] is not None]
    return {
        "command": name,
        "seconds_to_first_frame": statistics.median(seconds),
        "seconds_min": min(seconds),
        "seconds_max": max(seconds),
        "rss_mb": statistics.median(peaks) if peaks else None,
        "gpu_mb": gpu_mb,
    }


def _box(folder: Path, progress: Progress) -> Path:
    """The built-in box, baked as coarsely as will do: what is in the texels does not matter here."""
    from lambent.bake.bake import bake
    from lambent.bake.quality import quality_named
    from lambent.scenes import load_scene

    coarse = replace(quality_named("preview"), name="coarse", light_map_texels=128, light_map_samples=(32, 32))
    bake(load_scene("builtin:box"), folder, quality=coarse, progress=progress)
    return folder
