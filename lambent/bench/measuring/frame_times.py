"""Frame times relative to diffuse light alone; rows are timed in turns, so that a slow machine slows all of them."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from statistics import median
from typing import Any

import numpy as np

from lambent.core.progress import Progress
from lambent.realtime.frame_state import FrameState
from lambent.realtime.renderer import Renderer

BY_N = ("rings", "lobe-4.25", "fis")  # split-sum and diffuse do not depend on n


@dataclass(frozen=True)
class Effort:
    """Size of the frame in pixels, the sample counts n, and the repetitions of each row."""

    width: int = 1680
    height: int = 1050
    ns: tuple[int, ...] = (3, 5, 7, 9, 11, 13, 15, 17, 19)
    rounds: int = 5


FULL, QUICK = Effort(), Effort(560, 350)


@dataclass(frozen=True)
class Row:
    """A renderer, the frame it draws, and the times so far."""

    coverage: str
    renderer: Renderer
    state: FrameState
    gpu_ms: list[float] = field(default_factory=list)
    wall_ms: list[float] = field(default_factory=list)

    def in_floors(self, floor: Row) -> list[float]:
        """The times, each relative to the diffuse frame of the same round."""
        return [a / b for a, b in zip(self.wall_ms, floor.wall_ms, strict=True)]


def report(effort: Effort, scenes: Mapping[str, tuple[Renderer, FrameState]], progress: Progress) -> dict[str, Any]:
    """Rows integrator x coverage x n of a bench, and their summary.

    Parameters
    ----------
    scenes : mapping
        For each coverage, "full" and "half": a renderer, and a frame that fills that share of the image.
    """
    kinds = [("diffuse", None), ("split-sum", None), *((name, n) for n in effort.ns for name in BY_N)]
    rows = [
        Row(coverage, renderer, replace(state, integrator=integrator, n=n))
        for coverage, (renderer, state) in scenes.items()
        for integrator, n in kinds
    ]
    renderer, full = scenes["full"]
    sizes = [{side: round(getattr(effort, side) * k**0.5) for side in ("width", "height")} for k in (0.5, 2.0)]
    scaled = [Row("full", renderer, replace(full, integrator="rings", n=7, **size)) for size in sizes]
    measure([*rows, *scaled], effort.rounds, progress)
    floors = {row.coverage: row for row in rows if row.state.integrator == "diffuse"}
    return {"rows": [row_of(row, floors[row.coverage]) for row in rows], "summary": summary_of(rows, floors, scaled)}


def measure(rows: Sequence[Row], rounds: int, progress: Progress) -> None:
    """Draw all rows once to warm up, then `rounds` times in turns, every second round backwards."""
    for index in range(rounds + 1):
        for done, row in enumerate(rows if index % 2 else rows[::-1]):
            started = time.perf_counter()
            row.renderer.draw(row.state)
            row.renderer.finish()
            wall_ms = (time.perf_counter() - started) * 1e3
            if index > 0:
                row.wall_ms.append(wall_ms)
                row.gpu_ms.append(sum(row.renderer.statistics["gpu_ms"].values()) or wall_ms)
            progress(index * len(rows) + done + 1, (rounds + 1) * len(rows), f"{row.state.integrator} n {row.state.n}")


def row_of(row: Row, floor: Row) -> dict[str, Any]:
    state, wall_ms, ratios = row.state, median(row.wall_ms), row.in_floors(floor)
    samples = (state.n or 0) * state.width * state.height * (1.0 if row.coverage == "full" else 0.5)
    return {
        "integrator": state.integrator,
        "coverage": row.coverage,
        "n": state.n,
        "width": state.width,
        "height": state.height,
        "gpu_ms": round(median(row.gpu_ms), 3),
        "gpu_ms_spread": _spread(row.gpu_ms),
        "wall_ms": round(wall_ms, 3),
        "wall_ms_spread": _spread(row.wall_ms),
        "fps": round(1e3 / wall_ms, 2),
        "samples_per_s": round(samples / wall_ms * 1e3),
        "times_diffuse": round(median(ratios), 3),
        "times_diffuse_spread": _spread(ratios),
    }


def linear_fit(rows: Sequence[Row], floor: Row) -> dict[str, float]:
    """Fit time = offset + per_sample n, in diffuse frames; also the largest deviation of a row from the line."""
    n = np.array([row.state.n for row in rows], float)
    times = np.array([median(row.in_floors(floor)) for row in rows])
    slope, offset = np.polyfit(n, times, 1)
    deviation = np.abs(times - offset - slope * n).max()
    return {key: round(float(v), 3) for key, v in (("per_sample", slope), ("offset", offset), ("deviation", deviation))}


def summary_of(rows: Sequence[Row], floors: Mapping[str, Row], scaled: Sequence[Row]) -> dict[str, Any]:
    """Milliseconds per integrator and n at full coverage, linear fits, and the exponent of time in pixels."""
    small, large = scaled
    growth = np.log(median(large.wall_ms) / median(small.wall_ms)) / np.log(4)
    wall_ms: dict[str, dict[str, float]] = {}
    for row in rows:
        if row.coverage == "full":
            wall_ms.setdefault(row.state.integrator, {})[str(row.state.n)] = round(median(row.wall_ms), 2)
    linear = {
        coverage: {
            name: linear_fit([row for row in rows if (row.state.integrator, row.coverage) == (name, coverage)], floor)
            for name in BY_N
        }
        for coverage, floor in floors.items()
    }
    return {"wall_ms_full": wall_ms, "linear_in_diffuse_frames": linear, "growth": round(float(growth), 3)}


def _spread(values: Sequence[float]) -> list[float]:
    return [round(min(values), 3), round(max(values), 3)]
