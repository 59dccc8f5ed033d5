"""`equal-time`: traced pictures and frames in motion against path tracing, by error and by time.

Rows are scene x method. `frame` is the window's frame in motion. `traced N` is the picture at rest with N samples per
pixel, and `path N spp` has N whole paths; both include albedo, normals and the denoiser. All are compared as displayed.
Times are processor time over all cores on a software adapter, where drawing and tracing share a processor; on a
graphics card they are seconds. Kernels are compiled and the scene is loaded before timing starts. The row marked
`equal` has the fewest paths that take at least the frame's time, so that the comparison never favours the frame.

`equal_error` in the summary has the times at which traced pictures and path tracing reach a mean FLIP of COMPARED,
interpolated between rows on log time, or the least FLIP that path tracing reaches, and their ratio.

The truth is path traced with the store's own materials in two halves, or the mean of finished pictures of the first
camera (`--reference`), which then set the size of the rows. `reference_flip` is the FLIP between the halves, or between
every second picture and the others: two independent errors, each 1.4 times that of the truth, and a part of every
figure. A single picture has none.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lambent.bench.measuring.reference import Truth, compile_kernels, finished, path_traced_parts, with_samples
from lambent.bench.scenes.views import first_camera, inputs_or_baked
from lambent.core.arrays import Floats
from lambent.core.progress import Progress, part_of, silent
from lambent.core.views.camera import Camera
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.device import adapter_info, open_device
from lambent.realtime.renderer import Renderer
from lambent.store.contract import scene_record
from lambent.store.source import scene_of
from lambent.store.store import Store
from lambent.traced.picture import TracedPicture
from lambent.traced.room import room_of_paths, room_of_store

if TYPE_CHECKING:
    from lambent.baking.pictures.tracer import Tracer

NAME = "equal-time"
COMPARED = 0.06  # mean FLIP


@dataclass(frozen=True)
class Effort:
    """Pixels, samples of the truth, timings, compared numbers of samples; the scene if no store is given."""

    width: int = 960
    height: int = 540
    truth_spp: int = 1024
    runs: int = 5
    samples: tuple[int, ...] = (1, 4, 16, 32, 64)
    scene: str = "builtin:room"


FULL, QUICK = Effort(), Effort(320, 180, 64, 3, (1, 4, 20), "builtin:box")


def run(
    effort: Effort, inputs: Sequence[Path] = (), reference: Sequence[Path] = (), progress: Progress = silent
) -> dict[str, Any]:
    """Rows of the inputs, which are baked stores; without inputs, of a scene baked here in `preview`.

    `reference`: finished pictures of the only input's first camera, with equal samples and different seeds.
    """
    pictures = finished(reference, inputs)
    with inputs_or_baked(inputs, effort.scene, progress) as stores:
        parts = [part_of(progress, k, k + 1, s.folder.name) for k, s in enumerate(stores)]
        rows = [
            row for store, part in zip(stores, parts, strict=True) for row in rows_of(store, effort, part, pictures)
        ]
    return {"rows": rows, "summary": summary(rows)}


def rows_of(
    store: Store, effort: Effort, progress: Progress = silent, pictures: Sequence[Floats] = ()
) -> list[dict[str, Any]]:
    """The frame and its rivals in the first camera of a store; `pictures` (H, W, 3) are finished references of it."""
    if pictures:
        effort = replace(effort, width=pictures[0].shape[1], height=pictures[0].shape[0])
    camera, size = first_camera(store, scene_record(store)), (effort.width, effort.height)
    device = open_device()
    clock = time.process_time if adapter_info(device).is_software else time.perf_counter
    paths = room_of_paths(scene_of(store)).tracer
    truth = Truth.of(pictures or path_traced_parts(paths, camera, size, effort.truth_spp, 2, progress))

    def row(method: str, seconds: list[float], errors: dict[str, Any]) -> dict[str, Any]:
        times = {"seconds": statistics.median(seconds), "seconds_min": min(seconds), "seconds_max": max(seconds)}
        return {"scene": store.folder.name, "method": method, **times, **errors}

    rivals = [
        row(f"path {n} spp", taken, truth.errors(image))
        for n, image, taken in _converging(paths, camera, size, effort, clock, path=True)
    ]
    del paths  # kernels contain the materials of every live scene
    tracer = room_of_store(store, scene_of(store)).tracer
    traced = [
        row(f"traced {n}", taken, truth.errors(image))
        for n, image, taken in _converging(tracer, camera, size, effort, clock, path=False)
    ]
    renderer = Renderer(device, store)
    state = FrameState(camera, *size, exposure_ev=truth.exposure_ev, view_transform="linear")
    renderer.display_image(state)  # compiles
    taken = []
    for _ in range(effort.runs):
        begun = clock()
        image = renderer.display_image(state)
        taken.append(clock() - begun)
    frame = row("frame", taken, truth.errors_shown(image.astype(np.float32) / 255))
    equal = next((one for one in rivals if one["seconds"] >= frame["seconds"]), rivals[-1])
    return [{**one, "equal": one is equal} for one in (frame, *traced, *rivals)]


def _converging(
    tracer: Tracer, camera: Camera, size: tuple[int, int], effort: Effort, clock: Callable[[], float], *, path: bool
) -> Iterator[tuple[int, Floats, list[float]]]:
    """Compared numbers of samples, their denoised picture, and the seconds from the first ray to it in each run."""
    compile_kernels(tracer, camera, path=path)
    taken: dict[int, list[float]] = {n: [] for n in effort.samples}
    images: dict[int, Floats] = {}
    for _ in range(effort.runs):
        picture, begun = TracedPicture(tracer, camera, size, seed=9, path=path), clock()
        picture.guides()
        tracing = clock() - begun
        for n in effort.samples:
            begun = clock()
            with_samples(picture, n)
            traced = clock()
            images[n] = picture.denoised()
            tracing += traced - begun
            taken[n].append(tracing + clock() - traced)
    for n in effort.samples:
        yield n, images[n], taken[n]


def summary(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """By scene, FLIP of the rival of equal time relative to the frame's, its time in frames, and `equal_error`."""
    frames = {row["scene"]: row for row in rows if row["method"] == "frame"}
    equal = [row for row in rows if row["equal"]]
    return {
        "flip_of_path_over_frame": {r["scene"]: round(r["flip"] / frames[r["scene"]]["flip"], 3) for r in equal},
        "time_of_path_over_frame": {r["scene"]: round(r["seconds"] / frames[r["scene"]]["seconds"], 2) for r in equal},
        "equal_error": {scene: _equal_error([row for row in rows if row["scene"] == scene]) for scene in frames},
    }


def _equal_error(rows: Sequence[dict[str, Any]]) -> dict[str, float | None]:
    """flip, the seconds in which traced and path reach it, and their ratio; None if it is not reached."""
    series = {kind: [row for row in rows if row["method"].startswith(kind)] for kind in ("traced", "path")}
    flip = max(COMPARED, min(row["flip"] for row in series["path"]))
    traced, path = (seconds_to(flip, one) for one in series.values())
    ratio = round(traced / path, 3) if traced and path else None
    return {"flip": flip, "traced": traced, "path": path, "ratio": ratio}


def seconds_to(flip: float, rows: Sequence[dict[str, Any]]) -> float | None:
    """Seconds in which a series of pictures reaches a FLIP, at most those of its first picture; None if it does not."""
    at = next((k for k, row in enumerate(rows) if row["flip"] <= flip), None)
    if at is None:
        return None
    before, after = rows[max(0, at - 1)], rows[at]
    share = (before["flip"] - flip) / (before["flip"] - after["flip"]) if at else 1.0
    logs = [math.log(row["seconds"]) for row in (before, after)]
    return round(math.exp(logs[0] + share * (logs[1] - logs[0])), 3)
