"""`visibility`: shadow rays saved by coherence (Ben-Artzi 2007, chapter 8), and whether that saves time.

Each variant predicts the visibility of the lights from every pixel and traces the doubtful ones; `TRUE` traces all
rays, as the transport of a view does. `traced_percent` and `wrong_percent` are shares of the pairs of a pixel and a
light in front of its surface; lights behind it, which transmission needs, take time only in `TRUE`. `ray_seconds` is
the part of `seconds` spent tracing rays.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from lambent.bench.scenes.visibility_scenes import CASES
from lambent.core.arrays import Flags
from lambent.core.progress import Progress, silent, tracked

NAME = "visibility"


@dataclass(frozen=True)
class Effort:
    """Side of the picture in pixels, numbers of lights, and timings per method, taken in turns."""

    size: int
    lights: tuple[int, ...]
    runs: int = 5


FULL = Effort(513, (50, 100, 200, 400))
QUICK = Effort(65, (200,))


def run(effort: Effort, progress: Progress = silent) -> dict[str, Any]:
    """Rows per scene, number of lights and method; the summary has the fastest method per scene and number."""
    rows, fastest = [], []
    for name, count in tracked([(n, c) for n in CASES for c in effort.lights], progress, "scenes"):
        rows += (found := _rows(name, count, effort))
        fastest.append({key: min(found, key=lambda row: row["seconds"])[key] for key in ("scene", "lights", "variant")})
    return {"rows": rows, "summary": {"size": effort.size, "runs": effort.runs, "fastest": fastest}}


def _rows(name: str, count: int, effort: Effort) -> list[dict[str, Any]]:
    from lambent.baking.engine import engine

    engine()
    from lambent.baking.tracing.scene_builder import SceneBuilder
    from lambent.baking.transport.view_points import view_points
    from lambent.baking.transport.visibility import visibility
    from lambent.published.visibility import VARIANTS, Predicted, predicted_visibility

    case, size = CASES[name], effort.size
    builder, lights = SceneBuilder(case.scene()), case.lights(count)
    traced = builder.build()
    points = view_points(builder, traced, case.camera, size, size)

    def of(variant: str) -> Callable[[], Predicted]:
        return lambda: predicted_visibility(traced, points, lights.centres, size, size, VARIANTS[variant])

    truth = unpacked(visibility(traced, points, lights), len(lights))
    methods: dict[str, Callable[[], Any]] = {"TRUE": lambda: visibility(traced, points, lights)}
    methods |= {variant: of(variant) for variant in VARIANTS}
    seconds: dict[str, list[float]] = {variant: [] for variant in methods}
    found: dict[str, Predicted] = {}
    for _ in range(effort.runs):
        for variant, method in methods.items():
            began = time.perf_counter()
            result = method()
            seconds[variant].append(time.perf_counter() - began)
            if isinstance(result, Predicted):
                found[variant] = result
    return [
        {
            "scene": name,
            "variant": variant,
            "lights": len(lights),
            "traced_percent": round(found[variant].traced_percent, 3) if variant in found else 100.0,
            "wrong_percent": round(found[variant].wrong_percent(truth), 5) if variant in found else 0.0,
            "seconds": round(statistics.median(times), 4),
            "seconds_min": round(min(times), 4),
            "seconds_max": round(max(times), 4),
            "ray_seconds": round(found[variant].ray_seconds, 4) if variant in found else None,
        }
        for variant, times in seconds.items()
    ]


def unpacked(words: np.ndarray, lights: int) -> Flags:
    """(P, lights) bool of visibility in words (ceil(lights / 32), P) of 32 bits."""
    m = np.arange(lights)
    return np.asarray((words[m // 32] >> (m % 32)[:, None].astype(np.uint32)).T & 1 == 1)
