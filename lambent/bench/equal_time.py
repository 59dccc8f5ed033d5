"""`equal-time`: one frame in motion against path tracing with Open Image Denoise, by error and by time.

Rows are scene x method. `frame` is the window's frame in motion; `path N spp` is N paths per pixel plus albedo, normals
and the denoiser; both are compared as displayed. Times are processor time over all cores on a software adapter, where
drawing and path tracing share a processor; on a graphics card they are seconds. Kernels are compiled and the scene is
loaded before timing starts. The row marked `equal` has the fewest paths that take at least the frame's time, so that
the comparison never favours the frame.

The truth is path traced with the store's own materials in two halves, or the mean of finished pictures of the first
camera (`--reference`), which then set the size of the rows. `reference_flip` is the FLIP between the halves, or between
every second picture and the others: two independent errors, each 1.4 times that of the truth, and a part of every
figure. A single picture has none.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from lambent.bench.reference import finished
from lambent.bench.views import first_camera, given_or_baked
from lambent.core import metrics
from lambent.core.arrays import Floats
from lambent.core.colour import srgb_encode
from lambent.core.errors import UserError
from lambent.core.progress import Progress, part_of, silent
from lambent.realtime.device import adapter_info, open_device
from lambent.realtime.frame_state import FrameState
from lambent.realtime.renderer import Renderer
from lambent.store.contract import scene_record
from lambent.store.source import scene_of
from lambent.store.store import Store

NAME = "equal-time"
T = TypeVar("T")


@dataclass(frozen=True)
class Effort:
    """Pixels, samples of the truth, timings of a frame, tried numbers of paths; the scene if no store is given."""

    width: int = 960
    height: int = 540
    truth_spp: int = 1024
    runs: int = 5
    spps: tuple[int, ...] = (1, 2, 4, 8, 16)
    scene: str = "builtin:room"


FULL, QUICK = Effort(), Effort(320, 180, 64, 3, (1, 4), "builtin:box")


def run(
    effort: Effort, inputs: Sequence[Path] = (), reference: Sequence[Path] = (), progress: Progress = silent
) -> dict[str, Any]:
    """Rows of the inputs, which are baked stores; without inputs, of a scene baked here in `preview`.

    `reference`: finished pictures of the only input's first camera, with equal samples and different seeds.
    """
    if reference and len(inputs) != 1:
        got, expected = f"{len(inputs)} inputs", "one store, of whose first camera it is a picture"
        raise UserError("a reference belongs to one store", field="--reference", got=got, expected=expected)
    pictures = finished(reference)
    with given_or_baked(inputs, effort.scene, progress) as stores:
        parts = [part_of(progress, k, k + 1, s.folder.name) for k, s in enumerate(stores)]
        rows = [
            row for store, part in zip(stores, parts, strict=True) for row in rows_of(store, effort, part, pictures)
        ]
    return {"rows": rows, "summary": summary(rows)}


def rows_of(
    store: Store, effort: Effort, progress: Progress = silent, pictures: Sequence[Floats] = ()
) -> list[dict[str, Any]]:
    """The frame and its rivals in the first camera of a store; `pictures` (H, W, 3) are finished references of it."""
    from lambent.bake.engine import engine

    engine()
    from lambent.bake.reference.denoised import DenoisedView  # imports Mitsuba, whose variant is set by `engine`

    if pictures:
        effort = replace(effort, width=pictures[0].shape[1], height=pictures[0].shape[0])
    camera = first_camera(store, scene_record(store))
    tracer = DenoisedView(scene_of(store), camera, effort.width, effort.height)
    parts = list(pictures)
    for seed in () if pictures else (1, 2):
        parts.append(tracer.image(effort.truth_spp // 2, seed))
        progress(seed, 3, "truth")
    truth = np.mean(parts, axis=0)
    exposure_ev = metrics.display_exposure(truth)

    def shown(radiance: Floats) -> Floats:
        return srgb_encode(radiance * np.float32(2.0**exposure_ev))

    def row(method: str, picture: Floats, seconds: list[float]) -> dict[str, Any]:
        flip = metrics.flip_error(encoded, picture)
        return {
            "scene": store.folder.name,
            "method": method,
            "seconds": statistics.median(seconds),
            "seconds_min": min(seconds),
            "seconds_max": max(seconds),
            "flip": round(float(flip.mean()), 4),
            "flip_worst_tile": round(float(metrics.tile_means(flip).max()), 4),
            "psnr": round(metrics.psnr(encoded, picture), 2),
            "reference_flip": reference_flip,
        }

    encoded = shown(truth)
    halves = [shown(np.mean(half, axis=0)) for half in (parts[::2], parts[1::2]) if half]
    reference_flip = round(float(metrics.flip_error(*halves).mean()), 4) if len(halves) == 2 else None
    device = open_device()
    renderer = Renderer(device, store)
    clock = time.process_time if adapter_info(device).is_software else time.perf_counter
    state = FrameState(camera, effort.width, effort.height, exposure_ev=exposure_ev, view_transform="linear")
    frame, seconds = _timed(lambda: renderer.display_image(state), effort.runs, clock)
    rows = [row("frame", frame.astype(np.float32) / 255, seconds)]
    for spp in effort.spps:
        image, taken = _timed(partial(tracer.denoised, spp, seed=9), effort.runs, clock)
        rows.append(row(f"path {spp} spp", shown(image), taken))
    rivals = rows[1:]
    equal = next((one for one in rivals if one["seconds"] >= rows[0]["seconds"]), rivals[-1])
    return [{**one, "equal": one is equal} for one in rows]


def summary(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """By scene, FLIP of the rival of equal time relative to the frame's, and the rival's time in frames."""
    frames = {row["scene"]: row for row in rows if row["method"] == "frame"}
    equal = [row for row in rows if row["equal"]]
    return {
        "flip_of_path_over_frame": {r["scene"]: round(r["flip"] / frames[r["scene"]]["flip"], 3) for r in equal},
        "time_of_path_over_frame": {r["scene"]: round(r["seconds"] / frames[r["scene"]]["seconds"], 2) for r in equal},
    }


def _timed(make: Callable[[], T], runs: int, clock: Callable[[], float]) -> tuple[T, list[float]]:
    """The last result, and the seconds of each run but the first, which compiles."""
    made, seconds = make(), []
    for _ in range(runs):
        begun = clock()
        made = make()
        seconds.append(clock() - begun)
    return made, seconds
