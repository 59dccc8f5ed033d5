"""`load`: time from a cold start to a command's first frame, and its peak memory.

Every run is a separate process, so that the figure includes imports, pipelines and reading the store. `render` ends
with its frame; `walk` is a window that closes after one frame and needs a display; `--help` is start-up alone.
`gpu_mb` is the size of the buffers and textures of that frame, counted at creation, not reported by a driver.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lambent.core.errors import UserError
from lambent.core.machine import has_display, python_environment
from lambent.core.progress import Progress, silent

NAME = "load"
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
from lambent.render import Settings, images
from lambent.store.contract import scene_record
from lambent.store.store import Store
store = Store.open(sys.argv[1])
drawn = images(store, Settings({0}, {1}), moving=True)  # holds what is counted
drawn.displayed(scene_record(store).cameras[0])
print("bytes", wgpu.diagnostics.object_counts.get_dict()["total"]["resource_mem"])
"""


@dataclass(frozen=True)
class Effort:
    """Size of the frame in pixels, and the runs per command."""

    width: int = 1680
    height: int = 1050
    runs: int = 5


FULL, QUICK = Effort(), Effort(640, 400)


def run(effort: Effort, inputs: Sequence[Path] = (), progress: Progress = silent) -> dict[str, Any]:
    """Rows per command on the first input, a baked store; without input, on the built-in box baked here."""
    with tempfile.TemporaryDirectory() as folder:
        store = inputs[0] if inputs else _box(Path(folder) / "box.store", progress)
        size, runs = (effort.width, effort.height), effort.runs
        commands = _commands(store, Path(folder) / "frame.png", size)
        measured: dict[str, list[tuple[float, float | None]]] = {name: [] for name in commands}
        for turn in range(runs):
            for index, (name, command) in enumerate(commands.items()):
                progress(turn * len(commands) + index, runs * len(commands), f"load: {name}")
                measured[name].append(timed(command))
        drawing = [sys.executable, "-c", _GPU.format(*size), str(store)]
        done = subprocess.run(
            drawing, capture_output=True, text=True, timeout=TIMEOUT_S, check=True, env=python_environment()
        )
        gpu_mb = float(done.stdout.split()[-1]) / 1e6
    rows = [_row(name, times, gpu_mb if name != "--help" else None) for name, times in measured.items()]
    return {"rows": rows, "summary": {"width": size[0], "height": size[1], "runs": runs, "store": store.name}}


def timed(command: list[str]) -> tuple[float, float | None]:
    """(seconds, peak resident memory in MB or None if the system does not report it) of one process.

    Raises
    ------
    UserError
        If the command fails.
    """
    # Through a small separate process: a forked child's peak starts at its parent's memory.
    timing = [sys.executable, "-c", _TIMED, *command]
    done = subprocess.run(timing, capture_output=True, text=True, timeout=TIMEOUT_S, env=python_environment())
    if done.returncode != 0:
        last = done.stderr.strip().splitlines()[-1:] or [f"code {done.returncode}"]
        raise UserError(f"command failed ({last[0]})", field=" ".join(command[2:5]))
    seconds, peak = json.loads(done.stdout.splitlines()[-1])
    return seconds, peak


def _commands(store: Path, frame: Path, size: tuple[int, int]) -> dict[str, list[str]]:
    lambent = [sys.executable, "-m", "lambent.cli.main"]
    still = [*lambent, "render", str(store), "-o", str(frame), "--size", f"{size[0]}x{size[1]}"]
    commands = {"--help": [*lambent, "--help"], "render": still}
    if has_display():
        commands["walk"] = [sys.executable, "-c", _WALK.format(*size), str(store)]
    return commands


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
    """The built-in box, baked coarsely: its texel values do not matter here."""
    from lambent.baking.bake import bake
    from lambent.baking.quality import quality_named
    from lambent.scenes.loaders.load import load_scene

    coarse = quality_named("preview").changed("coarse", geometry={"texels": 128})
    bake(load_scene("builtin:box"), folder, quality=coarse, progress=progress)
    return folder
